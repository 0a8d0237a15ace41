"""What meshes and steps do to a calibration's summaries: the same flags by the fit's numerics and
by others.

Three batches of sixteen flags of a design, of little, middle and much damping, are simulated for
half a minute as a
calibration does, and by others: a mesh of 1.5 times as many vertices along a side, an irregular
mesh of as many, and a quarter of the step. Cloth, place, wind and start are the same, so that the
differences' mean is the bias and their standard deviation that of numerics and of chaos. Reported
for each batch and of all: what `measure.cloth.numerics` states of meshes. Cases that were simulated
are kept in FLAGDATA_NUMERICS, by default a new folder.

`python -m tests.studies numerics`: some three minutes of a core.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np

from flagdata.core.arrays import FloatArray
from measure.cloth import (
    OBSERVED,
    Design,
    Discretisation,
    Flag,
    FlagBatch,
    Log,
    Normal,
    Projection,
    Uncertain,
    numerics,
    readings_of,
)

DURATION = 30.0  # s
BATCHES = {"little damping": 0, "middle": 3, "much damping": 7}
OTHERS = {
    "finer mesh": (1.5, None, 1.0),
    "irregular mesh": (1.0, 7, 1.0),
    "quarter of the step": (1.0, None, 0.25),
}
"""Vertices along a side over the fit's, seed of an irregular mesh, and step over the fit's."""
_VIEW = Uncertain(
    name="azimuth",
    unit="rad",
    prior=Normal(mean=math.radians(75.0), sigma=math.radians(7.0)),
    source="stated",
)


def design() -> Design:
    """Of flags in a wind of 4 to 6 m/s."""
    times = np.arange(-20.0, DURATION + 1.0)
    speed = 5.0 + 0.6 * np.sin(times / 2.1) + 0.5 * np.sin(times / 4.7)
    log = Log(times=times, speed=speed, distance=2.5)
    return Design(
        flag=Flag(length=1.5, height=1.0), log=log, duration=DURATION, azimuth=_VIEW, seed=20261127
    )


def other(batch: FlagBatch, kind: str) -> FlagBatch | None:
    """A batch by other numerics; None where leapfrog has no step to shorten."""
    finer, uneven, share = OTHERS[kind]
    if share < 1 and batch.step is None:
        return None
    step = None if batch.step is None else batch.step * share
    return replace(
        batch, discretisation=Discretisation(finer=finer, diagonals=0, uneven=uneven, step=step)
    )


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Differences by batch and kind of numerics. The design has its own seed."""
    del seed
    folder = Path(os.environ.get("FLAGDATA_NUMERICS") or mkdtemp(prefix="numerics-"))
    own = design()
    starts = np.arange(round(DURATION / 2.5)) * 2.5
    projection = Projection(speed=own.log.mean_speed(starts, starts + 2.5), changes=True)
    rows: dict[str, dict[str, Any]] = {kind: {} for kind in OTHERS}
    for name, place in BATCHES.items():
        batch = own.batches()[place]
        base = projection.of(readings_of([batch], folder=folder)[:, 0])
        for kind in OTHERS:
            made = other(batch, kind)
            if made is not None:
                rows[kind][name] = projection.of(readings_of([made], folder=folder)[:, 0]) - base
    sheet = {
        "observables": list(OBSERVED),
        "stated": {
            "mean": numerics.MEASURED.mean.tolist(),
            "sigma": numerics.MEASURED.sigma.tolist(),
        },
        "found": {
            kind: {
                name: _about(change)
                for name, change in {**of, "all": np.concatenate(list(of.values()))}.items()
            }
            for kind, of in rows.items()
        },
    }
    (out / "validate-numerics.md").write_text(page(sheet), encoding="utf-8")
    return sheet


def _about(change: FloatArray) -> dict[str, Any]:
    """Mean and standard deviation of differences (flag, 2, observable), and how many flags show
    all."""
    whole = change[np.isfinite(change).all(axis=(1, 2))]
    return {
        "flags": len(whole),
        "bias": whole.mean(axis=0).tolist(),
        "sigma": whole.std(axis=0, ddof=1).tolist(),
    }


def page(sheet: Mapping[str, Any]) -> str:
    """The sheet in Markdown."""
    lines = [
        "# What meshes and steps do to a calibration's summaries",
        "",
        (
            f"Other numerics less the fit's, of the same flags in the same {DURATION:g} s of wind: "
            "mean ± standard "
            "deviation; the mean itself is known to the deviation over the root of the number of "
            "flags."
        ),
    ]
    for place, what in enumerate(("Means over windows", "Slopes with the logarithm of the wind")):
        lines += [
            "",
            f"## {what}",
            "",
            "| numerics | flags | n | " + " | ".join(sheet["observables"]) + " |",
        ]
        lines.append("|---" * (3 + len(sheet["observables"])) + "|")
        cells = zip(sheet["stated"]["bias"][place], sheet["stated"]["sigma"][place], strict=True)
        lines.append("| as stated | | | " + " | ".join(_cell(*cell) for cell in cells) + " |")
        for kind, of in sheet["found"].items():
            for name, own in of.items():
                cells = [
                    _cell(*cell)
                    for cell in zip(own["bias"][place], own["sigma"][place], strict=True)
                ]
                lines.append(f"| {kind} | {name} | {own['flags']} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _cell(bias: float, sigma: float) -> str:
    return f"{bias:+.3f} ± {sigma:.3f}".replace("-", "−")
