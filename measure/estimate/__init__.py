"""Wind and cloth of one recording, with intervals, or the reason why not: what `flagdata measure` does."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.estimate.answer import LEAST_INFORMATION, SHORT, information
    from measure.estimate.combine import CARD_KEY, OWN, UNKNOWN, Dependence, combined, of_model
    from measure.estimate.gusts import SERIES_KEY, Gusts, Pair, SeriesErrors, errors_of_model
    from measure.estimate.joint import DRAWS, FilmAnswer
    from measure.estimate.material import weight_of
    from measure.estimate.measuring import Measurement, measure
    from measure.estimate.options import Options
    from measure.estimate.page import Context, Section
    from measure.estimate.pictures import steps
    from measure.estimate.series import Beside, beside

__getattr__ = lazy_exports(__name__, __file__)
