"""Sets of the registered effects in one design, and null kinds of that design by the product's own
batches: what tests of tracked markers are judged on.

Each set is looked at once at the calibration that it was simulated with, as null kinds are. Sets
come in rounds, of which each has every effect at every registered strength once. What is there is
not made anew, so that a run that was stopped goes on.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from io import BytesIO
from pathlib import Path

import numpy as np
import torch

from flagdata.core.arrays import read_arrays
from flagdata.core.files.outputs import rewrite
from flagdata.core.rng import child_seed, stream
from measure.forecasting import Calibration, Cut, Setting, columns
from measure.inference import Nulls
from measure.nulls import NullBank, NullBatch
from measure.nulls import bank as banks
from measure.nulls.free_run import mistaken, settled_off
from measure.probes import Course, StatisticRows, Statistics, projected_statistics
from measure.trajectories import Specimen
from sim.cloth import handles
from sim.cloth.material import named_material
from sim.cloth.mesh import grid
from tests.studies.challenge.answer_key import Acting, AnswerKey
from tests.studies.challenge.folder import HEIGHT, MODEL_COLUMNS, MODEL_ROWS, ChallengeFolder
from tests.studies.challenge.make import make
from tests.studies.challenge.meshes import layout
from tests.studies.challenge.recipe import ChallengeRecipe, Kind, load

KINDS = 48
NOTHING_ACTS, ONE_ACTS = 18, 26
"""Sets of a round."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LookedAt:
    """A set and its statistics.

    Attributes:
        name: of the set.
        acting: the effect; None where nothing acts.
        segments: as those of nulls, with the calibration that the set was simulated with.
    """

    name: str
    acting: Acting | None
    segments: Nulls


def one_design() -> ChallengeRecipe:
    """Narrows the registered recipe to one cloth, rate and noise, 204 markers, steady winds."""
    registered = load("registered")
    none_of = {Kind.PAIR: 0, Kind.OUTSIDE: 0}
    return replace(
        registered,
        composition={Kind.NULL: NOTHING_ACTS, Kind.ONE: ONE_ACTS, **none_of},
        materials=("camel-ponte-roma",),
        rates=(25,),
        noises=(1.3e-3,),
        speed=replace(registered.speed, low=3.0, high=7.0),
        varying=0.0,
        marker_columns=17,
        marker_rows=12,
    )


def build_kinds(folder: Path, *, seed: int) -> NullBank:
    """Builds the null kinds of the design, each with a layout of markers of its own; returns their
    bank."""
    recipe, seed = one_design(), child_seed(seed, "kinds")
    mesh = grid(width=recipe.width, height=recipe.height, columns=MODEL_COLUMNS, rows=MODEL_ROWS)
    held = handles.corners(mesh.rest)
    specimen = Specimen(
        mesh=mesh,
        material=named_material(recipe.materials[0]),
        held=held,
        anchors=np.array([(0.0, 0.0, HEIGHT + mesh.rest[vertex, 1]) for vertex in held]),
        stiffness=handles.ARCSIM_STIFFNESS,
        anchors_given=False,
    )
    rate = float(recipe.rates[0])
    frames = round(recipe.duration * rate)
    cut = Cut.of(rate, frames)
    each = banks.segments_of_each(recipe.count * cut.segments(frames))
    made = [
        banks.prior_batch(
            specimen,
            markers=layout(recipe, stream(own, "layout")),
            rate=rate,
            noise=recipe.noises[0],
            speeds=banks.around(recipe.speed.low, recipe.speed.high),
            duration=cut.lasting(each),
            seed=own,
        )
        for own in (child_seed(seed, "null", index) for index in range(KINDS))
    ]
    banks.build(folder, made)
    return banks.load(folder, words="of the design")


def make_round(folder: Path, *, seed: int, number: int) -> None:
    """Makes the sets of a round, each with its statistics in a file of its own."""
    own, count = child_seed(seed, "round", number), NOTHING_ACTS + ONE_ACTS
    made = folder / f"round-{number}"
    if not made.exists():
        make(made, one_design(), seed=own, count=count)
    target = ChallengeFolder(made)
    for name in target.names():
        path = folder / f"{number}-{name}.npz"
        if not path.exists():
            arrays = _arrays(_look(target, name, seed=own))
            key = json.dumps(target.seal(name)["key"])
            buffer = BytesIO()
            np.savez(buffer, key=np.array(key), **arrays)
            rewrite(path, buffer.getvalue())


def read_sets(folder: Path) -> list[LookedAt]:
    """Reads all sets that are there."""
    found = []
    for path in sorted(folder.glob("*-set-*.npz")):
        arrays = read_arrays(path, what="the statistics of a set", fix="make them again")
        key = AnswerKey.from_dict(json.loads(str(arrays["key"])))
        acting = key.effects[0] if key.effects else None
        found.append(LookedAt(name=path.stem, acting=acting, segments=_segments(arrays)))
    return found


def _look(target: ChallengeFolder, name: str, *, seed: int) -> Nulls:
    """Computes the statistics of a set at its true calibration."""
    torch.set_num_threads(1)
    key = AnswerKey.from_dict(target.seal(name)["key"])
    true = Calibration(area_weight=key.density, bending=key.bending, damping=key.damping)
    setting = replace(Setting.of(target.experiment(name)), calibration=true)
    segments, recordings = setting.segments, setting.experiment.recordings
    measured, _ = projected_statistics(
        setting.forecaster, segments, [true] * len(segments), columns()
    )
    free = NullBatch(
        specimen=setting.experiment.specimen,
        markers=segments.markers,
        rate=1 / segments.period,
        duration=max(float(recording.times[-1]) for recording in recordings),
        noise=0.0,
        calibrations=(true,) * len(recordings),
        speeds=tuple(float(speed) for speed in setting.speeds),
        winds=tuple(recording.wind for recording in recordings),
        seed=child_seed(seed, name),
    )
    settled = settled_off(recordings, mistaken(free))[measured.recording]
    rows = len(measured.recording)
    return Nulls(
        statistics=replace(measured, settled=settled),
        speeds=setting.speeds[measured.recording],
        calibration=np.tile(np.array(true.steps_from(Calibration())), (rows, 1)),
        numerics=np.zeros(rows, dtype=np.int64),
        noise=np.full(rows, setting.design.noise),
        period=np.full(rows, segments.period),
        cloth=np.full(rows, setting.design.cloth),
    )


def _arrays(rows: StatisticRows, prefix: str = "") -> dict[str, np.ndarray]:
    """Lists the arrays of a record and of those in it, by paths."""
    found: dict[str, np.ndarray] = {}
    for field in fields(rows):
        value = getattr(rows, field.name)
        if isinstance(value, StatisticRows):
            found |= _arrays(value, f"{prefix}{field.name}.")
        elif value is not None:
            found[f"{prefix}{field.name}"] = value
    return found


def _segments(arrays: Mapping[str, np.ndarray]) -> Nulls:
    """Reads what `_arrays` lists of a set."""

    def under(prefix: str) -> dict[str, np.ndarray]:
        cut = {
            name.removeprefix(prefix): array
            for name, array in arrays.items()
            if name.startswith(prefix)
        }
        return {name: array for name, array in cut.items() if "." not in name and name != "key"}

    statistics = Statistics(
        **under("statistics."),
        turning=Statistics(**under("statistics.turning.")),
        course=Course(**under("statistics.course.")),
    )
    return Nulls(statistics=statistics, **under(""))
