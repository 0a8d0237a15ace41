"""Clocks of different devices brought onto one: models with their uncertainty, and the ways to come
by them."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports
from flagdata.packages.verb_package import VerbPackage

if TYPE_CHECKING:
    from flagdata.align.apart import by_spans
    from flagdata.align.cloth_recording import ClothFilm
    from flagdata.align.declared import given
    from flagdata.align.drift import clock_line
    from flagdata.align.film_motion import MotionSeries, motion_energy
    from flagdata.align.film_recording import Pair, make_recording
    from flagdata.align.lag import LagEstimate, LagSearch, estimate_offset
    from flagdata.align.logs import LogClock, log_clock
    from flagdata.align.methods import ClockOptions, Method, evidence
    from flagdata.align.paired import host_clock, pair_clocks
    from flagdata.align.plot import check, draw
    from flagdata.align.windbins import wind_bins

__getattr__ = lazy_exports(__name__, __file__)
_VERB = "flagdata.api.recording_verbs:align"
sys.modules[__name__].__class__ = VerbPackage
