"""The page of the film and the log on one clock: wind, alignment, clips with their ground truth,
findings and the commands, in one file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

import flagdata
from flagdata.core.clock_model import ClockModel
from flagdata.core.provenance import code_version
from flagdata.core.schema import CLIP_FRAMES, FRAME_RATE
from flagdata.dataset.sample import Sample
from flagdata.lake import Lake
from flagdata.pages.page_pictures import data_url, figure_url, moving
from flagdata.pages.render import render
from flagdata.record import Record
from flagdata.timebase import NANOSECONDS
from measure.demo.demo_recording import AIR_RATE, BEFORE, Recording
from models.maps.spectral_layer import SpectralDecomposition

_SHOWN = 6
_Z90 = 1.6449  # half-width of a 90 % interval of a Gaussian, in σ


@dataclass(frozen=True, kw_only=True)
class Recovered:
    """The clock offset found against the hidden one; seconds."""

    offset: float
    low: float
    high: float
    confidence: float
    truth: float

    @property
    def error(self) -> float:
        return abs(self.offset - self.truth)

    @property
    def covered(self) -> bool:
        return self.low <= self.truth <= self.high


def write_page(
    folder: Path,
    *,
    recording: Recording,
    at: str,
    transcript: Sequence[tuple[str, str]],
    seconds: float,
) -> Path:
    """Write `recording.html` (self-contained) into `folder` from the lake inside it; returns its
    path."""
    lake = Lake.open(folder / "lake")
    (row,) = lake.rows("kind = 'recording'", at=at).to_pylist()
    record = Record.open(lake.object_path(row["object"]))
    pairs = flagdata.open(folder / "lake").pairs(where="kind = 'clip'", at=at, seed=0)
    order = np.argsort([pairs[i].wind for i in range(len(pairs))])
    samples = [
        pairs[int(i)] for i in order[np.linspace(0, len(order) - 1, _SHOWN).round().astype(int)]
    ]
    wind_image, caption = _wind_plot(record, lake, at, recording)
    target = folder / "recording.html"
    values = {
        "minutes": f"{len(record.frame_times) / FRAME_RATE / 60:.2g}",
        "seconds": seconds,
        "clock": compare_clock(row, recording.clock_offset),
        "images": {
            "wind": wind_image,
            "alignment": data_url((folder / "alignment.png").read_bytes(), "image/png"),
        },
        "wind_caption": caption,
        "counts": {
            "pairs": len(pairs),
            "refused": len(pairs.refused),
            "reason": "; ".join(pairs.refused[0].reasons) if pairs.refused else "",
        },
        "clips": [_clip_card(sample) for sample in samples],
        "findings": _findings(lake, at),
        "transcript": transcript,
        "version": f"flagdata {code_version()}",
    }
    target.write_text(render("measure.demo", "page.html.j2", values), encoding="utf-8")
    return target


def compare_clock(recording: dict[str, Any], truth: float) -> Recovered:
    """Compares the recording's clock at mid-recording with the true offset [s] that the generator
    kept."""
    clock = ClockModel.from_json(recording["clock_model"])
    middle = (recording["start"] + recording["end"]) // 2
    device = middle - round(recording["clock_offset"] * NANOSECONDS)
    offset = (int(clock.to_common(device)) - device) / NANOSECONDS
    half = _Z90 * float(clock.sigma(device))
    return Recovered(
        offset=offset,
        low=offset - half,
        high=offset + half,
        confidence=clock.confidence,
        truth=truth,
    )


def _clip_card(sample: Sample) -> dict[str, Any]:
    return {
        "image": moving(sample.clip[0].numpy(), rate=FRAME_RATE, side=200),
        "wind": sample.wind,
        "sigma": sample.wind_sigma,
        "clock_sigma": sample.clock_sigma,
        "coverage": sample.coverage,
        "frequency": dominant_frequency(sample.clip),
    }


def dominant_frequency(clip: torch.Tensor) -> float:
    """Computes the peak frequency [Hz] of a (1, time, height, width) clip, weighted by power over a
    four times coarser picture."""
    coarse = torch.nn.functional.avg_pool2d(clip.float(), 4)
    power, frequency = SpectralDecomposition(rate=FRAME_RATE)(coarse[None])[0]
    return float((power * frequency).sum() / power.sum())


def _wind_plot(record: Record, lake: Lake, at: str, recording: Recording) -> tuple[str, str]:
    from matplotlib.figure import Figure

    logged = record.wind_1hz()
    if logged is None:
        raise ValueError("a recording of the demonstration holds wind")
    zero = int(record.frame_times[0])
    clips = lake.rows("kind = 'clip'", at=at, columns=["end", "wind", "wind_sigma"]).to_pylist()
    ends = np.array([(clip["end"] - zero) / NANOSECONDS for clip in clips])
    wind = np.array([np.nan if clip["wind"] is None else clip["wind"] for clip in clips])
    sigma = np.array([np.nan if clip["wind"] is None else clip["wind_sigma"] for clip in clips])
    figure = Figure(figsize=(9.5, 3.4), layout="constrained")
    axes = figure.subplots()
    truth = np.arange(len(recording.wind)) / AIR_RATE - BEFORE
    axes.plot(truth, recording.wind, color="0.82", linewidth=0.6, label="true wind at the flag")
    axes.plot(
        (logged.time - zero) / NANOSECONDS,
        logged.speed,
        color="#2b6f8f",
        linewidth=0.8,
        label="anemometer, 1 Hz",
    )
    axes.fill_between(ends, wind - sigma, wind + sigma, color="#c4622d", alpha=0.35, linewidth=0)
    axes.plot(
        ends,
        wind,
        color="#c4622d",
        linewidth=1.4,
        label="ground truth of the clips (minute mean ± σ)",
    )
    axes.set(
        xlabel="time since the first frame [s]",
        ylabel="wind speed [m/s]",
        xlim=(truth[0], truth[-1]),
        ylim=(0, None),
    )
    axes.legend(loc="lower right", fontsize=8, ncols=3)
    caption = (
        f"{len(logged.time)} one-second means on the common clock; the gap and the stretch that "
        "stuck are left out of "
        f"the averages. {len(clips)} clips of {CLIP_FRAMES} frames."
    )
    return figure_url(figure, dpi=130), caption


def _findings(lake: Lake, at: str) -> list[dict[str, Any]]:
    findings = []
    for row in lake.rows(
        "kind in ('camera', 'wind')", at=at, columns=["source_name", "report"]
    ).to_pylist():
        report = json.loads(row["report"])
        findings += [{"source": row["source_name"], **finding} for finding in report["findings"]]
    return findings
