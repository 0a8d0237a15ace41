"""flagdata: the physics of cloth in the wind from films, logs and simulation, over a lake that keeps them.

    import flagdata

    found = flagdata.measure("example:flag")
    found.wind.value, found.wind.interval

The calls below are the public interface; each is imported when it is first used. `flagdata.dataset` has the types of
training data, `flagdata.errors` what is raised.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.installed_names import step_aside
from flagdata.lazy import lazy_exports

if TYPE_CHECKING:
    from flagdata.api.lakes import open, pairs, query  # noqa: A004  read as flagdata.open
    from flagdata.api.physics import calibrate, close_loop, measure, render, simulate
    from flagdata.api.recordings import frames, meshes, motion, wind
    from flagdata.examples import example

step_aside()

__all__ = [
    "calibrate",
    "close_loop",
    "example",
    "frames",
    "measure",
    "meshes",
    "motion",
    "open",
    "pairs",
    "query",
    "render",
    "simulate",
    "wind",
]

__getattr__ = lazy_exports(__name__, __file__)


def __dir__() -> list[str]:
    return sorted(__all__)
