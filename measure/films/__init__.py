"""Closing the loop on films with logs of the wind, and on tables of observables: `measure.films.run.close_loop`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.films.command import simulations_of
    from measure.films.design import TOGETHER, lasting, nulls, pairs
    from measure.films.evidence import Experiments
    from measure.films.library import weighable
    from measure.films.run import Options, close_loop, solve, verdict_of
    from measure.films.score_test import score
    from measure.films.sources import films_among

__getattr__ = lazy_exports(__name__, __file__)
