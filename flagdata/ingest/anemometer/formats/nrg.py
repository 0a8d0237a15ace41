"""Text exports of NRG Systems loggers: SymphoniePRO "Measurements" and the samples of their later loggers.

Source: NRG Systems, SymphoniePRO Desktop Application manual, "Exporting data": site properties with the time zone, a
history of each channel (type, description, height, scale factor, offset, units), then tab-separated rows whose columns
are called channel, type, height, bearing, statistic and unit (Ch2_Anem_85.00m_S_Avg_m/s). An anemometer that does not
turn reads its offset, not 0. Compared with one export of a SymphoniePRO and one of one-second samples.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from flagdata.errors import InputError
from flagdata.ingest.anemometer.formats.exports import Column, Export, assign, cut, read_export
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.recipe import FileLayout, TimeLayout
from flagdata.ingest.anemometer.sniffing import Guess, Head
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.signals import Sensor

_TITLES = ("NRG Export Service", "NRG Systems Data Logger", "SymphoniePRO Desktop Application")
_NAME = re.compile(r"Ch(?P<channel>\d+)_(?:.*_)?(?P<statistic>Avg|Samples)_(?P<unit>[^_]*|deg_[CF])", re.IGNORECASE)
_KINDS = (
    (r".*\banem(ometer)?\b.*|.*wind ?speed.*", "wind_speed"),
    (r".*\bvane\b.*|.*wind ?dir(ection)?.*", "wind_direction"),
    (r".*\b(baro(meter)?|bp\d*|pressure)\b.*", "air_pressure"),
    (r".*\b(rh\d*|hygro\w*|humidity)\b.*", "relative_humidity"),
    (r"(?!.*(module|panel|pv|cell|back|internal)).*\b(air )?temp(erature)?\b.*", "air_temperature"),
)
_SPEEDS = {"m/s", "mph", "km/h", "knots", "kn", "kts"}
_SPELLED = {"deg_c": "degC", "deg_f": "degF", "deg": "deg"}


class Nrg:
    """Format "nrg"."""

    name = "nrg"
    about = "NRG Systems text export (SymphoniePRO)"
    uses = frozenset({"zone"})

    def recognise(self, head: Head) -> Guess | None:
        """The exporter's name in line 1 and a heading that begins with "Timestamp"."""
        first = head.lines[0].lstrip("\ufeff").strip() if head.lines else ""
        at = _heading(head.lines)
        if not first.startswith(_TITLES) or at is None:
            return None
        reasons = (f"line 1 is {first!r}", f"line {at + 1} names the columns of NRG channels")
        return Guess(format="nrg", score=0.97, reasons=reasons)

    def read(self, source: TextFile, options: WindOptions) -> Reading:
        """Read the averages, or the samples, of the first anemometer and the first vane."""
        where = str(source.path)
        lines = source.head(1000)
        at = _heading(lines)
        if at is None:
            raise InputError("no heading with Timestamp and channels", where=where, fix="export measurements as text")
        history = _history(lines[:at])
        columns = [_column(number, text, history) for number, text in enumerate(cut(lines[at], "\t"), start=1)]
        assigned = assign(
            _device_first(columns[1:]), _KINDS, where=f"{where}, line {at + 1}", fix="describe the file by a recipe"
        )
        samples = "_Samples_" in lines[at]
        number = int(assigned.channels["wind_speed"].column)
        channel = history.get(_channel(cut(lines[at], "\t")[number - 1]), {})
        height = channel.get("height", "")
        site = {key: value for key, value in (_fact(line) for line in lines[:at]) if value}
        zone = site.get("time zone")
        export = Export(
            name=self.name,
            file=FileLayout(delimiter="\t", preamble=at, missing=("-999", "9999", "nan")),
            time=TimeLayout(columns=(1,), format="iso", zone=zone),
            sensor=Sensor(
                name=channel.get("description") or assigned.names["wind_speed"],
                height=float(height) if re.fullmatch(r"\d+(\.\d+)?", height) and float(height) > 0 else None,
                averaging=0.0 if samples else None,
            ),
            assigned=assigned,
            averaged=not samples,
            starts=not samples,
        )
        return read_export(source, export, options)


def _heading(lines: Sequence[str]) -> int | None:
    return next((i for i, line in enumerate(lines) if line.startswith("Timestamp\t") and "\tCh" in line), None)


def _fact(line: str) -> tuple[str, str]:
    key, _, value = line.partition(":")
    return key.strip().lower(), value.strip()


def _history(lines: Sequence[str]) -> Mapping[str, Mapping[str, str]]:
    """Facts of each channel by its number; the latest where there are several."""
    found: dict[str, dict[str, str]] = {}
    channel: dict[str, str] = {}
    for line in lines:
        key, value = _fact(line)
        if key == "channel":
            channel = found[value] = {}
        elif value:
            channel[key] = value
    return found


def _channel(name: str) -> str:
    match = _NAME.fullmatch(name)
    return match["channel"] if match else ""


def _column(number: int, text: str, history: Mapping[str, Mapping[str, str]]) -> Column:
    """A column called by what its channel is and measures; a statistic other than the mean keeps its own name."""
    match = _NAME.fullmatch(text[:200])
    if match is None:
        return Column(number=number, name=text)
    facts = history.get(match["channel"], {})
    about = " ".join(facts[key] for key in ("description", "type", "measurand") if facts.get(key, "Analog") != "Analog")
    spelled = match["unit"]
    kind = "wind speed" if spelled.lower() in _SPEEDS else ""
    name = " ".join(part for part in (f"Ch{match['channel']}", about.strip(), kind) if part)
    return Column(number=number, name=name, unit=_SPELLED.get(spelled.lower(), spelled))


def _device_first(columns: Sequence[Column]) -> Sequence[Column]:
    """The columns with those of the first anemometer's device before the rest.

    Channels of one digital instrument follow each other within a hundred (101 wind speed, 102 its direction, …).
    """
    speed = next((column.name for column in columns if column.name.endswith("wind speed")), "")
    return sorted(columns, key=lambda column: _hundred(column.name) != _hundred(speed))


def _hundred(name: str) -> int | None:
    match = re.match(r"Ch(\d+)", name)
    return int(match[1]) // 100 if match else None
