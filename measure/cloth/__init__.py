"""The cloth of a filmed flag with a log of the wind: weighed (`calibrate`), and tested for effects (`close-loop`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.cloth.arrays import folder_of, options_of, sources_of
    from measure.cloth.calibration import Calibration, calibrate, quantity
    from measure.cloth.command import simulations_of
    from measure.cloth.design import (
        TOGETHER,
        CalibrationOptions,
        Design,
        announced,
        designs_of,
        lasting,
        nulls,
        pairs,
        readings_of,
        simulated,
        weighable,
    )
    from measure.cloth.emulator import Emulator, informative
    from measure.cloth.evidence import Experiments
    from measure.cloth.loop import FilmLoopOptions, solve
    from measure.cloth.numerics import FLAGS, MEASURED, Finer, with_errors
    from measure.cloth.posterior import weighed
    from measure.cloth.prior import AZIMUTH, CLOTH, ELEVATION, NUISANCES, TABLES, Normal, Uncertain, draws
    from measure.cloth.recording import LEAST_WINDOWS, Observed, Projection, constant_wind, usable
    from measure.cloth.score_test import Judged, directions, judge, score
    from measure.cloth.sight import Sight
    from measure.cloth.simulation import COLUMNS, OBSERVED, RATE, Discretisation, Flag, FlagBatch, mean_bending
    from measure.cloth.simulations import Simulations, of_base, of_nulls, sights_of
    from measure.cloth.sources import Part, films_among
    from measure.cloth.tables import of_table
    from measure.cloth.verdict import close_loop, verdict_of
    from measure.cloth.wind import Log

__getattr__ = lazy_exports(__name__, __file__)
