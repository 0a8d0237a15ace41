"""flagdata: the physics of cloth in the wind from films, logs and simulation, over a lake that
keeps them.

    import flagdata

    found = flagdata.measure("example:flag")
    found.wind.value, found.wind.interval

The calls below are the public interface; each is imported when it is first used. `flagdata.dataset`
has the types of training data, `flagdata.errors` what is raised, `flagdata.extend` what a package
that adds to flagdata imports, `flagdata.timebase` UTC nanoseconds, and `flagdata.__version__` the
version. Other modules may move.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from flagdata.packages.installed_names import step_aside
from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from flagdata.api.lake_verbs import branch, export, query, tag
    from flagdata.api.lakes import open, pairs  # noqa: A004  read as flagdata.open
    from flagdata.api.learning import build, evaluate, train
    from flagdata.api.measuring_verbs import calibrate, close_loop, measure, observe, propose
    from flagdata.api.physics import render, simulate
    from flagdata.api.recording_verbs import align, ingest, realign
    from flagdata.api.recordings import frames, meshes, motion, wind
    from flagdata.commands.catalog_names import catalog
    from flagdata.commands.declare import declare
    from flagdata.commands.declare_cloths import declare_cloths
    from flagdata.commands.label import label
    from flagdata.commands.lake_versions import diff, init, log, merge, withdraw
    from flagdata.commands.list_artifacts import ls, show
    from flagdata.commands.looking import du, lineage
    from flagdata.commands.transfer import clone, pull, push
    from flagdata.commands.upkeep import doctor, expire, gc, heal, recover, verify
    from flagdata.examples import example

step_aside()

__all__ = [
    "align",
    "branch",
    "build",
    "calibrate",
    "catalog",
    "clone",
    "close_loop",
    "declare",
    "declare_cloths",
    "diff",
    "doctor",
    "du",
    "evaluate",
    "example",
    "expire",
    "export",
    "frames",
    "gc",
    "heal",
    "ingest",
    "init",
    "label",
    "lineage",
    "log",
    "ls",
    "measure",
    "merge",
    "meshes",
    "motion",
    "observe",
    "open",
    "pairs",
    "propose",
    "pull",
    "push",
    "query",
    "realign",
    "recover",
    "render",
    "show",
    "simulate",
    "tag",
    "train",
    "verify",
    "wind",
    "withdraw",
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
