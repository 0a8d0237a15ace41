"""`flagdata calibrate`: the cloth of a filmed flag weighed with the log of the wind beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.calibrate.arrays import options_of, sources_of
    from measure.calibrate.calibrate import Calibration, Options, designs_of, with_errors
    from measure.calibrate.design import Design, simulated
    from measure.calibrate.discretisation import Discretisation
    from measure.calibrate.emulator import Emulator, informative
    from measure.calibrate.fabric import TABLES
    from measure.calibrate.filmed import Part
    from measure.calibrate.leaving_out import usable
    from measure.calibrate.numerics import FLAGS, MEASURED, Finer
    from measure.calibrate.observed import Observed, constant_wind
    from measure.calibrate.posterior import Sight, weighed
    from measure.calibrate.prior import AZIMUTH, CLOTH, ELEVATION, NUISANCES, Normal, Uncertain, draws
    from measure.calibrate.simulation import COLUMNS, OBSERVED, Batch, Flag, mean_bending
    from measure.calibrate.summary import LEAST_WINDOWS, Projection
    from measure.calibrate.tables import of_table
    from measure.calibrate.wind import Log
    from measure.calibrate.workload import announced

__getattr__ = lazy_exports(__name__, __file__)
