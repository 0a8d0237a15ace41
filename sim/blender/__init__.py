"""Blender in a process of its own: the protocol, the process that is kept alive, and the worker
that runs in it.

Nothing here imports torch: the worker's side must not.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from sim.blender.environment import Environment
    from sim.blender.process import RenderError, WorkerProcess
    from sim.blender.protocol import Message, decode, encode

__getattr__ = lazy_exports(__name__, __file__)
