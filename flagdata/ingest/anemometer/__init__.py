"""Anemometer logs of any vendor → `WindLog`: SI, UTC nanoseconds, one direction convention, every
defect reported."""

from flagdata.ingest.anemometer.anemometer_log import read_log
from flagdata.ingest.anemometer.identify import anemometers, complete_guess, sniff
from flagdata.ingest.anemometer.sniffing import Guess
from flagdata.ingest.anemometer.wind_options import Limits, WindOptions
from flagdata.record.averaging import average

__all__ = [
    "Guess",
    "Limits",
    "WindOptions",
    "anemometers",
    "average",
    "complete_guess",
    "read_log",
    "sniff",
]
