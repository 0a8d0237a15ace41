"""All simulations of a verdict, gathered: each is read from the folder where it is kept, or made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flagdata.arrays import BoolArray, FloatArray, IntArray
from flagdata.findings import Finding
from flagdata.rng import child_seed, stream
from measure.cloth.calibration import CalibrationOptions, designs_of, with_errors
from measure.cloth.design import TOGETHER, Design, Pairs, Weighable, lasting, nulls, pairs, read
from measure.cloth.emulator import Emulator, informative
from measure.cloth.evidence import Experiments, Sight
from measure.cloth.numerics import Correction, Finer
from measure.cloth.recording import Observed, Projection, check_in_all, shown, usable
from measure.cloth.sight import first_of, responded
from measure.cloth.simulation import OBSERVED
from measure.forecasting.setting import Stage


@dataclass(frozen=True, kw_only=True, eq=False)
class Simulations:
    """Of all recordings.

    Attributes:
        designs: one a recording.
        base: for each recording (simulation, window, observable) of the base model.
        pairs: for each recording, of each effect: what was simulated, and (pair, window, observable) of it.
        nulls: for each recording (null, window, observable).
        kinds: (null,) of numerics.
        weights: (null,) their area weights [kg/m²].
        corrections: for each recording how far the base model's lie from those of a finer mesh.
    """

    designs: tuple[Design, ...]
    base: tuple[FloatArray, ...]
    pairs: tuple[tuple[tuple[Pairs, FloatArray], ...], ...]
    nulls: tuple[FloatArray, ...]
    kinds: IntArray
    weights: FloatArray
    corrections: tuple[Correction, ...]

    def of(self, places: Sequence[int]) -> Simulations:
        """Those of some recordings."""
        return replace(
            self,
            designs=tuple(self.designs[place] for place in places),
            base=tuple(self.base[place] for place in places),
            pairs=tuple(self.pairs[place] for place in places),
            nulls=tuple(self.nulls[place] for place in places),
            corrections=tuple(self.corrections[place] for place in places),
        )


def gathered(
    recordings: Sequence[Observed],
    options: CalibrationOptions,
    effects: Sequence[Weighable],
    *,
    kinds: int,
    folder: Path,
    workers: int = 1,
    stage: Stage | None = None,
) -> Simulations:
    """All that a verdict needs.

    Args:
        effects: that are weighed.
        kinds: of numerics among null experiments.
        folder: where simulations are kept.

    Raises:
        CorruptError: a kept batch that cannot be read.
    """
    designs = designs_of(recordings, options)
    until = lasting(len(designs))
    made = [[pairs(design, effect, until=until) for effect in effects] for design in designs]
    null = nulls(designs, first_of([one.place for one in recordings]), kinds=kinds, seed=options.seed)

    def all_of(what: str, batches: list) -> FloatArray:
        total, done = sum(len(batch.seeds) for batch in batches), 0

        def advance(more: int) -> None:
            nonlocal done
            done += more
            if stage is not None:
                stage(what, done, total)

        return read(batches, folder=folder, workers=workers, advance=advance)[:, 0]

    base = [
        all_of(f"base model, {one.name}", design.batches()) for one, design in zip(recordings, designs, strict=True)
    ]
    finer = [Finer.of(design) for design in designs]
    fine = [all_of(f"finer meshes, {one.name}", list(own.batches)) for one, own in zip(recordings, finer, strict=True)]
    beside = []
    for one, own in zip(recordings, made, strict=True):
        found = all_of(f"effects, {one.name}", [batch for each in own for batch in each.batches])
        ends = np.cumsum([len(each.places) for each in own])[:-1]
        beside.append(tuple(zip(own, np.split(found, ends), strict=True)))
    read_nulls = [all_of(f"nulls, {one.name}", own) for one, own in zip(recordings, null, strict=True)]
    return Simulations(
        designs=tuple(designs),
        base=tuple(base),
        pairs=tuple(beside),
        nulls=tuple(read_nulls),
        kinds=np.repeat(np.arange(kinds), TOGETHER),
        weights=np.concatenate([batch.values["area_weight"] for batch in null[0]]),
        corrections=tuple(one.correction(own, coarse) for one, own, coarse in zip(finer, fine, base, strict=True)),
    )


def shown_by(
    recordings: Sequence[Observed], simulations: Simulations
) -> tuple[tuple[Observed, ...], Simulations, tuple[Sight, ...], tuple[Finding, ...]]:
    """The recordings whose simulations show what they show, their simulations and models, and a warning for each other
    recording.

    Raises:
        InputError: too little is left.
        RefusedError: simulations show nothing of any recording, see `Emulator.fit`.
    """

    def seen(place: int) -> tuple[int, Sight]:
        (own,) = sights_of([recordings[place]], simulations.of([place]))
        return place, own

    both, left_out = usable(range(len(recordings)), seen, name=lambda place: recordings[place].name)
    places = [place for place, _ in both]
    kept = tuple(recordings[place] for place in places)
    check_in_all(kept, left_out=left_out)
    return kept, simulations.of(places), tuple(own for _, own in both), left_out


def sights_of(
    recordings: Sequence[Observed], simulations: Simulations, *, windows: Sequence[slice] | None = None
) -> tuple[Sight, ...]:
    """Each recording's model; as `sight`.

    Args:
        windows: of each recording a part; None for all of them.
    """
    parts = [None] * len(recordings) if windows is None else windows
    return tuple(
        sight(*one, windows=part)
        for *one, part in zip(
            recordings,
            simulations.designs,
            simulations.base,
            simulations.pairs,
            simulations.corrections,
            parts,
            strict=True,
        )
    )


def sight(
    observed: Observed,
    design: Design,
    base: FloatArray,
    own: Sequence[tuple[Pairs, FloatArray]],
    correction: Correction,
    *,
    windows: slice | None = None,
) -> Sight:
    """A recording's model, fitted to simulations.

    Args:
        base: (simulation, window, observable) of the base model.
        own: of each effect the pairs that were simulated, and their readings.
        correction: of the base model's.
        windows: a part of it, of which means alone are modelled; None for all of it.

    Raises:
        RefusedError: as `Emulator.fit`.
    """
    seen = observed if windows is None else part_of(observed, windows)
    summaries = with_errors(seen, base if windows is None else base[:, windows], correction, seed=design.seed)
    changes = seen.projection.changes
    values = design.values()
    looked = np.tile(shown(seen.readings), 1 + changes)
    if changes:
        # A change with the wind that depends on nothing here widens the scatter of all others.
        telling = informative(values, summaries, looked, name=observed.name)
        looked[len(OBSERVED) :] &= telling[len(OBSERVED) :]
    emulator = Emulator.fit(values, summaries, looked, name=observed.name)
    responses = {}
    for made, readings in own:
        count = readings.shape[1]
        projection = Projection(speed=observed.speed[:count], changes=changes)
        with_it = projection.of(readings).reshape(len(readings), -1)
        without = projection.of(base[made.places][:, :count]).reshape(len(readings), -1)
        paired = {name: v[made.places] for name, v in values.items()}
        response = responded(emulator, made.effect, made.strengths, paired, with_it, without)
        if response is not None:
            responses[made.effect.name] = response
    return Sight(
        emulator=emulator,
        azimuth=design.azimuth,
        elevation=design.elevation,
        place=observed.place,
        responses=responses,
    )


def part_of(observed: Observed, windows: slice) -> Observed:
    """Some windows of a recording, of which means alone are taken."""
    return _Part(
        name=observed.name,
        source=observed.source,
        readings=observed.readings[windows],
        log=observed.log,
        first=observed.first,
        place=observed.place,
        sigma=observed.sigma,
        speeds=observed.speed[windows],
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Part(Observed):
    """Windows of a recording, with the winds of these."""

    speeds: FloatArray

    @property
    def speed(self) -> FloatArray:
        return self.speeds

    @property
    def projection(self) -> Projection:
        return Projection(speed=self.speeds, changes=False)


def of_recordings(
    sights: Sequence[Sight], recordings: Sequence[Observed], weighed: tuple[float, float] | None
) -> Experiments:
    """The recordings as the one experiment that they are.

    Args:
        weighed: mean and standard deviation of a stated area weight [kg/m²].
    """
    summaries = tuple(own.summary[None, one.used] for one, own in zip(sights, recordings, strict=True))
    if weighed is None:
        return Experiments(summaries=summaries)
    mean, sigma = weighed
    return Experiments(summaries=summaries, stated=np.array([mean]), sigma=sigma / mean)


def of_nulls(
    sights: Sequence[Sight],
    recordings: Sequence[Observed],
    simulations: Simulations,
    weighed: tuple[float, float] | None,
    *,
    seed: int,
) -> tuple[Experiments, IntArray]:
    """Null experiments with errors of pixels and of the scale, those that show all, and their kinds of numerics. Their
    meshes are about as coarse as the fit's, and are as far from a finer one."""
    found = []
    for one, own, seen, correction in zip(sights, recordings, simulations.nulls, simulations.corrections, strict=True):
        summaries = own.projection.of(seen)
        summaries = (
            summaries
            + correction.mean[: summaries.shape[1]]
            + own.pixels(len(seen), seed=child_seed(seed, "films", "nulls"))
        )
        found.append(summaries.reshape(len(seen), -1)[:, one.used])
    whole = np.all([np.isfinite(own).all(axis=1) for own in found], axis=0)
    made = Experiments(summaries=tuple(own[whole] for own in found))
    return _weighed(made, simulations.weights, whole, weighed, seed=seed, what="scale"), simulations.kinds[whole]


def of_base(
    sights: Sequence[Sight],
    recordings: Sequence[Observed],
    simulations: Simulations,
    weighed: tuple[float, float] | None,
    *,
    seed: int,
) -> Experiments:
    """The base model's simulations with errors of numerics, of pixels and of the scale, those that show all. A cloth is
    the same in all recordings."""
    found = [
        with_errors(own, base, correction, seed=design.seed)[:, one.used]
        for one, own, base, design, correction in zip(
            sights, recordings, simulations.base, simulations.designs, simulations.corrections, strict=True
        )
    ]
    whole = np.all([np.isfinite(own).all(axis=1) for own in found], axis=0)
    made = Experiments(summaries=tuple(own[whole] for own in found))
    weights = simulations.designs[0].values()["area_weight"]
    return _weighed(made, weights, whole, weighed, seed=seed, what="scale of the base model")


def _weighed(
    made: Experiments,
    weights: FloatArray,
    which: BoolArray,
    weighed: tuple[float, float] | None,
    *,
    seed: int,
    what: str,
) -> Experiments:
    """Experiments with their area weights as a scale reads them that is as good as the one of the recordings' cloth.

    Args:
        weights: (n,) of all that were simulated [kg/m²].
        which: (n,) of them the experiments are of.
    """
    if weighed is None:
        return made
    share = weighed[1] / weighed[0]
    read = weights * np.exp(share * stream(seed, "films", what).standard_normal(len(weights)))
    return replace(made, stated=read[which], sigma=share)
