"""What is looked at in the errors of forecasts: sums along the regressors, spectral lines, moments,
the wind's course.

It may import `measure.forecasting`, and the criteria from `measure.verdict`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.probes.lines import REDUCED, Lines, SpectralLine, strongest
    from measure.probes.segment_rows import StatisticRows
    from measure.probes.statistics import (
        Projection,
        Statistics,
        error_scale,
        projected_statistics,
        reduce_errors,
    )
    from measure.probes.wind_course import ALONG, LEFT, Course, Variation
    from measure.probes.wind_log import by_recording, lags

__getattr__ = lazy_exports(__name__, __file__)
