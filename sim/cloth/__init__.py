"""The cloth: mesh, material, forces within it and by the air, contact, how it is held; the
equations of motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from sim.cloth.cloth_batch import Cloth  # which effect files of the last version import here

__getattr__ = lazy_exports(__name__, __file__)
