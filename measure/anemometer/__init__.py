"""A flag beside an anemometer becomes an anemometer: what its film shows is regressed on the log.

features    what each window of a film shows: the network's summary and its wind; and the picture's
place regression  ridge regression with neighbouring windows, chosen by cross-validation over blocks
of time intervals   conformal intervals and draws from the errors of blocks that were left out
novelty     whether a film is of the same flag, seen from the same place
reading     the reading model: from features to winds
calibration recordings and their logs → a reading model
artifact    a reading model in the lake
measuring   a film by a reading model, in the form of any other measurement
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.anemometer.networks import Network, gate_beside, network
    from measure.anemometer.reading_calibration import (
        ReadingCalibration,
        Recording,
        calibrate_reading,
    )
    from measure.anemometer.window_features import Features, Place

__getattr__ = lazy_exports(__name__, __file__)
