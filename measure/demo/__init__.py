"""The demonstration: a field recording made here, taken through the whole tool to a page one can
open."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.demo.demo_command import MINUTES, Story
    from measure.demo.demo_recording import BEFORE, START, RecordingRecipe
    from measure.demo.logger import CUP, SENSOR
    from measure.demo.tracked import TrackedRecipe, make_tracks
    from measure.demo.transcript import Transcript

__getattr__ = lazy_exports(__name__, __file__)
