"""The cloth of a filmed flag with a log of the wind: weighed (`calibrate`), and tested for effects
(`close-loop`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.cloth.blown_wind import Log
    from measure.cloth.calibrate_call import folder_of, options_of, sources_of
    from measure.cloth.calibration_answer import (
        arrays_of_draws,
        phrase_quantity,
        table_of_quantities,
    )
    from measure.cloth.calibration_result import Calibration
    from measure.cloth.close_films import simulations_of
    from measure.cloth.cloth_calibration import calibrate, quantity
    from measure.cloth.cloth_posterior import weigh_cloths
    from measure.cloth.design import (
        TOGETHER,
        CalibrationOptions,
        Design,
        announce_simulations,
        designs_of,
        lasting,
        nulls,
        pairs,
        readings_of,
        simulated_values,
        weighable,
    )
    from measure.cloth.emulator import Emulator, informative
    from measure.cloth.films_verdict import close_loop, verdict_of
    from measure.cloth.flag_prior import (
        AZIMUTH,
        CLOTH,
        ELEVATION,
        NUISANCES,
        TABLES,
        Normal,
        Uncertain,
        draws,
    )
    from measure.cloth.flag_recordings import Part, films_among
    from measure.cloth.flag_simulation import (
        COLUMNS,
        OBSERVED,
        RATE,
        Discretisation,
        Flag,
        FlagBatch,
        mean_bending,
    )
    from measure.cloth.loop import FilmLoopOptions, solve
    from measure.cloth.model_evidence import Experiments
    from measure.cloth.numerics import FLAGS, MEASURED, Finer, with_errors
    from measure.cloth.observed_recording import (
        LEAST_WINDOWS,
        Observed,
        Projection,
        constant_wind,
        usable,
    )
    from measure.cloth.posterior_chart import posterior_panel
    from measure.cloth.score_test import Judged, directions, judge, score
    from measure.cloth.sight import Sight
    from measure.cloth.simulations import Simulations, of_base, of_nulls, sights_of
    from measure.cloth.tables_of_observables import of_table

__getattr__ = lazy_exports(__name__, __file__)
