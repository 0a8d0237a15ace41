"""Wind and cloth of one recording, with intervals, or the reason why not: what `flagdata measure`
does."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.estimate.combine import (
        CARD_KEY,
        OWN,
        UNKNOWN,
        Dependence,
        combine_windows,
        of_model,
    )
    from measure.estimate.film_answer import LEAST_INFORMATION, SHORT, information
    from measure.estimate.film_measuring import Measurement, measure
    from measure.estimate.film_posterior import DRAWS, FilmAnswer
    from measure.estimate.gusty_series import SERIES_KEY, Gusts, Pair, SeriesErrors, errors_of_model
    from measure.estimate.measurement_charts import winds
    from measure.estimate.measurement_page import make_head, make_sections
    from measure.estimate.measurement_pictures import steps
    from measure.estimate.measuring_options import Options
    from measure.estimate.named_cloth import weight_of
    from measure.estimate.wind_by_window import Beside, beside

__getattr__ = lazy_exports(__name__, __file__)
