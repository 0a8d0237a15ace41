"""All simulations of a verdict, gathered: each is read from the folder where it is kept, or
made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.core.findings import Finding
from flagdata.core.rng import child_seed, stream
from flagdata.core.stated import Stated
from measure.cloth.design import (
    TOGETHER,
    CalibrationOptions,
    Design,
    Pairs,
    Weighable,
    designs_of,
    lasting,
    nulls,
    pairs,
    readings_of,
)
from measure.cloth.emulator import Emulator, informative
from measure.cloth.flag_simulation import OBSERVED
from measure.cloth.model_evidence import Experiments, Sight
from measure.cloth.numerics import Correction, Finer, with_errors
from measure.cloth.observed_recording import Observed, Projection, check_in_all, shown, usable
from measure.cloth.sight import first_of, response_of
from measure.forecasting.setting import Stage

_RELATIVE = 0.01
"""Standard uncertainty of a weight that is stated without one, as a share."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Simulations:
    """Of all recordings.

    Attributes:
        designs: one a recording.
        base: for each recording (simulation, window, observable) of the base model.
        pairs: for each recording, of each effect: what was simulated, and (pair, window,
            observable) of it.
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
        """Selects those of some recordings."""
        return replace(
            self,
            designs=tuple(self.designs[number] for number in places),
            base=tuple(self.base[number] for number in places),
            pairs=tuple(self.pairs[number] for number in places),
            nulls=tuple(self.nulls[number] for number in places),
            corrections=tuple(self.corrections[number] for number in places),
        )


def simulate_all(
    recordings: Sequence[Observed],
    options: CalibrationOptions,
    effects: Sequence[Weighable],
    *,
    kinds: int,
    folder: Path,
    workers: int = 1,
    stage: Stage | None = None,
) -> Simulations:
    """Simulates all that a verdict needs.

    Args:
        effects: that are weighed.
        kinds: of numerics among null experiments.
        folder: where simulations are kept.

    Raises:
        CorruptError: a kept batch that cannot be read.
    """
    designs = designs_of(recordings, options)
    until = lasting(len(designs))
    paired = [[pairs(design, effect, until=until) for effect in effects] for design in designs]
    null = nulls(
        designs,
        first_of([recording.place for recording in recordings]),
        kinds=kinds,
        seed=options.seed,
    )

    def all_of(label: str, batches: list) -> FloatArray:
        total, done = sum(batch.effort for batch in batches), 0

        def advance(count: int) -> None:
            nonlocal done
            done += count
            if stage is not None:
                stage(label, done, total)

        return readings_of(batches, folder=folder, workers=workers, advance=advance)[:, 0]

    base = [
        all_of(f"base model, {recording.name}", design.batches())
        for recording, design in zip(recordings, designs, strict=True)
    ]
    finer = [Finer.of(design) for design in designs]
    fine = [
        all_of(f"finer meshes, {recording.name}", list(designed.batches))
        for recording, designed in zip(recordings, finer, strict=True)
    ]
    of_effects = []
    for film, designed in zip(recordings, paired, strict=True):
        readings = all_of(
            f"effects, {film.name}", [batch for pair in designed for batch in pair.batches]
        )
        ends = np.cumsum([len(pair.indices) for pair in designed])[:-1]
        of_effects.append(tuple(zip(designed, np.split(readings, ends), strict=True)))
    read_nulls = [
        all_of(f"nulls, {recording.name}", designed)
        for recording, designed in zip(recordings, null, strict=True)
    ]
    return Simulations(
        designs=tuple(designs),
        base=tuple(base),
        pairs=tuple(of_effects),
        nulls=tuple(read_nulls),
        kinds=np.repeat(np.arange(kinds), TOGETHER),
        weights=np.concatenate([batch.values["area_weight"] for batch in null[0]]),
        corrections=tuple(
            repeated.correction(readings, coarse)
            for repeated, readings, coarse in zip(finer, fine, base, strict=True)
        ),
    )


def shown_by(
    recordings: Sequence[Observed], simulations: Simulations
) -> tuple[tuple[Observed, ...], Simulations, tuple[Sight, ...], tuple[Finding, ...]]:
    """Returns the recordings whose simulations show what they show, their simulations and models,
    and a warning for each other recording.

    Raises:
        InputError: too little is left.
        RefusedError: simulations show nothing of any recording, see `Emulator.fit`.
    """

    def seen(number: int) -> tuple[int, Sight]:
        (fitted,) = sights_of([recordings[number]], simulations.of([number]))
        return number, fitted

    sights, left_out = usable(
        range(len(recordings)), seen, name=lambda number: recordings[number].name
    )
    places = [number for number, _ in sights]
    shown_recordings = tuple(recordings[number] for number in places)
    check_in_all(shown_recordings, left_out=left_out)
    return shown_recordings, simulations.of(places), tuple(fitted for _, fitted in sights), left_out


def sights_of(
    recordings: Sequence[Observed],
    simulations: Simulations,
    *,
    windows: Sequence[slice] | None = None,
) -> tuple[Sight, ...]:
    """Fits each recording's model; as `sight`.

    Args:
        windows: of each recording a part; None for all of them.
    """
    parts = [None] * len(recordings) if windows is None else windows
    return tuple(
        sight(*inputs, windows=part)
        for *inputs, part in zip(
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
    effect_readings: Sequence[tuple[Pairs, FloatArray]],
    correction: Correction,
    *,
    windows: slice | None = None,
) -> Sight:
    """Fits a recording's model to simulations.

    Args:
        base: (simulation, window, observable) of the base model.
        effect_readings: of each effect the pairs that were simulated, and their readings.
        correction: of the base model's.
        windows: a part of it, of which means alone are modelled; None for all of it.

    Raises:
        RefusedError: as `Emulator.fit`.
    """
    part = observed if windows is None else part_of(observed, windows)
    summaries = with_errors(
        part, base if windows is None else base[:, windows], correction, seed=design.seed
    )
    changes = part.projection.changes
    values = design.values()
    visible = np.tile(shown(part.readings), 1 + changes)
    if changes:
        # A change with the wind that depends on nothing here widens the scatter of all others.
        dependent = informative(values, summaries, visible, name=observed.name)
        visible[len(OBSERVED) :] &= dependent[len(OBSERVED) :]
    # What flags of the base model show, then what each effect changes in pairs of flags with and
    # without it.
    emulator = Emulator.fit(values, summaries, visible, name=observed.name)
    responses = {}
    for pair, readings in effect_readings:
        count = readings.shape[1]
        projection = Projection(speed=observed.speed[:count], changes=changes)
        with_it = projection.of(readings).reshape(len(readings), -1)
        without = projection.of(base[pair.indices][:, :count]).reshape(len(readings), -1)
        paired = {name: v[pair.indices] for name, v in values.items()}
        response = response_of(emulator, pair.effect, pair.strengths, paired, with_it, without)
        if response is not None:
            responses[pair.effect.name] = response
    return Sight(
        emulator=emulator,
        azimuth=design.azimuth,
        elevation=design.elevation,
        place=observed.place,
        responses=responses,
    )


def part_of(observed: Observed, windows: slice) -> Observed:
    """Returns some windows of a recording, of which means alone are taken."""
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


def deviation_of(area_weight: Stated) -> float:
    """Returns the standard deviation of a stated area weight [kg/m²], `_RELATIVE` of it at
    least."""
    return max(area_weight.deviation, _RELATIVE * area_weight.middle)


def of_recordings(
    sights: Sequence[Sight],
    recordings: Sequence[Observed],
    area_weight: Stated | None,
) -> Experiments:
    """Returns the recordings as the one experiment that they are.

    Args:
        area_weight: of a cloth that was weighed [kg/m²].
    """
    summaries = tuple(
        recording.summary[None, sight.used]
        for sight, recording in zip(sights, recordings, strict=True)
    )
    if area_weight is None:
        return Experiments(summaries=summaries)
    mean = area_weight.middle
    return Experiments(
        summaries=summaries, stated=np.array([mean]), sigma=deviation_of(area_weight) / mean
    )


def of_nulls(
    sights: Sequence[Sight],
    recordings: Sequence[Observed],
    simulations: Simulations,
    area_weight: Stated | None,
    *,
    seed: int,
) -> tuple[Experiments, IntArray]:
    """Makes null experiments with errors of pixels and of the scale, those that show all, and their
    kinds of numerics. Their meshes are about as coarse as the fit's, and are as far from a finer
    one."""
    columns = []
    for sight, recording, readings, correction in zip(
        sights, recordings, simulations.nulls, simulations.corrections, strict=True
    ):
        summaries = recording.projection.of(readings)
        summaries = (
            summaries
            + correction.mean[: summaries.shape[1]]
            + recording.pixels(len(readings), seed=child_seed(seed, "films", "nulls"))
        )
        columns.append(summaries.reshape(len(readings), -1)[:, sight.used])
    complete = np.all([np.isfinite(rows).all(axis=1) for rows in columns], axis=0)
    experiments = Experiments(summaries=tuple(rows[complete] for rows in columns))
    kinds = simulations.kinds[complete]
    return _as_weighed(
        experiments, simulations.weights, complete, area_weight, seed=seed, stream_name="scale"
    ), kinds


def of_base(
    sights: Sequence[Sight],
    recordings: Sequence[Observed],
    simulations: Simulations,
    area_weight: Stated | None,
    *,
    seed: int,
) -> Experiments:
    """Returns the base model's simulations with errors of numerics, of pixels and of the scale,
    those that show all. A cloth is the same in all recordings."""
    columns = [
        with_errors(recording, base, correction, seed=design.seed)[:, sight.used]
        for sight, recording, base, design, correction in zip(
            sights,
            recordings,
            simulations.base,
            simulations.designs,
            simulations.corrections,
            strict=True,
        )
    ]
    complete = np.all([np.isfinite(rows).all(axis=1) for rows in columns], axis=0)
    experiments = Experiments(summaries=tuple(rows[complete] for rows in columns))
    weights = simulations.designs[0].values()["area_weight"]
    return _as_weighed(
        experiments,
        weights,
        complete,
        area_weight,
        seed=seed,
        stream_name="scale of the base model",
    )


def _as_weighed(
    experiments: Experiments,
    weights: FloatArray,
    which: BoolArray,
    area_weight: Stated | None,
    *,
    seed: int,
    stream_name: str,
) -> Experiments:
    """Experiments with their area weights as a scale reads them that is as good as the one of the
    recordings' cloth.

    Args:
        weights: (n,) of all that were simulated [kg/m²].
        which: (n,) of them the experiments are of.
    """
    if area_weight is None:
        return experiments
    share = deviation_of(area_weight) / area_weight.middle
    read = weights * np.exp(
        share * stream(seed, "films", stream_name).standard_normal(len(weights))
    )
    return replace(experiments, stated=read[which], sigma=share)
