"""The simulations that calibrate and close-loop need of one recording: planned, run in batches,
each batch kept in a file named by the hash of its inputs.

An interrupted calibration goes on where it was, and another one of the same film, log and seed
simulates nothing.

The base model's simulations of a verdict are those of `flagdata calibrate`, so that a loop after a
calibration makes none of them anew. Each simulation with an effect repeats one of these with the
same cloth, place and turbulence, so that the two differ by the effect and by chaos alone. Null
experiments are of the same minutes of wind, of cloths and places over the same priors, each kind of
numerics a batch.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core import workload
from flagdata.core.arrays import FloatArray, IntArray, read_arrays
from flagdata.core.json_values import json_values
from flagdata.core.rng import child_seed, stream
from flagdata.errors import CorruptError, InputError
from flagdata.recipes.typed_tables import Range, Scale
from measure.cloth.blown_wind import Log
from measure.cloth.flag_prior import (
    AZIMUTH,
    CLOTH,
    DISTANCE,
    ELEVATION,
    FABRIC,
    NUISANCES,
    STRETCHING,
    Fabric,
    Uncertain,
    clock_error,
    draws,
)
from measure.cloth.flag_simulation import BATCH, LITTLE, Discretisation, Flag, FlagBatch
from measure.cloth.observed_recording import Observed, check_in_all
from measure.forecasting.recorded import STATED_WEIGHT
from measure.forecasting.strengths import Strengths, on_films
from measure.observables.observable import WINDOW
from sim.effects.weighing import Need
from sim.workers import Simulatable, simulate_missing


@dataclass(frozen=True, kw_only=True)
class Weighable(Strengths):
    """An effect with the prior of its strength."""

    @cached_property
    def prior(self) -> Uncertain:
        """Returns the prior of the strength beyond its null value."""
        scale = Scale.LOG if self.low > 0 else Scale.LINEAR
        return Uncertain(
            name=self.name,
            unit=self.column.unit,
            prior=Range(low=self.low, high=self.high, scale=scale),
            source="from what a minute of film hardly shows to beyond what is expected in the "
            "field",
        )


def weighable(flag: Flag) -> tuple[Weighable, ...]:
    """Returns the effects that are weighed for a flag: those that need nothing else."""
    has = filmed(flag, None)
    return tuple(
        Weighable(column=strength.column, low=strength.low, high=strength.high)
        for strength in on_films()
        if strength.column.possible(has)
    )


def filmed(flag: Flag, weight_uncertainty: float | None) -> frozenset[Need]:
    """Lists what films of a flag beside a log have of that which effects need: the picture shows
    where it is attached, and how the pole leans.

    Args:
        weight_uncertainty: relative standard uncertainty of the stated area weight; None where none
            is stated.
    """
    has = {Need.FILMS, Need.STILL, Need.TURBULENCE, Need.ANCHORS}
    if flag.attachment == "corners":
        has.add(Need.FREE_HOIST)
    if weight_uncertainty is not None and weight_uncertainty <= STATED_WEIGHT:
        has.add(Need.AREA_WEIGHT)
    return frozenset(has)


FAR = 15.0
"""m from which a flag is filmed where the user gives no distance: beyond some flag lengths it
hardly matters."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Design:
    """All simulations for one recording.

    Attributes:
        flag: that was filmed.
        log: of the wind, from the film's first frame on.
        duration: of the film, a whole number of windows [s].
        azimuth, elevation: of the camera's axis, as far as they are known.
        count: of simulations.
        seed: of all draws.
        distance: of the camera [m].
        recording: label of the recording; recordings of one cloth have the same cloths and
            different turbulence.
        place: label of the place; recordings at one place share its view and its anemometer.
        fabric: which measured tables the cloths have.
    """

    flag: Flag
    log: Log
    duration: float
    azimuth: Uncertain = AZIMUTH
    elevation: Uncertain = ELEVATION
    count: int = 128
    seed: int = 0
    distance: float = FAR
    recording: str = ""
    place: str = ""
    fabric: Uncertain = FABRIC

    @property
    def cloth(self) -> tuple[Uncertain, ...]:
        """Returns what differs among the cloths."""
        return (*CLOTH, STRETCHING, self.fabric)

    def quantities(self) -> tuple[Uncertain, ...]:
        """Returns what differs among the simulations."""
        has_distance = self.log.distance is not None
        return (
            *self.cloth,
            *NUISANCES,
            self.azimuth,
            self.elevation,
            *(() if has_distance else (DISTANCE,)),
            *((clock_error(self.log.clock),) if self.log.clock else ()),
        )

    def values(self) -> Mapping[str, FloatArray]:
        """Name → (count,), by ascending damping, so that batches can be simulated in long steps."""
        # In another order in each place: two scramblings of a Sobol sequence are correlated, row by
        # row.
        seed = child_seed(self.seed, "calibrate", "place", self.place)
        order = stream(seed, "calibrate", "order").permutation(self.count)
        placed = draws(self.quantities(), self.count, seed=seed, name="design")
        drawn = {name: values[order] for name, values in placed.items()}
        drawn |= draws(self.cloth, self.count, seed=self.seed, name="cloths")
        if self.log.distance is not None:
            drawn[DISTANCE.name] = np.full(self.count, self.log.distance)
        order = np.argsort(drawn["damping"], kind="stable")
        return {name: values[order] for name, values in drawn.items()}

    def batches(self) -> list[FlagBatch]:
        """Returns all batches in the order of `values`."""
        return [
            self.batch(np.arange(first, min(first + BATCH, self.count), dtype=np.int64))
            for first in range(0, self.count, BATCH)
        ]

    def batch(self, which: IntArray) -> FlagBatch:
        """Returns some of the simulations, by their places in `values`."""
        values = {name: drawn[which] for name, drawn in self.values().items()}
        view = [values.pop("azimuth"), values.pop("elevation"), np.full(len(which), self.distance)]
        return FlagBatch(
            flag=self.flag,
            log=self.log,
            duration=self.duration,
            values=values,
            places=np.stack(view, axis=1)[:, None],
            seeds=tuple(
                child_seed(self.seed, "calibrate", "flag", self.recording, int(number))
                for number in which
            ),
        )

    def in_longest_steps(self) -> IntArray:
        """Returns the indices of the simulations whose batch has the longest time step."""
        batches = self.batches()
        steps = [batch.step or 0.0 for batch in batches]
        sizes = [len(batch.seeds) for batch in batches]
        return np.flatnonzero(np.repeat(np.array(steps) == max(steps), sizes))


@dataclass(frozen=True, kw_only=True)
class CalibrationOptions:
    """How a flag is calibrated.

    Attributes:
        flag: its size and attachment.
        azimuth, elevation: of the camera's axis to the wind, as far as they are known.
        distance: of the camera [m].
        simulations: for each recording.
        level: of the intervals.
        seed: of all draws.
        material: what the flag is stated to be made of; None for any fabric.
    """

    flag: Flag
    azimuth: Uncertain = AZIMUTH
    elevation: Uncertain = ELEVATION
    distance: float = FAR
    simulations: int = 128
    level: float = 0.9
    seed: int = 0
    material: Fabric | None = None

    def recipe(self) -> dict[str, Any]:
        """Returns JSON values."""
        return {
            "flag_size": [self.flag.length, self.flag.height],
            "attachment": self.flag.attachment,
            "azimuth": json_values(self.azimuth.prior),
            "elevation": json_values(self.elevation.prior),
            "distance": self.distance,
            "simulations": self.simulations,
            "level": self.level,
            "seed": self.seed,
            **({} if self.material is None else {"material": self.material.name}),
        }


def designs_of(recordings: Sequence[Observed], options: CalibrationOptions) -> list[Design]:
    """Returns what is simulated for each of several recordings of one cloth.

    Raises:
        InputError: a recording that is given twice, or too short recordings in all.
    """
    check_in_all(recordings)
    names = [f"{recording.source} {recording.name} {recording.first:g}" for recording in recordings]
    twice = [
        recording.name
        for number, recording in enumerate(recordings)
        if names[number] in names[:number]
    ]
    if twice:
        raise InputError(
            f"{twice[0]} is given twice",
            where="recordings",
            fix="give each recording of the flag once",
        )
    return [
        Design(
            flag=options.flag,
            log=recording.log,
            duration=recording.duration,
            azimuth=options.azimuth,
            elevation=options.elevation,
            count=options.simulations,
            seed=options.seed,
            distance=options.distance,
            recording=name,
            place=name if recording.place is None else recording.place,
            fabric=FABRIC if options.material is None else options.material.drawn,
        )
        for recording, name in zip(recordings, names, strict=True)
    ]


def simulated_values(
    design: Design,
    *,
    folder: Path,
    workers: int = 1,
    advance: Callable[[int], object] | None = None,
) -> FloatArray:
    """Returns (simulation, window, observable) in the order of the design's values; NaN where a
    flag diverged.

    Args:
        folder: where batches are kept.
        advance: called with the seconds of flags that were simulated or found.

    Raises:
        CorruptError: a kept batch that cannot be read.
    """
    return readings_of(design.batches(), folder=folder, workers=workers, advance=advance)[:, 0]


def readings_of(
    batches: Sequence[Simulatable],
    *,
    folder: Path,
    workers: int = 1,
    advance: Callable[[int], object] | None = None,
) -> FloatArray:
    """Returns what batches read, (cloth, …) in order, of flags (flag, place, window, observable);
    those that the folder lacks are simulated. As `simulated_values`."""
    paths = simulate_missing(batches, folder=folder, workers=workers, advance=advance)
    return np.concatenate([_read(path) for path in paths])


def _read(path: Path) -> FloatArray:
    again = "delete the file: it is made anew"
    content = read_arrays(path, what="a file of kept simulations", fix=again)
    try:
        return np.asarray(content["readings"], dtype=np.float64)
    except (ValueError, KeyError, TypeError) as error:
        raise CorruptError(
            f"kept simulations cannot be read: {error}", where=str(path), fix=again
        ) from None


TOGETHER = 8
"""Flags in a batch of pairs or nulls (a design's batches have `BATCH`): eight take as long as one,
and sixteen take 2.7 times as long."""
PAIRS = 16
"""Flags with each effect, for each recording. More estimate an effect's change better and take as
many more simulations for each effect and recording."""
LONGEST_PAIRS = 120.0
"""s of all recordings together in which flags with an effect are simulated, a minute of each at
most."""
MINUTE = 60.0
FEWEST_WINDOWS = 8
_DAMPING = next(one for one in CLOTH if one.name == "damping")


def lasting(recordings: int) -> float:
    """Returns the seconds of each of so many recordings in which flags with an effect are
    simulated: a whole number of windows."""
    most = min(MINUTE, LONGEST_PAIRS / recordings)
    return WINDOW * max(FEWEST_WINDOWS, int(most / WINDOW + 1e-9))


@dataclass(frozen=True, kw_only=True, eq=False)
class Pairs:
    """Flags with one effect, each a pair of one without.

    Attributes:
        effect: which.
        indices: (pair,) among the design's simulations.
        strengths: (pair,) beyond the null value.
        batches: of them, in that order.
    """

    effect: Weighable
    indices: IntArray
    strengths: FloatArray
    batches: tuple[FlagBatch, ...]


def pairs(design: Design, effect: Weighable, *, until: float) -> Pairs:
    """Chooses the flags of a recording's design that are simulated with an effect, those of its
    longest steps.

    Args:
        until: part of the film that is simulated [s].
    """
    candidates = design.in_longest_steps()
    rng = stream(design.seed, "films", "pairs", effect.name)
    count = min(PAIRS, len(candidates))
    indices = np.sort(rng.choice(candidates, count, replace=False))
    shares = (rng.permutation(count) + rng.random(count)) / count
    strengths = effect.prior.at(shares)
    batches = []
    for begin in range(0, count, TOGETHER):
        part = indices[begin : begin + TOGETHER]
        batches.append(
            replace(
                design.batch(part),
                until=min(until, design.duration),
                effects=((effect.column, strengths[begin : begin + TOGETHER]),),
            )
        )
    return Pairs(effect=effect, indices=indices, strengths=strengths, batches=tuple(batches))


def nulls(
    designs: Sequence[Design], places: Sequence[int], *, kinds: int, seed: int
) -> list[list[FlagBatch]]:
    """Designs null experiments: for each recording a batch a kind of numerics, of `TOGETHER` cloths
    each. A cloth is the same in all recordings, its place and anemometer are not.

    Args:
        places: for each recording the first one of its place.
    """
    count = kinds * TOGETHER
    cloths = draws(designs[0].cloth, count, seed=seed, name="null cloths")
    experiments = []
    for number, design in zip(places, designs, strict=True):
        drawn = {
            quantity.name: quantity.at(
                stream(seed, "films", "null places", number, quantity.name).random(count)
            )
            for quantity in design.quantities()
        }
        drawn |= cloths
        if design.log.distance is not None:
            drawn["distance_constant"] = np.full(count, design.log.distance)
        views = np.stack(
            [drawn["azimuth"], drawn["elevation"], np.full(count, design.distance)], axis=1
        )
        first = design.batches()[0]
        batches = []
        for kind in range(kinds):
            part = np.arange(kind * TOGETHER, (kind + 1) * TOGETHER)
            numerics = Discretisation.drawn(stream(seed, "films", "kind", kind), explicit=_little())
            values = {name: drawn[name][part] for name in first.values}
            values["damping"] = _damping(values["damping"], explicit=numerics.step is None)
            batches.append(
                replace(
                    first,
                    values=values,
                    places=views[part][:, None],
                    discretisation=numerics,
                    seeds=tuple(
                        child_seed(seed, "films", "null", design.recording, int(member))
                        for member in part
                    ),
                )
            )
        experiments.append(batches)
    return experiments


def _little() -> float:
    """Returns the share of the cloths that damp less than what leapfrog is for."""
    low, high = _DAMPING.at(np.array([0.0, 1.0])).tolist()
    return math.log(max(LITTLE / low, 1.0)) / math.log(high / low)


def _damping(drawn: FloatArray, *, explicit: bool) -> FloatArray:
    """Dampings of the prior as those of the part below `LITTLE`, or of the part above it [s]."""
    low, high = _DAMPING.at(np.array([0.0, 1.0])).tolist()
    shares, edge = np.log(drawn / low) / math.log(high / low), _little()
    return _DAMPING.at(shares * edge if explicit else edge + shares * (1 - edge))


_PACE = 25.0
"""Seconds of one flag that one core simulates in a second: 128 flags for two minutes took some ten
minutes."""


def announce_simulations(flag_seconds: float, *, workers: int) -> str:
    """Returns what is to be simulated, and for about how long.

    Args:
        flag_seconds: simulated seconds of all flags together.
        workers: processes that share them.
    """
    return workload.announce_work(
        f"simulating flags for {flag_seconds / 60:.0f} minutes in all",
        flag_seconds / _PACE,
        workers=workers,
        kept="what was simulated before is kept and taken up",
    )
