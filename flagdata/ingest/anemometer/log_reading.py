"""What a format hands over, before order and quality are looked at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import BoolArray, IntArray
from flagdata.core.findings import Finding, Severity
from flagdata.core.schema import SampleFlag
from flagdata.errors import InputError, UsageError
from flagdata.ingest.anemometer.sensor_recipe import QualityRules
from flagdata.record.signals import Instants, Sensor, Series

WIND_CHANNELS = frozenset(
    {
        "wind_speed",
        "wind_x",
        "wind_y",
        "wind_z",
        "apparent_wind_speed",
        "theoretical_wind_speed",
        "wind_speed_estimate",
    }
)
"""Channels whose defects flag the sample: a missing temperature does not make the wind unusable."""


@dataclass(frozen=True, kw_only=True)
class Reading:
    """Rows of a log in the order of the file.

    Attributes:
        time: (n,) UTC nanoseconds on the device's clock, in any order.
        channels: names of schema.CHANNELS → (n,) float64 in SI, NaN where missing.
        flags: (n,) bits of schema.SampleFlag, as far as the format knows.
        line: (n,) line numbers in the file.
        sensor: the instrument.
        step: resolution of the stamps as written [ns].
        rules: what is known about the instrument's errors.
        host_time: (n,) the logging computer's clock, where the file has it.
        findings: of the format.
        stamped: whether each row has a stamp of its own; the lines of a stream have not, and cannot
            be sorted.
        described: the recipe (TOML) of the catalog's format that the file is of, "" where code
            reads it.
        drafted: the recipe (TOML) that was drafted from the file, "" where it was read by another.
        stated: whether the file itself states all that the draft says.
        understood: what in the file spoke for that draft, completed by what the user said.
    """

    time: Instants
    channels: Mapping[str, Series]
    flags: NDArray[np.uint16]
    line: IntArray
    sensor: Sensor
    step: int
    rules: QualityRules = field(default_factory=QualityRules)
    host_time: Instants | None = None
    findings: tuple[Finding, ...] = ()
    stamped: bool = True
    described: str = ""
    drafted: str = ""
    stated: bool = False
    understood: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        n = len(self.time)
        arrays = [self.flags, self.line, *self.channels.values()]
        if self.host_time is not None:
            arrays.append(self.host_time)
        if any(len(a) != n for a in arrays):
            raise InputError(
                "columns of different lengths", fix="this is a defect of the format's reader"
            )

    def take(self, rows: IntArray | BoolArray) -> Reading:
        """Returns the rows chosen, in the order given."""
        return replace(
            self,
            time=self.time[rows],
            channels={name: values[rows] for name, values in self.channels.items()},
            flags=self.flags[rows],
            line=self.line[rows],
            host_time=None if self.host_time is None else self.host_time[rows],
        )

    def with_findings(
        self, further: tuple[Finding, ...], *, flags: NDArray[np.uint16] | None = None
    ) -> Reading:
        """Returns the same rows with findings added, and other flags."""
        return replace(
            self,
            findings=(*self.findings, *further),
            flags=self.flags if flags is None else flags.astype(np.uint16),
        )

    def marked(
        self,
        rows: BoolArray,
        kind: str,
        text: str,
        *,
        flag: SampleFlag = SampleFlag.OK,
        severity: Severity = Severity.WARNING,
        value: float | None = None,
        fix: str | None = None,
    ) -> Reading:
        """Returns the same rows with a finding about some of them, at the first of these, and a
        flag at each.

        Args:
            rows: (n,); where there are none, nothing is found.
            text: the sentence, in which {n} stands for their number.
        """
        if not rows.any():
            return self
        count = int(rows.sum())
        finding = Finding(
            kind=kind,
            severity=severity,
            count=count,
            value=value,
            fix=fix,
            where=f"line {self.line[rows][0]}",
            what=text.replace("{n}", str(count)),
        )
        return self.with_findings((finding,), flags=np.where(rows, self.flags | flag, self.flags))

    def without(
        self,
        rows: BoolArray,
        kind: str,
        text: str,
        *,
        severity: Severity = Severity.WARNING,
        value: float | None = None,
        fix: str | None = None,
    ) -> Reading:
        """Returns the other rows, with a finding about those left out; see `marked`."""
        marked = self.marked(
            rows, kind, f"{text}; left out", severity=severity, value=value, fix=fix
        )
        return marked.take(~rows) if rows.any() else marked


def followed_finding(by: str) -> Finding:
    """Reports that a reader follows a description and was never tested on a real file."""
    return Finding.of(
        "read-by-description",
        f"read as {by} describes it; never tested on a real file",
        fix="compare the first rows with the file",
    )


def streams(channels: Mapping[str, Series]) -> tuple[tuple[tuple[str, ...], IntArray], ...]:
    """Kinds of wind that come in rows of their own, as sentences do, and the rows of each.

    Channels that share a row are of one kind, whatever is missing from other rows. Of a log with
    one kind all rows are its own, those without a value among them; of a log with several, those in
    which a channel of the kind has a value.

    Args:
        channels: names → (n,) values, NaN where missing.

    Returns:
        (names, indices of rows) of each kind; a kind is one of wind, so temperatures between are
            none.
    """
    n = len(next(iter(channels.values()))) if channels else 0
    present = {
        name: np.isfinite(values)
        for name, values in channels.items()
        if name in WIND_CHANNELS or name.endswith(("wind_direction", "wind_direction_magnetic"))
    }
    groups: list[tuple[set[str], BoolArray]] = []
    for name, rows_present in present.items():
        if not rows_present.any():
            continue
        names, rows = {name}, rows_present.copy()
        disjoint: list[tuple[set[str], BoolArray]] = []
        for group_names, theirs in groups:
            if bool((theirs & rows).any()):
                names |= group_names
                rows = rows | theirs
            else:
                disjoint.append((group_names, theirs))
        groups = [*disjoint, (names, rows)]
    groups = [(names, rows) for names, rows in groups if not WIND_CHANNELS.isdisjoint(names)]
    if len(groups) < 2:
        names = tuple(sorted(groups[0][0])) if groups else ()
        return ((names, np.arange(n)),)
    return tuple((tuple(sorted(names)), np.flatnonzero(rows)) for names, rows in groups)


def with_horizontal(reading: Reading, azimuth: float | None, *, where: str) -> Reading:
    """Add `wind_speed` = √(x² + y²), and with the azimuth `wind_direction`, where a log has
    components alone.

    The azimuth is the compass direction the array points to, against +x: wind along +x comes from
    there. With +z up, +y is 90° to the left of +x, so that the wind comes from azimuth - atan2(y,
    x) (Campbell Scientific, CSAT3 manual, appendix "Orientation").

    Args:
        azimuth: [rad, clockwise from true north]; `None` where nobody knows: no direction then.

    Raises:
        UsageError: an azimuth for a log without components.
    """
    channels = reading.channels
    if not {"wind_x", "wind_y"} <= set(channels) or "wind_speed" in channels:
        if azimuth is not None:
            raise UsageError(
                "an azimuth was given, but the log has no wind components",
                where=where,
                fix="leave out --azimuth; a turned vane is a rotation in the recipe",
            )
        return reading
    x, y = channels["wind_x"], channels["wind_y"]
    added = {"wind_speed": np.hypot(x, y)}
    text = "wind_speed is √(wind_x² + wind_y²)"
    fix = None
    if azimuth is None:
        text += "; no direction, since the sensor's azimuth is not known"
        fix = (
            "give the sensor's azimuth for a direction: --azimuth DEG (270 for x to the east, y to "
            "the north)"
        )
    else:
        towards = np.mod(azimuth - np.arctan2(y, x), 2 * np.pi)
        added["wind_direction"] = np.where(
            added["wind_speed"] == 0, np.nan, towards
        )  # calm air comes from nowhere
        text += f", wind_direction is from the azimuth {np.degrees(azimuth):.1f}° given"
    finding = Finding.of("speed-from-components", text, count=len(x), fix=fix)
    return replace(reading, channels={**channels, **added}, findings=(*reading.findings, finding))
