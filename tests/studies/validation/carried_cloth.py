"""A verdict on a real cloth that a robot swings in still air, by nulls that are carried along the
same ways.

One repeat of each of four programmes makes an experiment, each from when its nodes begin to move.
The depth camera's nodes come at uneven stamps of about 10 Hz and are brought to 10 Hz by splines;
its pins are where the camera shows the upper corners, as `close-loop` takes them of any recording.
As a control, recordings are made along the same ways by a mesh and steps of their own, without an
effect and with a strong one, and judged by the same nulls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from scipy.interpolate import CubicSpline

from flagdata.core.arrays import FloatArray
from flagdata.core.files.caches import user_cache
from flagdata.core.rng import child_seed
from measure.closing import close_loop
from measure.forecasting import Calibration, Setting
from measure.loop import LoopOptions
from measure.nulls import NullBatch, null_plan, tracks
from measure.nulls import bank as banks
from measure.trajectories import (
    Experiment,
    Hold,
    Observation,
    Setup,
    WindTrack,
    from_arrays,
    observe,
    sheet,
)
from measure.verdict import Verdict
from sim.cloth.material import named_material
from sim.effects import EFFECTS, Effect
from tests.evidence import ABSENT, REFERENCE
from tests.studies.validation.robot_cloth import MATERIAL
from tests.studies.validation.robot_cloth.model import Cloth
from tests.studies.validation.robot_cloth.reading import Swing, read

RECORDINGS = ("range30_rep1", "range60_rep1", "range90_rep1", "range120_rep1")
RATE = 10.0  # Hz
KINDS = 20
LASTING = 4.6  # s of each: two segments
VERTICES = 36
_MOVED = 0.05  # m, from where it hangs
CONTROLS: dict[str, tuple[Effect, ...]] = {
    "nothing": (),
    "tangential-linear-drag 0.8 kg/(m² s)": (EFFECTS["tangential-linear-drag"](coefficient=0.8),),
}
"""What acts in the controls."""


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """The verdicts; what is missing where the recordings are."""
    folder = REFERENCE / "cloth" / "robot-held"
    if not folder.is_dir():
        return dict(ABSENT)
    torch.set_num_threads(1)
    swings = [read(folder, name) for name in RECORDINGS]
    cloth = Cloth.seen(swings, named_material(MATERIAL))
    seen = observe([observed(cloth, swing) for swing in swings], setup(cloth))
    options = _bank(seen.experiment, seed)
    found = {"the robot's": _row(close_loop(seen.experiment, options))}
    for acting, effects in CONTROLS.items():
        made = recorded(seen.experiment, effects, seed=child_seed(seed, "control", acting))
        found[f"made along the same ways, acting: {acting}"] = _row(close_loop(made, options))
    settings = {
        "recordings": list(RECORDINGS),
        "rate": RATE,
        "seconds": LASTING,
        "kinds": KINDS,
        "vertices": VERTICES,
        "noise": [own.noise for own in seen.experiment.recordings],
        "findings": [one.what for one in seen.findings],
    }
    document = {**settings, "verdicts": found}
    (out / "validate-carried-cloth.md").write_text(page(document), encoding="utf-8")
    return document


def setup(cloth: Cloth) -> Setup:
    """The square of nodes, held at its upper corners; the cloth's mass is not published."""
    return Setup(
        outline=sheet(cloth.width, cloth.height),
        material=cloth.material,
        area_weight_uncertainty=None,
        pins=Hold.TOP_CORNERS,
        carried=True,
        vertices=VERTICES,
    )


def observed(cloth: Cloth, swing: Swing) -> Observation:
    """`LASTING` of a recording at `RATE` from when its upper corners have moved, each node by a
    spline through where it was tracked."""
    upper = swing.positions[:, list(cloth.upper)].mean(axis=1)
    away = np.linalg.norm(upper - swing.hanging[list(cloth.upper)].mean(axis=0), axis=1)
    begins = float(swing.times[int(np.argmax(np.nan_to_num(away) > _MOVED))])
    times = begins + np.arange(round(LASTING * RATE)) / RATE
    positions = np.empty((len(times), swing.side**2, 3))
    for node in range(swing.side**2):
        tracked = np.isfinite(swing.positions[:, node]).all(axis=1)
        positions[:, node] = CubicSpline(swing.times[tracked], swing.positions[tracked, node])(
            times
        )
    return from_arrays(
        name=swing.name,
        positions=positions,
        rest=_places(cloth),
        rate=RATE,
        wind=WindTrack.constant((0.0, 0.0, 0.0)),
    )


def recorded(experiment: Experiment, effects: Sequence[Effect], *, seed: int) -> Experiment:
    """Recordings made along the ways of others, as long, by a mesh and steps of their own."""
    aligned = Setting.of(experiment).experiment
    specimen, count = aligned.specimen, len(aligned.recordings)
    first = aligned.recordings[0]
    lasting = min(float(r.times[-1]) for r in aligned.recordings)
    noise = max(r.noise for r in aligned.recordings)
    batch = NullBatch(
        specimen=specimen,
        markers=first.markers,
        rate=first.rate,
        duration=lasting,
        noise=noise,
        calibrations=(Calibration(area_weight=1.1, bending=1.5, damping=3e-3),) * count,
        speeds=(0.0,) * count,
        seed=seed,
        tracks=tracks.like(aligned.recordings, specimen.seats, count, duration=lasting, seed=seed),
        effects=tuple(effects),
    )
    return replace(aligned, recordings=tuple(batch.simulate()))


def page(document: dict[str, Any]) -> str:
    """The verdicts as a page of Markdown."""
    lines = [
        "# A verdict on a cloth carried by a robot",
        "",
        _DATA.format(**document),
        "",
        (
            "| data | conclusion | p | statistic | nulls' largest | error of forecasts [mm] | density, "
            "bending, damping |"
        ),
        "|---|---|---|---|---|---|---|",
        *(f"| {name} | {_cells(row)} |" for name, row in document["verdicts"].items()),
        "",
        *(f"- *{name}*: {row['words']}" for name, row in document["verdicts"].items()),
    ]
    return "\n".join(lines) + "\n"


_DATA = (
    "{seconds:g} s of one repeat of each of four programmes, {rate:g} Hz, in still air, by a mesh "
    "of {vertices} "
    "vertices; {kinds} kinds of nulls, carried along the same ways from other instants on, judged "
    "at 0.05. Controls "
    "are made along these ways by a mesh and steps of their own and judged by the same nulls."
)


def _cells(row: dict[str, Any]) -> str:
    values = ", ".join(
        f"{row['parameters'][name]:.3g}" for name in ("density", "bending", "damping")
    )
    called = f"{row['conclusion']}{': ' if row['named'] else ''}{', '.join(row['named'])}"
    return (
        f"{called} | {row['p']:.3f} | {row['statistic']:.1f} | {row['largest_null']:.1f} | "
        f"{1e3 * row['error']:.1f} | "
        f"{values}"
    )


def _row(verdict: Verdict) -> dict[str, Any]:
    squares = np.concatenate([np.square(own.in_time) for own in verdict.residuals])
    return {
        "conclusion": verdict.conclusion.value,
        "named": list(verdict.named),
        "words": verdict.words,
        "p": verdict.test.p_value.point,
        "statistic": verdict.test.statistic,
        "largest_null": max(verdict.test.null),
        "kinds": verdict.test.kinds,
        "nulls": verdict.test.nulls,
        "error": float(np.sqrt(squares.mean())),
        "parameters": {p.name: p.before.point for p in verdict.parameters},
        "ranking": [[c.effect, c.strength.point, c.why_not] for c in verdict.ranking[:5]],
    }


def _bank(experiment: Experiment, seed: int) -> LoopOptions:
    """By `KINDS` kinds of nulls of an experiment's own ways."""
    wanted = null_plan.batches(Setting.of(experiment), kinds=KINDS, seed=seed)
    folder = user_cache() / "nulls" / wanted[0].identity()[:32]
    banks.build(folder, wanted, workers=2)
    return LoopOptions(seed=seed, bank=folder)


def _places(cloth: Cloth) -> FloatArray:
    """(node, 2) columns from left to right, each from top to bottom [m]."""
    place = np.arange(cloth.side) / (cloth.side - 1)
    u, v = np.meshgrid(place * cloth.width, cloth.height * (1 - place), indexing="ij")
    return np.stack([u.ravel(), v.ravel()], axis=1)
