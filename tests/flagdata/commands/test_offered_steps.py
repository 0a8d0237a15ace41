"""Every step that a refusal or a warning of `flagdata ingest` offers works as it is printed, and reads right values.

Each case is a made log that is refused, or read with a doubt. The options that the sentence offers are taken over
letter by letter, as a user copies them, with TIME, DATE and each ? filled in, until the log is ingested.
"""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from flagdata.cli import main
from flagdata.commands.ingest import ingest
from flagdata.commands.ingest_options import wind_options
from flagdata.ingest.anemometer import anemometers, read_log
from flagdata.lake import Lake

pytestmark = pytest.mark.usefixtures("confirmed_drafts")
MOST = 4
"""Refusals on the way to a log that is ingested."""
Run = Callable[..., tuple[int, str, str]]


@dataclass(frozen=True, kw_only=True)
class Case:
    """A log, what its user takes of the sentences about it, and what it holds.

    Attributes:
        text: the log.
        takes: options that the user takes, of those that are offered.
        answers: what the user writes in place of TIME, DATE, and of each "?" of an entry, by its number.
        finding: kind of the finding that offers the step, "" where a refusal does.
        speeds: of each anemometer by its label ("" for one alone), the first and the last speed [m/s].
        direction: the first direction [deg].
        first: the first instant.
        rows: of each anemometer.
    """

    text: str
    takes: Sequence[str]
    answers: Mapping[str, str] = field(default_factory=dict)
    finding: str = ""
    speeds: Mapping[str, tuple[float, float]]
    direction: float | None = 200.0
    first: str = "2026-05-01T12:00"
    rows: int = 20


def rows(form: str, count: int = 20) -> str:
    """Rows of `form`, by the minute `m`, a speed `v` from 3.0 in steps of 0.1 and a direction `d` from 200 on."""
    return "".join(form.format(m=at, v=f"{3 + at / 10:.1f}", d=200 + at, n=at + 1) + "\n" for at in range(count))


KN, KMH = 1852 / 3600, 1 / 3.6
ONE = {"": (3.0, 4.9)}
UNEVEN = (0, 1, 5, 6, 12, 13, 15, 22, 23, 24, 31, 33, 34, 38, 41, 42, 46, 51, 52, 58)
"""Minutes of rows that come when something happens."""
CASES = {
    "zone": Case(
        text="time,wind speed (m/s),wind dir\n" + rows("2026-05-01 14:{m:02d}:00,{v},{d}"), takes=["zone"], speeds=ONE
    ),
    "unit-and-zone": Case(
        text="time,wind speed,wind dir\n" + rows("2026-05-01 14:{m:02d}:00,{v},{d}"),
        takes=["unit", "zone"], speeds=ONE,
    ),
    "unit-of-the-title": Case(
        text="Units: kts\ntime,wind speed,wind dir\n" + rows("2026-05-01T12:{m:02d}:00Z,{v},{d}"),
        takes=["unit"], speeds={"": (3 * KN, 4.9 * KN)},
    ),
    "day": Case(
        text="time,wind speed (m/s),wind dir\n" + rows("12:{m:02d}:00,{v},{d}"),
        takes=["date", "zone"], answers={"DATE": "2026-05-01"}, speeds=ONE, first="2026-05-01T10:00",
    ),
    "start": Case(
        text="elapsed (s),wind speed (m/s),wind dir\n" + rows("{m}.0,{v},{d}"),
        takes=["start"], speeds=ONE, first="2026-05-01T10:00",  # the example that is offered, 12:00 at +02:00
    ),
    "date-order": Case(
        text="time,wind speed (m/s),wind dir\n" + rows("01/05/2026 14:{m:02d}:00,{v},{d}"),
        takes=["date-order", "zone"], speeds=ONE,
    ),
    "speed-in-doubt": Case(
        text="time,U (m/s),d\n" + rows("2026-05-01T12:{m:02d}:00Z,{v},{d}"), takes=["wind"], speeds=ONE, direction=None
    ),
    "speed-with-an-apostrophe": Case(
        text="time,U' (m/s),d\n" + rows("2026-05-01T12:{m:02d}:00Z,{v},{d}"),
        takes=["wind"], speeds=ONE, direction=None,
    ),
    "no-names": Case(
        text=rows("2026-05-01T12:{m:02d}:00Z,{v},{d}"),
        takes=["columns"], answers={"2": "wind_speed[kn]", "3": "wind_direction[deg]"},
        speeds={"": (3 * KN, 4.9 * KN)},
    ),
    "names-that-say-nothing": Case(
        text="a\tb\tc\n" + rows("2026-05-01T12:{m:02d}:00Z;{v};{d}").replace(".", ",").replace(";", "\t"),
        takes=["columns"], answers={"2": "wind_speed[m/s]", "3": "wind_direction[deg]"}, speeds=ONE,
    ),
    "devices-below-each-other": Case(
        text="pod,time,wind speed (km/h),wind dir\n"
        + rows("A,2026-05-01T12:{m:02d}:00Z,{v},{d}") + rows("B,2026-05-01T12:{m:02d}:30Z,1{v},{d}"),
        takes=["columns"], speeds={"A": (3 * KMH, 4.9 * KMH), "B": (13 * KMH, 14.9 * KMH)},
    ),
    "numbered-devices-of-one-stamp": Case(
        text="pod,time,wind speed (km/h),wind dir\n"
        + re.sub(r"(?m)^(.*)\n", r"1,\1\n2,\1\n", rows("2026-05-01T12:{m:02d}:00Z,{v},{d}")),
        takes=["columns"], finding="devices-mixed", speeds={"1": (3 * KMH, 4.9 * KMH), "2": (3 * KMH, 4.9 * KMH)},
    ),
    "gon": Case(
        text="time,wind speed (m/s),wind dir\n" + rows("2026-05-01T12:{m:02d}:00Z,{v},{d}").replace(",21", ",38"),
        takes=["columns"], finding="columns-not-read", speeds=ONE, direction=180.0,
    ),
    "direction-called-otherwise": Case(
        text="time,wind speed (m/s),bearing\n" + rows("2026-05-01T12:{m:02d}:00Z,{v},{d}"),
        takes=["columns"], finding="columns-not-read", speeds=ONE,
    ),
    "direction-beside-sites": Case(
        text="station,time,wind speed (m/s),bearing\n"
        + rows("A,2026-05-01T12:{m:02d}:00Z,{v},{d}") + rows("B,2026-05-01T12:{m:02d}:00Z,1{v},{d}"),
        takes=["columns"], finding="columns-not-read", speeds={"A": (3.0, 4.9), "B": (13.0, 14.9)},
    ),
    "direction-beside-numbered-devices": Case(
        text="pod,time,wind speed (m/s),bearing\n"
        + re.sub(r"(?m)^(.*)\n", r"1,\1\n2,\1\n", rows("2026-05-01T12:{m:02d}:00Z,{v},{d}")),
        takes=["columns"], finding="columns-not-read", speeds={"1": (3.0, 4.9), "2": (3.0, 4.9)},
    ),
    "points-whose-o-is-east-or-west": Case(
        text="time,wind speed (m/s),wind dir\n"
        + "".join(f"2026-05-01T12:{at:02d}:00Z,{3 + at / 10:.1f},{'ONSO'[at % 4]}\n" for at in range(20)),
        takes=["columns"], finding="columns-not-read", speeds=ONE, direction=90.0,
    ),
    "blown-to": Case(
        text="time,wind speed (m/s),wind heading\n" + rows("2026-05-01T12:{m:02d}:00Z,{v},{d}"),
        takes=["columns"], finding="columns-not-read", speeds=ONE, direction=20.0,
    ),
    "tens-of-degrees-stated-as-degrees": Case(
        text="time,wind speed (m/s),wind dir (deg)\n"
        + "".join(f"2026-05-01T12:{at:02d}:00Z,{3 + at / 10:.1f},{20 + at % 9}\n" for at in range(20)),
        takes=["columns"], finding="columns-not-read", speeds=ONE,
    ),
    "counts": Case(
        text="time,pulses\n" + rows("2026-05-01T12:{m:02d}:00Z,{n}"),
        takes=["columns"], answers={"2": "wind_speed[0.75 m/s]"}, speeds={"": (0.75, 15.0)}, direction=None,
    ),
    "dates-without-a-time-of-day": Case(
        text="date,wind speed (m/s),wind dir\n" + rows("2026-05-01,{v},{d}"),
        takes=["columns", "start", "rate"], answers={"TIME": "2026-05-01T14:00:00+02:00", "HZ": "0.1"}, speeds=ONE,
    ),
    "rows-out-of-order-that-come-unevenly": Case(
        text="time,wind speed (m/s),wind dir\n"
        + "".join(
            f"2026-05-01T12:{UNEVEN[at]:02d}:00Z,{3 + at / 10:.1f},{200 + at}\n"
            for at in (*range(6), 8, 9, 6, 7, *range(10, 20))
        ),
        takes=["clock"], finding="time-backwards", speeds=ONE,
    ),
    "another-unit-by-the-values": Case(
        text="time,wind speed (m/s)\n"
        + "".join(f"2026-05-01T12:{at:02d}:00Z,{20.5 + 7 * at}\n" for at in range(20)),
        takes=["unit"], finding="unit-doubtful", speeds={"": (20.5 * KMH, 153.5 * KMH)}, direction=None,
    ),
}  # fmt: skip


@pytest.fixture
def run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs `flagdata ingest` into a lake of its own: exit code, stdout, stderr."""
    runs = iter(range(100))

    def run(*arguments: str) -> tuple[int, str, str]:
        lake = Lake.create(tmp_path / f"lake{next(runs)}")
        with pytest.raises(SystemExit) as exit_:
            main(["ingest", *arguments, "--json", "--lake", str(lake.path)])
        printed = capsys.readouterr()
        return int(exit_.value.code or 0), printed.out, printed.err

    return run


def step(sentence: str, case: Case) -> dict[str, str]:
    """The options that a sentence offers and the user takes, each with its first value, filled in."""
    found: dict[str, str] = {}
    for name, value in re.findall(r"--([a-z-]+) (\"[^\"]*\"|'(?:[^']|'\"'\"')*'|[^\s;,)]+)", sentence):
        if name in case.takes and name not in found:
            (text,) = shlex.split(value)
            found[name] = filled(text, case.answers) if name == "columns" else case.answers.get(text, text)
    return found


def filled(line: str, answers: Mapping[str, str]) -> str:
    """A line of columns with an answer in place of each entry that has a "?"."""
    entries = re.split(r",(?![^\[]*\])", line)
    named = "=" in re.sub(r"\[[^\]]*\]", "", line)
    numbers = [entry.partition("=")[0] if named else str(at) for at, entry in enumerate(entries, start=1)]
    pairs = zip(numbers, entries, strict=True)
    done = [(number, answers[number] if "?" in entry else entry.partition("=")[2] or entry) for number, entry in pairs]
    return ",".join(f"{number}={entry}" if named else entry for number, entry in done)


def offered(out: str, err: str, code: int, case: Case) -> str:
    """The sentence that offers a step: of the refusal, or of the case's finding."""
    if code:
        return json.loads(out or err)["fix"]
    found = [one for result in json.loads(out)["results"] for one in result["report"]["findings"]]
    return " ".join(f"{one['what']} {one['fix']}" for one in found if one["kind"] == case.finding)


@pytest.mark.parametrize("name", CASES)
def test_steps_that_are_offered_work_as_they_are_printed(run: Run, tmp_path: Path, name: str) -> None:
    case, path = CASES[name], tmp_path / "wind.csv"
    path.write_text(case.text)
    given: dict[str, str] = {}
    arguments = [str(path)]
    code, out, err = run(*arguments)
    assert bool(code) != bool(case.finding), out
    for _ in range(MOST):
        if code == 0 and (given or not case.finding):
            break
        sentence = offered(out, err, code, case)
        more = step(sentence, case)
        assert more.items() - given.items(), f"no step is offered: {sentence}"
        given |= more
        arguments = [str(path), *(text for option, value in given.items() for text in (f"--{option}", value))]
        code, out, err = run(*arguments)
    assert code == 0, out + err
    assert len(json.loads(out)["results"]) == len(case.speeds)
    check(path, arguments, case)


def check(path: Path, arguments: Sequence[str], case: Case) -> None:
    """The values that are read with the options that were taken."""
    given = ingest.make_context("ingest", list(arguments)).params
    options = wind_options(
        format_name=None, sensor=None, zone_name=given["zone"],
        **{name: given[name] for name in (
            "date", "date_order", "platform", "talker", "azimuth", "clock", "zero_offset", "encoding", "unit", "start",
            "wind", "columns",
        )}, rate=given["rate"] if "rate" in case.takes else None,
    ).wind  # fmt: skip
    labels = anemometers(path, options) or ("",)
    assert sorted(labels) == sorted(case.speeds)
    for label in labels:
        series = read_log(path, replace(options, wind=label) if label else options).series
        assert len(series) == case.rows
        assert str(np.datetime64(int(series.time[0]), "ns"))[:16] == case.first
        assert series.channels["wind_speed"][[0, -1]].tolist() == pytest.approx(list(case.speeds[label]))
        if case.direction is not None:
            assert np.degrees(series.channels["wind_direction"][0]) == pytest.approx(case.direction)
