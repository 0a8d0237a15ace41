"""Text exports of NRG Systems loggers: names of columns by the history of the channels that stands
above them.

What the columns mean is in catalogs/sensors/formats/nrg.toml. An anemometer that does not turn
reads its offset, not 0.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

from flagdata.core.numbered import read_bounded
from flagdata.ingest.anemometer.formats.described import Described
from flagdata.ingest.anemometer.formats.recipe_headings import Column, Heading
from flagdata.ingest.anemometer.log_reading import Reading
from flagdata.ingest.anemometer.text.text_file import TextFile
from flagdata.ingest.anemometer.wind_options import WindOptions

_CHANNELS = 99_999
_NAME = re.compile(
    r"Ch(?P<channel>\d+)_(?:.*_)?(?P<statistic>Avg|Samples)_(?P<unit>[^_]*|deg_[CF])", re.IGNORECASE
)
_SPEEDS = {"m/s", "mph", "km/h", "knots", "kn", "kts"}
_SPELLED = {"deg_c": "degC", "deg_f": "degF", "deg": "deg"}


class Nrg(Described):
    """Format "nrg"."""

    def __init__(self) -> None:
        super().__init__("nrg")

    def named(self, heading: Heading, lines: Sequence[str]) -> Heading:
        """Columns called by what their channels are and measure, those of the first anemometer's
        device first.

        Channels of one digital instrument follow each other within a hundred (101 wind speed, 102
        its direction, …).
        """
        history = _history(lines[: heading.at])
        columns = [_column(column, history) for column in heading.columns]
        speed = next((column.name for column in columns if column.name.endswith("wind speed")), "")
        ordered = sorted(
            columns,
            key=lambda column: _hundred_of_channel(column.name) != _hundred_of_channel(speed),
        )
        return replace(heading, columns=ordered)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read the averages, or the samples, of the first anemometer and the first vane."""
        done = self.completed(source, options)
        lines = source.head(done.recipe.file.preamble + 1)
        reading = self.table(source, done, options).reading
        number = re.match(r"Ch(\d+)", done.channels["wind_speed"].name)
        channel = _history(lines[:-1]).get(number[1] if number else "", {})
        height = channel.get("height", "")
        if "_Samples_" in lines[-1]:
            done = replace(done, averaged=False, starts=False)
            reading = replace(reading, sensor=replace(reading.sensor, averaging=0.0))
        sensor = replace(
            reading.sensor,
            name=channel.get("description") or reading.sensor.name,
            height=float(height)
            if re.fullmatch(r"\d+(\.\d+)?", height) and float(height) > 0
            else None,
        )
        return self.finish_reading(
            replace(reading, sensor=sensor), done, options, where=str(source.path)
        )


def _history(lines: Sequence[str]) -> Mapping[str, Mapping[str, str]]:
    """Facts of each channel by its number; the latest where there are several."""
    facts: dict[str, dict[str, str]] = {}
    channel: dict[str, str] = {}
    for line in lines:
        key, _, value = (part.strip() for part in line.partition(":"))
        if key.lower() == "channel":
            channel = facts[value] = {}
        elif value:
            channel[key.lower()] = value
    return facts


def _column(column: Column, history: Mapping[str, Mapping[str, str]]) -> Column:
    """Names a column by what its channel is and measures; a statistic other than the mean keeps its
    own name."""
    match = _NAME.fullmatch(column.name[:200])
    if match is None:
        return column
    facts = history.get(match["channel"], {})
    about = " ".join(
        facts[key]
        for key in ("description", "type", "measurand")
        if facts.get(key, "Analog") != "Analog"
    )
    spelled = match["unit"]
    kind = "wind speed" if spelled.lower() in _SPEEDS else ""
    name = " ".join(part for part in (f"Ch{match['channel']}", about.strip(), kind) if part)
    return replace(column, name=name, unit=_SPELLED.get(spelled.lower(), spelled))


def _hundred_of_channel(name: str) -> int | None:
    match = re.match(r"Ch(\d+)", name)
    number = read_bounded(match[1], most=_CHANNELS) if match else None
    return None if number is None else number // 100
