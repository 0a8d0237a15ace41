"""flagdata: the physics of cloth in the wind from films, logs and simulation, over a lake that keeps them.

    import flagdata

    found = flagdata.measure("example:flag")
    found.wind.value, found.wind.interval

The calls below are the public interface; each is imported when it is first used. `flagdata.dataset` has the types of
training data, `flagdata.errors` what is raised.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from flagdata.installed_names import step_aside

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

_PLACES = {
    **dict.fromkeys(("open", "pairs", "query"), "flagdata.api.lakes"),
    **dict.fromkeys(("calibrate", "close_loop", "measure", "render", "simulate"), "flagdata.api.physics"),
    **dict.fromkeys(("frames", "meshes", "motion", "wind"), "flagdata.api.recordings"),
    "example": "flagdata.examples",
}


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_PLACES[name]), name)
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
