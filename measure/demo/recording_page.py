"""The page of the film and the log on one clock: wind, alignment, clips with their ground truth,
findings and the commands, in one file."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from markupsafe import Markup

import flagdata
from flagdata.align.session_chart import HEIGHTS, session_panels
from flagdata.answer import Quantity
from flagdata.answer.answer import Answer, Figure, Gallery, Head, Section, Table, Tone
from flagdata.answer.charts import Axis, Band, Chart, Colour, Line, Panel
from flagdata.core.clock_model import NINETY, ClockModel
from flagdata.core.schema import CLIP_FRAMES, FRAME_RATE
from flagdata.dataset.pairs import Pairs
from flagdata.dataset.sample import Sample
from flagdata.lake import Lake
from flagdata.pages.page_pictures import data_url, moving
from flagdata.record import Record
from flagdata.record.signals import WindAverage
from flagdata.timebase import NANOSECONDS, iso
from measure.demo.demo_recording import AIR_RATE, BEFORE, SIZE, Recording
from models.maps.spectral_layer import SpectralDecomposition

_SHOWN = 6
_HEAD = 5.6  # inch, of a chart beside another
_SIDE = 240  # px of a clip
_ABOUT_MOTION = (
    "Dominant motion: the peak frequency of the spectral decomposition layer (Runia et al. 2020, "
    "section 5), weighted by its power over the picture; its resolution at 30 frames is 0.83 Hz."
)


@dataclass(frozen=True, kw_only=True)
class Recovered:
    """The clock offset found against the hidden one; seconds."""

    offset: Quantity
    confidence: float
    truth: float

    @property
    def error(self) -> float:
        return abs(self.offset.point - self.truth)

    @property
    def covered(self) -> bool:
        return self.offset.low <= self.truth <= self.offset.high

    @property
    def text(self) -> str:
        """The offset with its interval, without its level."""
        return f"{self.offset.point:+.2f} s [{self.offset.low:+.2f}, {self.offset.high:+.2f}]"


def recording_answer(
    folder: Path, *, recording: Recording, at: str, transcript: Sequence[tuple[str, str]]
) -> Answer:
    """Returns on which clock film and log are, from the lake in the folder, with the pairs that
    were made of them."""
    lake = Lake.open(folder / "lake")
    (row,) = lake.rows("kind = 'recording'", at=at).to_pylist()
    record = Record.open(lake.object_path(row["object"]))
    logged = record.wind_1hz()
    if logged is None:
        raise ValueError("a recording of the demonstration holds wind")
    pairs = flagdata.open(folder / "lake").pairs(where="kind = 'clip'", at=at, seed=0)
    clock = compare_clock(row, recording.clock_offset)
    first = int(record.frame_times[0])
    minutes = len(record.frame_times) / FRAME_RATE / 60
    return Answer(
        question="demo",
        subject="A film and a log on one clock",
        sentence=_sentence(clock),
        tone=Tone.SETTLED if clock.covered else Tone.MISSED,
        head=Head(
            figures=[_session(record, logged), _wind_figure(logged, lake, at, recording, first)],
            facts={
                "film": f"{minutes:.2g} min from {iso(first)[:16]}Z, a "
                f"simulated flag of {SIZE.replace('x', ' m × ')} m",
                "clock": f"{clock.text}, {clock.offset.span.percent}, truly {clock.truth:+.2f} s; "
                f"confidence {clock.confidence:.3f}",
                "log": f"a cup anemometer, {len(logged.time)} one-second means",
            },
            limits=["The gap in the log and the stretch in which it stuck are left out of means."],
        ),
        make_sections=lambda: [*_sections(folder, lake, at, pairs, transcript)],
    )


def _sentence(clock: Recovered) -> str:
    """Says how the clocks differ, and whether that holds the truth."""
    side = "ahead of" if clock.offset.point > 0 else "behind"
    holds = "holds" if clock.covered else "does not hold"
    return (
        f"The log's clock is {abs(clock.offset.point):.1f} s {side} the camera's; the 90 % "
        f"interval {holds} the truth, "
        "which is in neither file."
    )


def _sections(
    folder: Path, lake: Lake, at: str, pairs: Pairs, transcript: Sequence[tuple[str, str]]
) -> Iterator[Section]:
    order = np.argsort([pairs[i].wind for i in range(len(pairs))])
    places = order[np.linspace(0, len(order) - 1, _SHOWN).round().astype(int)]
    refused = (
        f"; {len(pairs.refused)} refused, the first because {'; '.join(pairs.refused[0].reasons)}"
        if pairs.refused
        else ""
    )
    counted = (
        f"{len(pairs)} pairs of {CLIP_FRAMES} frames at {FRAME_RATE:g} Hz{refused}. {len(places)} "
        "of "
        "them, by wind:"
    )
    yield Section(
        title="Clips and their ground truth",
        parts=[
            counted,
            Gallery(figures=[_clip(pairs[int(i)]) for i in places]),
            _ABOUT_MOTION,
        ],
        anchor="clips",
    )
    picture = data_url((folder / "alignment.png").read_bytes(), "image/png")
    yield Section(
        title="How the clocks were compared",
        parts=[Figure(title="Motion and wind, and the correlation against lag", content=picture)],
        anchor="alignment",
        folded=True,
    )
    yield Section(
        title="What the ingest found",
        parts=[Table(columns=("source", "", "finding"), rows=_findings(lake, at))],
        anchor="ingest",
        folded=True,
    )
    typed = [
        Markup("<pre><b>$ {}</b>\n{}</pre>").format(command, printed)
        for command, printed in transcript
    ]
    yield Section(title="What was typed", parts=typed, anchor="commands", folded=True)


def compare_clock(recording: dict[str, Any], truth: float) -> Recovered:
    """Compares the recording's clock at mid-recording with the true offset [s] that the generator
    kept."""
    clock = ClockModel.from_json(recording["clock_model"])
    middle = (recording["start"] + recording["end"]) // 2
    device = middle - round(recording["clock_offset"] * NANOSECONDS)
    offset = (int(clock.to_common(device)) - device) / NANOSECONDS
    half = NINETY * float(clock.sigma(device))
    return Recovered(
        offset=Quantity.of(offset, offset - half, offset + half, unit="s", name="clock_offset"),
        confidence=clock.confidence,
        truth=truth,
    )


def _clip(sample: Sample) -> Figure:
    return Figure(
        title="clip",
        content=moving(sample.clip[0].numpy(), rate=FRAME_RATE, side=200),
        caption=f"{sample.wind:.2f} ± {sample.wind_sigma:.2f} m/s (minute mean, 1 σ); clock σ "
        f"{sample.clock_sigma:.2f} s, coverage {100 * sample.coverage:.0f} %; dominant motion "
        f"{dominant_frequency(sample.clip):.1f} Hz",
        width=_SIDE,
    )


def dominant_frequency(clip: torch.Tensor) -> float:
    """Computes the peak frequency [Hz] of a (1, time, height, width) clip, weighted by power over a
    four times coarser picture."""
    coarse = torch.nn.functional.avg_pool2d(clip.float(), 4)
    power, frequency = SpectralDecomposition(rate=FRAME_RATE)(coarse[None])[0]
    return float((power * frequency).sum() / power.sum())


def _session(record: Record, logged: WindAverage) -> Figure:
    when, blowing = session_panels(record.frame_times, logged, clock="the common clock")
    return Figure(
        title="When camera and anemometer ran",
        content=Chart(rows=[[when], [blowing]], heights=HEIGHTS, width=_HEAD),
    )


def _wind_figure(
    logged: WindAverage, lake: Lake, at: str, recording: Recording, zero: int
) -> Figure:
    """Shows the winds from the first frame on, `zero` [UTC ns]."""
    clips = lake.rows("kind = 'clip'", at=at, columns=["end", "wind", "wind_sigma"]).to_pylist()
    ends = np.array([(clip["end"] - zero) / NANOSECONDS for clip in clips])
    wind = np.array([np.nan if clip["wind"] is None else clip["wind"] for clip in clips])
    sigma = np.array([np.nan if clip["wind"] is None else clip["wind_sigma"] for clip in clips])
    truth = np.arange(len(recording.wind)) / AIR_RATE - BEFORE
    panel = Panel(
        marks=[
            Line(
                x=truth,
                y=recording.wind,
                colour=Colour.RULE,
                width=0.6,
                label="true wind at the flag",
            ),
            Line(
                x=(logged.time - zero) / NANOSECONDS,
                y=logged.speed,
                colour=Colour.LOG,
                width=0.8,
                label="anemometer, 1 Hz",
            ),
            Band(x=ends, low=wind - sigma, high=wind + sigma, colour=Colour.FILM, opacity=0.35),
            Line(
                x=ends,
                y=wind,
                colour=Colour.FILM,
                width=1.4,
                label="ground truth of the clips (minute mean ± σ)",
            ),
        ],
        x=Axis(label="time since the first frame [s]", limits=(truth[0], truth[-1])),
        y=Axis(label="wind speed [m/s]", limits=(0, None)),
    )
    return Figure(
        title="Wind speed against time",
        content=Chart(rows=[[panel]], height=2.9, width=_HEAD),
        caption=f"{len(clips)} clips of {CLIP_FRAMES} frames.",
    )


def _findings(lake: Lake, at: str) -> list[tuple[str, str, str]]:
    found = []
    for row in lake.rows(
        "kind in ('camera', 'wind')", at=at, columns=["source_name", "report"]
    ).to_pylist():
        report = json.loads(row["report"])
        found += [(row["source_name"], one["severity"], one["what"]) for one in report["findings"]]
    return found
