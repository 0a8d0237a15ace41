"""Ten made wind logs as a new user ingests them: writes docs/results/wind-log-transcripts.md.

python -m tests.studies log-transcripts
"""

from __future__ import annotations

import contextlib
import datetime as dt
import io
import math
import os
import shlex
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import click
import openpyxl

from flagdata.cli import main as run_flagdata
from flagdata.commands import confirm_recipe
from flagdata.core.console import say
from flagdata.lake import Lake

PAGE = Path(__file__).resolve().parents[3] / "docs" / "results" / "wind-log-transcripts.md"
INTRODUCTION = (
    "# Transcripts of ten wind logs\n\n"
    "Ten made files as a new user ingests them, first without a terminal (a script), then at one; "
    "`>` is followed by "
    "what was typed.\nShown are the first lines of each file, then everything the program printed, "
    "but for reasons "
    "that repeat the preview. The lake was\nempty each time. [Describing a sensor](../sensors.md) "
    "explains the parts.\n"
    "`python -m tests.studies log-transcripts` makes this page.\n"
)
START = dt.datetime(2026, 5, 14, 11, 30)  # noqa: DTZ001  a logger's wall clock


def speed(at: float, mean: float = 5.0, phase: float = 0.0) -> float:
    """A gusty wind [m/s]."""
    return mean * (
        1
        + 0.25 * math.sin(at / 9 + phase)
        + 0.1 * math.sin(at / 2.3 + 2 * phase)
        + 0.02 * math.sin(7 * at)
    )


def away(at: float) -> int:
    """Where it comes from [deg]."""
    return round(225 + 8 * math.sin(at / 9))


def rows(form: str, count: int = 60, every: float = 1.0, start: dt.datetime = START) -> str:
    """Rows of `form` with a stamp `t`, a count `n`, a speed `v` and functions of them."""
    made: list[str] = []
    for n in range(count):
        at = n * every
        t, v, d = start + dt.timedelta(seconds=at), speed(at), away(at)
        values = {
            "low": 0.75 * speed(at, phase=0.1),
            "kn": v / 0.514444,
            "kmh": 3.6 * v,
            "ms": 1000 * n + 7,
        }
        axes = {
            "u": v * math.cos(at / 300),
            "side": v * math.sin(at / 300),
            "w": 0.05 * math.cos(at),
        }
        made.append(form.format(t=t, n=n, v=v, d=d, **values, **axes))
    return "".join(f"{row}\n" for row in made)


@dataclass(frozen=True, kw_only=True)
class Trial:
    """A made file, what the page says of it, and how it is ingested.

    Attributes:
        shown: lines of it on the page.
        runs: options, and the lines that are typed; `None` for a script.
    """

    title: str
    about: str
    name: str
    text: str
    shown: int
    runs: Sequence[tuple[str, Sequence[str] | None]]


ISO = "{t:%Y-%m-%dT%H:%M:%S}Z"
PLAIN = "{t:%Y-%m-%d %H:%M:%S}"
TRIALS = (
    Trial(
        title="A Kestrel export",
        about="The format is recognised; it states everything but the zone.",
        name="kestrel.csv",
        shown=6,
        runs=[("", None), ("", ["+02:00"])],
        text="Device Name,KESTREL - 2412345\nDevice Model,5500\nSerial Number,2412345\n"
        "FORMATTED DATE_TIME,Temperature,Relative Humidity,Wind Speed,Direction - True\n"
        "YYYY-MM-DD HH:MM:SS,°C,%,m/s,Deg\n" + rows(PLAIN + ",21.3,48.2,{v:.1f},{d}", every=2.0),
    ),
    Trial(
        title="A Campbell table (TOA5)",
        about="Recognised by its first line. The sonic's components need the sensor's azimuth for "
        "a direction.",
        name="campbell.dat",
        shown=5,
        runs=[("", None), ("", ["+02:00"])],
        text='"TOA5","mast","CR1000X","12345","CR1000X.Std.05.01","CPU:mast.CR1X","51234","wind"\n'
        '"TIMESTAMP","RECORD","Ux","Uy","Uz","Ts"\n"TS","RN","m/s","m/s","m/s","C"\n"","","Smp","Smp","Smp","Smp"\n'
        + rows('"{t:%Y-%m-%d %H:%M:%S}.{t:%f}",{n},{v:.3f},{side:.3f},{w:.3f},21.0', 300, 0.1),
    ),
    Trial(
        title="What an Arduino printed",
        about="Two numbers a line, without a heading: the columns have to be given, then the start "
        "of its count of "
        "milliseconds.",
        name="arduino.txt",
        shown=3,
        text=rows("{ms} {v:.2f}"),
        runs=[
            ("", None),
            ('--columns "time[ms],wind_speed[m/s]"', ["2026-05-14T11:30:00+02:00", "yes"]),
        ],
    ),
    Trial(
        title="A spreadsheet",
        about="The unit is in the heading, the zone is asked for, and the rest is confirmed.",
        name="sheet.xlsx",
        shown=3,
        runs=[("", None), ("", ["Europe/Amsterdam", "yes"])],
        text="Date,Wind (km/h),Direction,Battery (V)\n" + rows(PLAIN + ",{kmh:.1f},{d},12.6"),
    ),
    Trial(
        title="A log without a zone",
        about="Everything else is stated, so the answer completes it and there is nothing to "
        "confirm.",
        name="zoneless.csv",
        shown=3,
        runs=[("", None), ("", ["+02:00"])],
        text="timestamp,wind_speed (m/s),wind_direction (deg)\n" + rows(PLAIN + ",{v:.2f},{d}"),
    ),
    Trial(
        title="Speeds in km/h, which the file does not state",
        about="The unit is asked for. The direction's unit is assumed, so one row is confirmed.",
        name="unstated.csv",
        shown=3,
        runs=[("", None), ("", ["km/h", "yes"])],
        text="Time,Wind speed,Wind direction\n" + rows(ISO + ",{kmh:.1f},{d}"),
    ),
    Trial(
        title="Components",
        about="Headings of one letter are inferred. `--azimuth` gives the axes, and the preview "
        "then has a direction "
        "to check.",
        name="components.csv",
        shown=3,
        runs=[("", None), ("--azimuth 270", ["yes"])],
        text="time,u (m/s),v (m/s),w (m/s)\n" + rows(ISO + ",{u:.2f},{side:.2f},{w:.2f}"),
    ),
    Trial(
        title="Two heights",
        about="Each height becomes an artifact. The direction is read with the speed of its own "
        "height only.",
        name="heights.csv",
        shown=3,
        runs=[("", None), ("", ["yes", "yes"])],
        text="time,wind speed 2m (m/s),wind speed 10m (m/s),wind dir 10m (deg)\n"
        + rows(ISO + ",{low:.2f},{v:.2f},{d}"),
    ),
    Trial(
        title="A boat's log",
        about="Apparent wind is not taken for the wind: the column and the platform are asked for.",
        name="boat.csv",
        shown=3,
        runs=[("", None), ("", ["AWS (kn)", "moving"])],
        text="time,AWS (kn),AWA (deg),SOG (kn),Heading (deg)\n"
        + rows(ISO + ",{kn:.1f},{d},5.1,187"),
    ),
    Trial(
        title="A clock that was set back",
        about="All is stated, but the time goes back by 2 min. `--clock last` says that the clock "
        "was right after it "
        "was set.",
        name="setback.csv",
        shown=3,
        runs=[("", None), ("--clock last", ["yes"])],
        text="time,wind_speed (m/s)\n"
        + rows(ISO + ",{v:.2f}", 300)
        + rows(ISO + ",{v:.2f}", 300, start=START + dt.timedelta(seconds=180)),
    ),
)


def written(trial: Trial) -> None:
    """The file in the current folder; a workbook where its name says so."""
    if not trial.name.endswith(".xlsx"):
        Path(trial.name).write_text(trial.text, encoding="utf-8")
        return
    book = openpyxl.Workbook()
    heading, *lines = (line.split(",") for line in trial.text.splitlines())
    sheet: Any = book.active
    sheet.append(heading)
    for stamp, *numbers in lines:
        sheet.append([dt.datetime.fromisoformat(stamp), *map(float, numbers)])
    book.save(trial.name)


def transcript(trial: Trial, options: str, typed: Sequence[str] | None) -> str:
    """What the program prints, with the answers that are typed behind its questions."""
    out, answers = io.StringIO(), iter(typed or ())

    def prompt(text: str, **_: object) -> str:
        answer = next(answers)
        say(f"{text}> {answer}")
        return answer

    Lake.create(Path("lake"))
    arguments = ["ingest", trial.name, *shlex.split(options), "--lake", "lake"]
    with (
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(out),
        patch.object(click, "prompt", prompt),
        patch.object(confirm_recipe, "at_terminal", lambda: typed is not None),
    ):
        try:
            run_flagdata(arguments)
        except SystemExit as ended:
            code = ended.code
    lines = out.getvalue().splitlines()
    if any("This is how it is read" in line for line in lines):
        lines = [line for line in lines if not line.startswith("  why ")]
    end = " < /dev/null" if typed is None else ""
    command = f"$ flagdata ingest {trial.name}{f' {options}' if options else ''}{end}"
    return "\n".join([command, *lines, f"(exit code {code or 0})"])


def page() -> Iterator[str]:
    """The page's parts."""
    yield INTRODUCTION
    for trial in TRIALS:
        head = "\n".join(trial.text.splitlines()[: trial.shown])
        yield f"\n## {trial.title}\n\n{trial.about}\n\n```text\n{head}\n```\n"
        parts: list[str] = []
        for options, typed in trial.runs:
            with tempfile.TemporaryDirectory() as folder, _inside(folder):
                written(trial)
                parts.append(transcript(trial, options, typed))
        yield "\n```text\n{}\n```\n".format("\n\n".join(parts))


@contextlib.contextmanager
def _inside(folder: str) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def main(write: Callable[[str], object] = PAGE.write_text) -> int:
    """Write the page."""
    write("".join(page()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
