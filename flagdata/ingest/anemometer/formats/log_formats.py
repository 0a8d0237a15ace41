"""The table of anemometer formats, and the contract each of them keeps.

A user's own format is a package with an entry point in the group `flagdata.formats`.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Protocol

from flagdata.ingest.anemometer.log_reading import Reading
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.text_file import TextFile
from flagdata.ingest.anemometer.wind_options import WindOptions
from flagdata.recipes.registry import Registry


class Format(Protocol):
    """A format of anemometer logs; a class without arguments.

    Attributes:
        name: its name in the table.
        about: one line.
        uses: names of the `WindOptions` it heeds; others are refused when given, but for those that
            are settled for every format alike (`WindOptions.given`). A format that names "platform"
            settles it itself.
    """

    name: str
    about: str
    uses: frozenset[str]

    def recognise(self, head: Head) -> Guess | None:
        """Checks whether the first lines look like this format, and says why; `None` where nothing
        does."""
        ...

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Reads all rows in the order of the file, in SI, instants in UTC nanoseconds. Raises
        FlagdataError only."""
        ...


_CONTRACT = ("name", "about", "uses", "recognise", "read")


def _class(entry: object) -> object:
    """Returns what makes the reader: an entry is a class, or a class with arguments."""
    return entry.func if isinstance(entry, partial) else entry


FORMATS = Registry(
    "anemometer format",
    {
        "toa5": "flagdata.ingest.anemometer.formats.toa5:Toa5",
        "delimited": "flagdata.ingest.anemometer.table.delimited:Delimited",
        "nmea": "flagdata.ingest.anemometer.formats.nmea:Nmea",
        "kestrel": "flagdata.ingest.anemometer.formats.described:Kestrel",
        "nmea-stamped": "flagdata.ingest.anemometer.formats.stamped_nmea:StampedNmea",
        "canboat": "flagdata.ingest.anemometer.formats.canboat:Canboat",
        "davis": "flagdata.ingest.anemometer.formats.described:Davis",
        "ecowitt": "flagdata.ingest.anemometer.formats.described:Ecowitt",
        "eddypro": "flagdata.ingest.anemometer.formats.described:EddyPro",
        "fluxnet": "flagdata.ingest.anemometer.formats.described:Fluxnet",
        "icos": "flagdata.ingest.anemometer.formats.described:Icos",
        "icos-ecosystem": "flagdata.ingest.anemometer.formats.described:IcosEcosystem",
        "hobo": "flagdata.ingest.anemometer.formats.described:Hobo",
        "surfrad": "flagdata.ingest.anemometer.formats.described:Surfrad",
        "gill": "flagdata.ingest.anemometer.formats.makers:Gill",
        "metek": "flagdata.ingest.anemometer.formats.makers:Metek",
        "trisonica": "flagdata.ingest.anemometer.formats.makers:TriSonica",
        "vaisala": "flagdata.ingest.anemometer.formats.makers:Vaisala",
        "young": "flagdata.ingest.anemometer.formats.makers:Young",
        "thies": "flagdata.ingest.anemometer.formats.makers:Thies",
        "ft": "flagdata.ingest.anemometer.formats.makers:Ft",
        "nrg": "flagdata.ingest.anemometer.formats.nrg:Nrg",
        "weatherlink": "flagdata.ingest.anemometer.formats.described:WeatherLink",
        "windographer": "flagdata.ingest.anemometer.formats.described:Windographer",
        "zentra": "flagdata.ingest.anemometer.formats.described:Zentra",
        "host-stamped": "flagdata.ingest.anemometer.formats.host:HostStamped",
    },
    group="flagdata.formats",
    accepts=lambda entry: (
        callable(entry) and all(hasattr(_class(entry), name) for name in _CONTRACT)
    ),
)
SIGNATURES: Mapping[str, tuple[str, ...]] = {"toa5": ('"TOA5"', "TOA5,")}
"""Formats whose makers write these at the beginning of every file: no other format is asked about
one."""
