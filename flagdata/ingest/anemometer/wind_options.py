"""What a user may say about an anemometer log that the file itself does not."""

from __future__ import annotations

import datetime as dt
from dataclasses import dataclass, field, fields
from typing import ClassVar, Literal, TypeAlias

from flagdata.core.units import unit
from flagdata.errors import UsageError
from flagdata.ingest.anemometer.instants.log_clock import ClockChoice

ZeroOffset: TypeAlias = float | Literal["report", "estimate"]
"""What to do with a reading that is not zero in calm air: subtract this many m/s, report what the
idle stretches show and change nothing, or subtract what they show."""


@dataclass(frozen=True, kw_only=True)
class Limits:
    """Sizes beyond which a file is refused before it is parsed.

    Attributes:
        size: of the file [bytes].
        rows: lines in the file.
        line: length of a line [bytes].
    """

    size: int = 2 * 1024**3
    rows: int = 20_000_000
    line: int = 65_536

    def __post_init__(self) -> None:
        for item in fields(self):
            if getattr(self, item.name) < 1:
                raise UsageError(
                    f"limit {item.name} is below 1", where="limits", fix="give a positive limit"
                )


@dataclass(frozen=True, kw_only=True)
class WindOptions:
    """Options of `read_log`. A format that has no use for an option refuses it.

    Attributes:
        format: a name of `formats.FORMATS`; `None` takes the first guess of `sniff` when it is
            sure.
        recipe: a recipe of catalogs/sensors by name, or the path of a TOML file; implies the format
            that reads it.
        zone: of wall-clock stamps: IANA name or fixed offset; goes before the recipe's.
        encoding: of the text, a Python codec name; `None` decides by byte-order mark and validity
            as UTF-8.
        date: of the first sentence, for streams that carry the time of day alone.
        date_order: "dmy", "mdy" or "ymd" for dates that are written with numbers only; `None`
            decides by evidence or refuses.
        platform: "fixed" for a mast, "moving" for a boat or vehicle, "corrected" for one whose log
            holds wind over ground; `None` where the log shows it or does not need it.
        talker: NMEA talker whose wind is read, for streams with several instruments.
        azimuth: of the sensor's own north or bow [rad, clockwise from true north]; without it a
            sensor-relative direction stays sensor-relative.
        clock: whose stamps are right where the log's clock was set back or on: those before it
            ("first") or those after it ("last"); "sort" where all are right and the rows are out of
            order; `None` where nobody said.
        unit: of the wind's speed, for a file that does not state it; of a file that does, the
            user's word counts.
        start: instant of the first row [UTC ns], for stamps that count from a start.
        rate: readings a second [Hz] of a file whose rows carry no time; needs `start`.
        wind: which anemometer of a file that holds several, by the label that `sniff` gives it.
        columns: what the columns of a table are, in one line (see `stated_columns`).
        missing: further spellings of "no value" of a table that no recipe describes.
        expect: checks of a draft that its user has answered (keys of `draft.doubts`).
        topic: of numbers in an MCAP file; `None` takes the only one.
        zero_offset: see `ZeroOffset`; `None` is the recipe's, which is "report" unless it says
            otherwise.
        limits: see `Limits`.
    """

    format: str | None = None
    recipe: str | None = None
    zone: str | None = None
    encoding: str | None = None
    date: dt.date | None = None
    date_order: Literal["dmy", "mdy", "ymd"] | None = None
    platform: Literal["fixed", "moving", "corrected"] | None = None
    talker: str | None = None
    azimuth: float | None = None
    clock: ClockChoice | None = None
    unit: str | None = None
    start: int | None = None
    rate: float | None = None
    wind: str | None = None
    columns: str | None = None
    missing: tuple[str, ...] = ()
    expect: tuple[str, ...] = ()
    topic: str | None = None
    zero_offset: ZeroOffset | None = None
    limits: Limits = field(default_factory=Limits)
    JSON_NAMES: ClassVar = (
        *("format", "recipe", "zone", "encoding", "date", "date_order", "platform", "talker"),
        *("azimuth", "clock", "unit", "start", "rate", "wind", "columns", "missing", "expect"),
        *("topic", "zero_offset"),
    )
    """Everything that shapes the result, for a recipe hash; limits do not (they only refuse)."""
    JSON_OPTIONAL: ClassVar = frozenset(
        {"clock", "unit", "start", "wind", "rate", "columns", "missing", "expect", "topic"}
    )

    def __post_init__(self) -> None:
        if self.date_order not in (None, "dmy", "mdy", "ymd"):
            raise UsageError(
                f"the date order cannot be {self.date_order!r}",
                where="date_order",
                fix="give dmy, mdy or ymd",
            )
        if self.platform not in (None, "fixed", "moving", "corrected"):
            fix = "give fixed, moving or corrected"
            raise UsageError(f"the platform cannot be {self.platform!r}", where="platform", fix=fix)
        if self.clock not in (None, "first", "last", "sort"):
            raise UsageError(
                f"the clock cannot be {self.clock!r}",
                where="clock",
                fix="give first or last, or sort",
            )
        if self.azimuth is not None and not -7.0 < self.azimuth < 7.0:
            raise UsageError(
                f"azimuth {self.azimuth} is not in radians", where="azimuth", fix="give -2π to 2π"
            )
        if self.unit is not None and unit(self.unit, where="unit").si != "m/s":
            raise UsageError(
                f"{self.unit} is no unit of speed",
                where="unit",
                fix="give m/s, km/h, mph, kn or ft/s",
            )
        if self.rate is not None and not 1e-6 <= self.rate <= 1e5:
            raise UsageError(
                f"the rate is {self.rate:g} Hz",
                where="rate",
                fix="give readings a second, 1e-6 to 1e5",
            )
        check_zero_offset(self.zero_offset, where="zero_offset")

    def given(self) -> frozenset[str]:
        """Names of the options that a format has to heed.

        Limits, encoding, topic and a rate are settled before it; zero offset, a clock set anew and
        the platform after it, for every format alike.
        """
        of_their_own = {
            "format",
            "recipe",
            "limits",
            "encoding",
            "zero_offset",
            "clock",
            "platform",
            "rate",
            "topic",
        }
        return frozenset(
            f.name for f in fields(self) if f.name not in of_their_own and self._is_given(f.name)
        )

    def _is_given(self, name: str) -> bool:
        value = getattr(self, name)
        return bool(value) if isinstance(value, tuple) else value is not None


def check_zero_offset(value: object, *, where: str) -> None:
    """Refuse anything that is not a `ZeroOffset` or `None`.

    Raises:
        UsageError: with the forms that are allowed.
    """
    if value is None or value in ("report", "estimate"):
        return
    if isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 100:
        return
    raise UsageError(
        f"the zero offset cannot be {value!r}",
        where=where,
        fix='give "report", "estimate" or a speed in m/s',
    )
