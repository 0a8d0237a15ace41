"""Anemometer logs of any vendor → `WindLog`: SI, UTC nanoseconds, one direction convention, every defect reported."""

from flagdata.averaging import average
from flagdata.ingest.anemometer.identify import anemometers, completed, sniff
from flagdata.ingest.anemometer.log import read_log
from flagdata.ingest.anemometer.options import Limits, WindOptions
from flagdata.ingest.anemometer.sniffing import Guess

__all__ = ["Guess", "Limits", "WindOptions", "anemometers", "average", "completed", "read_log", "sniff"]
