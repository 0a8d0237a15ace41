"""The table of anemometer formats, and the contract each of them keeps.

A user's own format is a package with an entry point in the group `flagdata.formats`.
"""

from __future__ import annotations

from typing import Protocol

from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.source import TextFile
from flagdata.registry import Registry


class Format(Protocol):
    """A format of anemometer logs; a class without arguments.

    Attributes:
        name: its name in the table.
        about: one line.
        uses: names of the `WindOptions` it heeds; others are refused when given, but for those that are settled for
            every format alike (`WindOptions.given`). A format that names "platform" settles it itself.
    """

    name: str
    about: str
    uses: frozenset[str]

    def recognise(self, head: Head) -> Guess | None:
        """Whether the first lines look like this format, and why; `None` where nothing does."""
        ...

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """All rows in the order of the file, in SI, instants in UTC nanoseconds. Raises FlagdataError only."""
        ...


FORMATS = Registry(
    "anemometer format",
    {
        "delimited": "flagdata.ingest.anemometer.delimited:Delimited",
        "nmea": "flagdata.ingest.anemometer.nmea:Nmea",
        "kestrel": "flagdata.ingest.anemometer.kestrel:Kestrel",
        "toa5": "flagdata.ingest.anemometer.toa5:Toa5",
        "nmea-stamped": "flagdata.ingest.anemometer.stamped_nmea:StampedNmea",
        "canboat": "flagdata.ingest.anemometer.canboat:Canboat",
        "davis": "flagdata.ingest.anemometer.davis:Davis",
        "ecowitt": "flagdata.ingest.anemometer.ecowitt:Ecowitt",
        "eddypro": "flagdata.ingest.anemometer.eddypro:EddyPro",
        "fluxnet": "flagdata.ingest.anemometer.fluxnet:Fluxnet",
        "icos": "flagdata.ingest.anemometer.icos:Icos",
        "hobo": "flagdata.ingest.anemometer.hobo:Hobo",
        "surfrad": "flagdata.ingest.anemometer.surfrad:Surfrad",
        "gill": "flagdata.ingest.anemometer.gill:Gill",
        "metek": "flagdata.ingest.anemometer.metek:Metek",
        "trisonica": "flagdata.ingest.anemometer.trisonica:TriSonica",
        "vaisala": "flagdata.ingest.anemometer.vaisala:Vaisala",
        "young": "flagdata.ingest.anemometer.young:Young",
        "nrg": "flagdata.ingest.anemometer.nrg:Nrg",
        "windographer": "flagdata.ingest.anemometer.windographer:Windographer",
        "zentra": "flagdata.ingest.anemometer.zentra:Zentra",
        "host-stamped": "flagdata.ingest.anemometer.host:HostStamped",
    },
    group="flagdata.formats",
)
