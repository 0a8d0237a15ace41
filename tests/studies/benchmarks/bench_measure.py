"""What an answer costs on two cores: `flagdata measure` on a video file, by stage, and a refinement
by 50 clips.

The film is of a simulated flag, 7.2 s at 25 Hz and 300 × 300, six windows of the shipped network.
The command is timed as a user runs it, from its start to its end, the fastest and the median of
several; the stages are timed in one process that has begun already. The refinement is that of the
film's first 1.2 s, with all simulations made anew.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np

from flagdata.core.arrays import UInt8Array
from flagdata.core.rng import child_seed
from flagdata.ingest.films.film import Film
from measure.estimate import Options, measure, of_model
from measure.film import FilmReading, FlagSize, subjects
from measure.measuring_model import Network, gate_beside, network
from measure.refine import Clip
from measure.refine import run as refine
from tests.studies.long_films import simulated

_RATE = 25
_WINDOWS = 6
_RUNS = 5
_BUDGET = 50
_SIZE = FlagSize(length=1.5, height=1.0)


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Seconds of the command, of its stages and of a refinement; nothing is written into `out`."""
    del out
    shipped = network(None, lake=None, at=None)
    film = next(
        iter(
            simulated(
                shipped.estimator, count=1, windows=_WINDOWS, seed=child_seed(seed, "bench-measure")
            )
        )
    )
    frames = film.windows.reshape(-1, *film.windows.shape[2:])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "flag.mp4"
        _write(path, frames)
        begun = time.perf_counter()
        (subject,) = subjects(str(path), query=None, lake=None, at=None, reading=FilmReading())
        opened = time.perf_counter() - begun
        command = [
            sys.executable,
            "-m",
            "flagdata.cli",
            "measure",
            str(path),
            "--flag-size",
            "1.5x1.0",
        ]
        return {
            "film": {
                "seconds": len(frames) / _RATE,
                "size": list(frames.shape[1:]),
                "windows": _WINDOWS,
            },
            "command": _spread(lambda: _called([*command, "--anyway"])),
            "command_with_page": _spread(
                lambda: _called([*command, "--anyway", "--report", str(Path(folder) / "flag.html")])
            ),
            "program_start": _spread(
                lambda: _called([sys.executable, "-m", "flagdata.cli", "--version"])
            ),
            "stages": {"open_film": opened, **_stages(subject.film, shipped)},
            "refinement": _refinement(_first_clip(subject.film, shipped), shipped, seed=seed),
        }


def _write(path: Path, frames: UInt8Array) -> None:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=_RATE, options={"crf": "12"})
        stream.height, stream.width = frames.shape[1:]
        stream.pix_fmt = "yuv420p"
        stream.codec_context.time_base = Fraction(1, _RATE)
        for number, frame in enumerate(frames):
            picture = av.VideoFrame.from_ndarray(frame, format="gray").reformat(format="yuv420p")
            picture.pts = number
            container.mux(stream.encode(picture))
        container.mux(stream.encode(None))


def _called(command: list[str]) -> None:
    subprocess.run(command, check=True, capture_output=True)


def _spread(work: Callable[[], None]) -> dict[str, float]:
    """Wall time [s], the first call left out."""
    work()
    found = []
    for _ in range(_RUNS):
        begun = time.perf_counter()
        work()
        found.append(time.perf_counter() - begun)
    return {"least": min(found), "median": float(np.median(found))}


def _stages(film: Film, shipped: Network) -> dict[str, float]:
    """Seconds of the gate's preparation and of all six windows; of one window, of its maps, network
    and checks."""
    model, options = shipped.estimator, Options(size=_SIZE)
    begun = time.perf_counter()
    gate = gate_beside(shipped, false_alarm=options.false_alarm)
    prepared = time.perf_counter()
    clip = _first_clip(film, shipped)
    read = time.perf_counter()
    inputs = model.inputs(clip[None])
    mapped = time.perf_counter()
    embeddings = model.embeddings(inputs)
    embedded = time.perf_counter()
    gate.judge(clip, embeddings[0][0].detach().cpu().numpy().astype(np.float32))
    judged = time.perf_counter()
    measure(film, model, gate=gate, dependence=of_model(model), options=options)
    measured = time.perf_counter()
    return {
        "open_gate": prepared - begun,
        "decode": read - prepared,
        "maps_of_a_window": mapped - read,
        "networks_of_a_window": embedded - mapped,
        "gate_of_a_window": judged - embedded,
        "all_windows": measured - judged,
    }


def _first_clip(film: Film, shipped: Network) -> UInt8Array:
    """(frame, height, width) conditioned, from the film's first frame on."""
    return np.stack([frame for _, frame in film.frames(0.0, film.duration)])[
        : shipped.estimator.front_end.frames
    ]


def _refinement(clip: UInt8Array, shipped: Network, *, seed: int) -> dict[str, Any]:
    begun = time.perf_counter()
    found = refine(
        [Clip(name="flag", frames=clip)],
        shipped.estimator,
        budget=_BUDGET,
        seed=seed,
        level=Options().level,
    )
    wall = time.perf_counter() - begun
    return {
        "evaluations": found.evaluations,
        "wall": wall,
        "by_stage": dict(found.seconds),
        "an_evaluation": {
            stage: spent / found.evaluations for stage, spent in found.seconds.items()
        },
    }
