"""flagdata: the physics of cloth in the wind from films, logs and simulation, over a lake that keeps them.

    import flagdata

    found = flagdata.measure("example:flag")
    found.wind.value, found.wind.interval

The calls below are the public interface; each is imported when it is first used. `flagdata.dataset` has the types of
training data, `flagdata.errors` what is raised, `flagdata.extend` what a package that adds to flagdata imports, and
`flagdata.__version__` the version.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from flagdata.installed_names import step_aside
from flagdata.lazy import lazy_exports

if TYPE_CHECKING:
    from flagdata.api.lake_verbs import export, query, tag
    from flagdata.api.lakes import open, pairs  # noqa: A004  read as flagdata.open
    from flagdata.api.measuring import calibrate, close_loop, measure, observe
    from flagdata.api.physics import render, simulate
    from flagdata.api.recording_verbs import align, ingest
    from flagdata.api.recordings import frames, meshes, motion, wind
    from flagdata.examples import example

step_aside()

__all__ = [
    "align",
    "calibrate",
    "close_loop",
    "example",
    "export",
    "frames",
    "ingest",
    "measure",
    "meshes",
    "motion",
    "observe",
    "open",
    "pairs",
    "query",
    "render",
    "simulate",
    "tag",
    "wind",
]

_exported = lazy_exports(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name in ("align", "export", "ingest"):  # packages that are called as verbs
        return import_module(f"flagdata.{name}")
    if name == "__version__":
        return import_module("importlib.metadata").version("flagdata")
    return _exported(name)


def __dir__() -> list[str]:
    return sorted(__all__)
