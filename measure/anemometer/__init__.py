"""A flag beside an anemometer becomes an anemometer: what its film shows is regressed on the log.

reading_calibration     recordings and their logs → a reading model
making                  a reading model in the lake
anemometer_measuring    a film by a reading model, in the form of any other measurement
reading_answer          what the calibration says

The reading model itself is in `measure.measuring_model`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.anemometer.reading_calibration import (
        ReadingCalibration,
        Recording,
        calibrate_reading,
    )

__getattr__ = lazy_exports(__name__, __file__)
