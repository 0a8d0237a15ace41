"""The steps of the demonstration: each types its commands and leaves a card."""

from __future__ import annotations

import json
import math
import re
import time
from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from typing import Any

import av
import numpy as np

from flagdata.answer.answer import Figure
from flagdata.answer.charts import Axis, Chart, Colour, Dots, Line, Panel
from flagdata.core.console import progress, say
from flagdata.core.workload import cores
from flagdata.lake import Lake
from flagdata.pages.page_pictures import data_url, moving
from measure.commands.measurement_artifact import read
from measure.demo.demo_cards import Card, Judgement, Truth
from measure.demo.demo_recording import (
    AIR_RATE,
    BEFORE,
    CLOCK_SIGMA,
    SCALE_SIGMA,
    SIZE,
    Acting,
    Recording,
    RecordingRecipe,
    make_recording,
)
from measure.demo.recording_page import compare_clock, recording_answer
from measure.demo.transcript import Transcript
from measure.verdict.verdict_record import Conclusion

SIMULATIONS = 64
"""Flags that are simulated to weigh the cloth: the fewest that the command takes."""
WEIGHED = 40.0
"""s of the film that the cloth is weighed on, and the loop closed."""
KINDS = 20
"""Kinds of numerics among the null experiments: the fewest that a level of 0.05 can be tested by,
and one more."""
_REFUSED = (
    "The estimate from motion and gusts was refused, for the reason above the picture.\n"
    "So the difference was given that somebody read off the two displays:\n"
)
_PAGE = "recording.html"
_SIDE = 320  # px of the film
_SHOWN = 50  # frames of the film's moving picture
_CLIPS = 2.4  # s from one window of the wind series to the next


def field_steps(shell: Transcript, seed: int) -> Recording:
    """Goes from nothing to a film and a log on one clock, pairs of them, and the wind estimated
    from the film."""
    recording = _film(shell, RecordingRecipe(seed=seed))
    done = "Each file was identified, with the reason; for the log a sensor recipe was drafted."
    with _Step(shell, "What are these files?", done) as step:
        step.found = _head(shell.show("ingest", "--sniff", "flag.mp4", "anemometer.csv"), 6)
    done = (
        "Film and log became artifacts, each on its own clock. Units and zones are settled here; "
        "doubts are listed."
    )
    with _Step(shell, "Into the lake", done) as step:
        for arguments in (
            ("flag.mp4", "--session", "demo"),
            (
                "anemometer.csv",
                "--sensor",
                "cup-logger.toml",
                "--zone",
                "+02:00",
                "--session",
                "demo",
            ),
        ):
            step.found += _head(shell.show("ingest", *arguments, "--lake", "lake"), 6)
    _align_step(shell, recording)
    answer = recording_answer(
        shell.folder, recording=recording, at="demo", transcript=tuple(shell.entries)
    )
    (shell.folder / _PAGE).write_text(answer.page, encoding="utf-8")
    shell.cards[-1] = replace(shell.cards[-1], page=_PAGE)
    _measure_step(shell, recording)
    return recording


def weighing_step(shell: Transcript, recording: Recording) -> None:
    """Weighs the cloth with the log beside the film."""
    noted = recording.noted
    done = (
        f"The flag's motion in {WEIGHED:g} s of the film was compared with that of {SIMULATIONS} "
        "simulated flags in "
        "the logged wind, which are few and a short time: more of both narrow the interval. What "
        "acts on "
        "the flag and is not in the model changes the weight. By compass and tape the camera stood "
        f"{math.degrees(noted.azimuth):.0f}° from the wind's direction and {noted.distance:.1f} m "
        "away."
    )
    with _Step(shell, "What the cloth weighs", done, page="weighed.html") as step:
        step.took(
            shell.attempt(
                "calibrate", "flag", *_film_options(recording), "--report", "weighed.html"
            )
        )
        step.beside(
            "area weight, by the model without what acts",
            f"{recording.area_weight:.3f} kg/m²",
            _judgement(step.found, recording.area_weight),
        )


def loop_step(shell: Transcript, recording: Recording) -> None:
    """Tests what the model of the filmed flag lacks."""
    scale_weight = f"{recording.noted.area_weight:.3f}±{SCALE_SIGMA:g}"
    done = (
        f"The same {WEIGHED:g} s were compared with flags on which each of the library's effects "
        "acts, and with flags "
        f"of {KINDS} other meshes and time steps on which nothing undeclared does. The weight that "
        "the motion asked "
        f"for was set aside: on a scale the cloth weighed {scale_weight} kg/m² before it was sewn."
    )
    with _Step(shell, "What the model of the flag lacks", done, page="loop/report.html") as step:
        printed = shell.attempt(
            "close-loop",
            "flag",
            *_film_options(recording),
            "--area-weight",
            scale_weight,
            "--nulls",
            str(KINDS),
            "--out",
            "loop",
        )
        step.took(None if printed is None else _verdict(printed))
        if recording.acting is not None:
            document = (
                None
                if printed is None
                else (shell.folder / "loop" / "verdict.json").read_text(encoding="utf-8")
            )
            _beside_what_acts(
                step, recording.acting, None if document is None else json.loads(document)
            )


def _beside_what_acts(step: _Step, acting: Acting, verdict: dict[str, Any] | None) -> None:
    """Compares what acts on the flag with what a verdict names; None where it was refused."""
    subject = "what acts on the flag beside the model"
    if verdict is None:
        step.beside(subject, acting.sentence, Judgement.REFUSED)
    elif verdict["conclusion"] == Conclusion.UNDECIDED:
        step.beside(subject, acting.sentence, Judgement.UNDECIDED)
    elif acting.effect not in (named := verdict["named"]):
        step.beside(subject, acting.sentence, Judgement.MISSED)
    else:
        rank = named.index(acting.effect) + 1
        several = f"one of {len(named)} effects; it is number {rank} of them by probability"
        step.beside(
            subject, acting.sentence, Judgement.RIGHT, inferred=several if len(named) > 1 else ""
        )


def _film_options(recording: Recording) -> tuple[str, ...]:
    """Returns options of the film that weighing and the loop have in common, so that they share
    simulations."""
    noted = recording.noted
    return (
        "--flag-size",
        SIZE,
        "--azimuth",
        f"{math.degrees(noted.azimuth):.0f}±3",
        "--elevation",
        f"{math.degrees(noted.elevation):.0f}±2",
        "--distance",
        f"{noted.distance:.1f}",
        "--end",
        f"{WEIGHED:g}s",
        "--simulations",
        str(SIMULATIONS),
        "--workers",
        str(cores()),
        "--cache",
        "simulations",
        "--lake",
        "lake",
    )


def markers_step(shell: Transcript, seed: int) -> None:
    """Tests what the model of a tracked flag lacks."""
    from measure.demo.tracked import TrackedRecipe, make_tracks

    recipe = TrackedRecipe(seed=seed)
    winds = ", ".join(f"{speed:g}" for speed in recipe.speeds)
    done = (
        f"Markers of another flag were tracked in winds of {winds} m/s; something acts on it that "
        "no file states. The "
        "model of its cloth was tested against simulations in which nothing undeclared acts."
    )
    with _Step(shell, "What the model of a cloth lacks", done, page="loop/report.html") as step:
        frames = round((recipe.settle + recipe.duration) * recipe.rate)
        with progress(frames, label="tracking", unit="frame") as advance:
            tracks = make_tracks(recipe, shell.folder, advance=advance)
        step.found = shell.show("close-loop", tracks.recipe.name, "--lake", "lake", "--out", "loop")
        models = [
            row["name"]
            for row in shell.read("ls", "--kind", "model", "--lake", "lake")["artifacts"]
        ]
        with_effects = [name for name in models if not name.endswith("-base")]
        shell.show("simulate", (with_effects or models)[0], "--lake", "lake")
        unit = "" if tracks.unit == "1" else f" {tracks.unit}"
        true = f"{tracks.effect}, {tracks.parameter} {tracks.strength:g}{unit}"
        step.beside("what acted on the tracked flag", true, Judgement.OPEN)


class _Step:
    """A step as it runs; its card is there when it ends.

    Attributes:
        found: what the card shows as its result.
        figure: what it shows.
    """

    def __init__(self, shell: Transcript, title: str, done: str, *, page: str = "") -> None:
        self._shell, self._title, self._done, self._page = shell, title, done, page
        self._began, self._typed = time.monotonic(), len(shell.entries)
        self.found = ""
        self.figure: Figure | None = None
        self._truths: list[Truth] = []

    def took(self, printed: str | None) -> None:
        """Takes what the step's command printed; None where it refused, and left no page."""
        self.found = (
            printed
            or "Refused: the film does not pass a check of this command, which says which.\n"
        )
        self._page = "" if printed is None else self._page

    def beside(self, subject: str, true: str, judgement: Judgement, *, inferred: str = "") -> None:
        """Puts a truth beside what the step found: the first line of it, or `inferred`."""
        self._truths.append(
            Truth(
                what=subject, true=true, found=inferred or _first(self.found), judgement=judgement
            )
        )

    def __enter__(self) -> _Step:
        say("")
        say(self._title)
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if kind is None:
            typed = tuple(command for command, _ in self._shell.entries[self._typed :])
            self._shell.cards.append(
                Card(
                    title=self._title,
                    done=self._done,
                    found=self.found.strip(),
                    figure=self.figure,
                    page=self._page,
                    commands=typed,
                    seconds=time.monotonic() - self._began,
                    truths=tuple(self._truths),
                )
            )


def _film(shell: Transcript, recipe: RecordingRecipe) -> Recording:
    done = (
        f"A flag of {SIZE.replace('x', ' m × ')} m was simulated for {recipe.duration:g} s in "
        "gusts about "
        f"{recipe.wind:.1f} m/s and filmed at {recipe.rate} frames a second into an H.264 file; a "
        "cup anemometer's log "
        "is a CSV file in km/h."
    )
    with _Step(shell, "A film and a log", done) as step:
        with progress(
            2 * round(recipe.duration * recipe.rate), label="film", unit="frame"
        ) as advance:
            recording = make_recording(recipe, shell.folder, workers=cores(), advance=advance)
        step.figure = Figure(
            title="The film", content=_moving(recording.video, recipe.rate), width=_SIDE
        )
    return recording


def _align_step(shell: Transcript, recording: Recording) -> None:
    done = (
        "The flag moves more in a stronger wind, a moment later. So the gusts in the log and the "
        "motion in the film "
        "give the offset of the two clocks, if they agree clearly enough; with it, each clip of "
        "the film has its wind."
    )
    with _Step(shell, "On one clock, in pairs", done) as step:
        artifacts = {
            row["kind"]: row["artifact"] for row in shell.read("ls", "--lake", "lake")["artifacts"]
        }
        pair = ("align", artifacts["camera"][:10], artifacts["wind"][:10], "--lake", "lake")
        estimated = shell.attempt(*pair, "--search", "60", "--plot", "alignment.png")
        step.found = estimated or _REFUSED + shell.show(
            *pair,
            "--by",
            "given",
            "--clock-offset",
            f"{recording.noted.clock:.1f}",
            "--offset-sigma",
            f"{CLOCK_SIGMA:g}",
        )
        shell.show("tag", "demo", "--lake", "lake")
        shell.show("ls", "--lake", "lake")
        where = "kind = 'clip' and wind between 4 and 6"
        shell.show("query", "--where", where, "--limit", "5", "--at", "demo", "--lake", "lake")
        shell.show("verify", "--lake", "lake")
        step.figure = Figure(
            title="Motion and wind on one clock, and the evidence",
            content=data_url((shell.folder / "alignment.png").read_bytes(), "image/png"),
        )
        (row,) = Lake.open(shell.folder / "lake").rows("kind = 'recording'", at="demo").to_pylist()
        clock = compare_clock(row, recording.clock_offset)
        inferred = Judgement.RIGHT if clock.covered else Judgement.MISSED
        step.beside(
            "the log's clock minus the camera's",
            f"{clock.truth:+.2f} s",
            Judgement.GIVEN if estimated is None else inferred,
            inferred=f"{clock.text} {clock.offset.span.percent}",
        )


def _measure_step(shell: Transcript, recording: Recording) -> None:
    done = "From the film alone, a network that was trained on simulated flags estimates the wind."
    with _Step(shell, "Wind from the film", done, page="measured.html") as step:
        printed = shell.attempt(
            "measure",
            "flag",
            "--flag-size",
            SIZE,
            "--windows",
            f"{_CLIPS:g}s",
            "--report",
            "measured.html",
            "--lake",
            "lake",
        )
        step.took(None if printed is None else _first(printed))
        if printed is not None:
            step.figure = Figure(
                title="The wind read off the film, beside the true wind",
                content=_series(shell.folder / "lake", recording),
            )
        mean = float(_wind_of_film(recording).mean())
        step.beside("mean wind at the flag", f"{mean:.2f} m/s", _judgement(step.found, mean))


def _wind_of_film(recording: Recording) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Returns the true wind from the first frame to the last [m/s]."""
    first = round(BEFORE * AIR_RATE)
    return recording.wind[first : len(recording.wind) - first]


def _series(lake_path: Path, recording: Recording) -> Chart:
    lake = Lake.open(lake_path)
    (measured,) = lake.rows("kind = 'measurement'").to_pylist()
    _, columns = read(lake.object_path(measured["object"]))
    time_, value, low, high = (columns[name] for name in ("time", "wind", "low", "high"))
    wind = _wind_of_film(recording)
    panel = Panel(
        marks=[
            Line(
                x=np.arange(len(wind)) / AIR_RATE,
                y=wind,
                colour=Colour.QUIET,
                width=0.8,
                label="true wind at the flag",
            ),
            Dots(x=time_, y=value, low=low, high=high, label="read off the film, 90 %", size=3.0),
        ],
        x=Axis(label="time since the first frame [s]"),
        y=Axis(label="wind speed [m/s]", limits=(0, None)),
    )
    return Chart(rows=[[panel]], height=3.2, width=5.6)


def _moving(video: Path, rate: int) -> str:
    """Returns the first seconds of a film, in motion."""
    with av.open(str(video)) as container:
        frames = []
        for frame in container.decode(video=0):
            frames.append(frame.to_ndarray(format="rgb24"))
            if len(frames) == 2 * _SHOWN:
                break
    return moving(np.stack(frames[::2]), rate=rate / 2, side=_SIDE)


def _judgement(text: str, true: float) -> Judgement:
    """Judges the first interval or bound of a text by a true value; a text without one is a
    refusal."""
    ends = re.search(r"\[([\d.]+), ([\d.]+)\]|at least ([\d.]+)|at most ([\d.]+)", text)
    if ends is None:
        return Judgement.REFUSED
    low, high, least, most = ends.groups()
    contained = float(low or least or "-inf") <= true <= float(high or most or "inf")
    return Judgement.RIGHT if contained else Judgement.MISSED


def _verdict(text: str) -> str:
    """Returns what a verdict's words say before their list."""
    return "\n".join(takewhile(lambda line: not line.startswith(" "), text.splitlines()))


def _first(text: str) -> str:
    return text.splitlines()[0]


def _head(text: str, count: int) -> str:
    return "".join(f"{line}\n" for line in text.splitlines()[:count])
