"""Remeshing while simulating: triangles small where cloth bends, moves unevenly or is compressed,
large elsewhere."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from sim.remeshing.adapting import remesh_state

__getattr__ = lazy_exports(__name__, __file__)
