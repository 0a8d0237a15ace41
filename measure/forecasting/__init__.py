"""The problem: an experiment made ready, the model of its cloth, the regressors it may differ
along, its forecasts.

It may import `measure.trajectories` and the simulator, and no other stage of a verdict.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.forecasting.alignment import align_experiment
    from measure.forecasting.calibrated_parameters import PRIOR, THETA, Calibration
    from measure.forecasting.model import Model, errors_of
    from measure.forecasting.observer import Forecaster
    from measure.forecasting.regressors import (
        TURNED,
        AcrossColumn,
        Column,
        EffectColumn,
        FieldColumn,
        columns,
        fields,
        library,
        names,
        winds,
    )
    from measure.forecasting.segments import Cut, Segments
    from measure.forecasting.setting import Design, Setting
    from measure.forecasting.strengths import Suspicion, on_films, on_markers, why_unweighed

__getattr__ = lazy_exports(__name__, __file__)
