"""Closing the loop from Python: `flagdata.close_loop`, with recordings as arrays."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from flagdata.answer.closed import Closed
from flagdata.api.measuring_verbs import Closing
from flagdata.core.stated import Stated
from flagdata.errors import InputError, UnknownNameError, UsageError
from flagdata.lake.mesh_sequences import MeshSequence
from measure.closing.close import close_loop
from measure.closing.verdict_findings import check_findings, with_warnings
from measure.loop.run import LoopOptions
from measure.nulls.null_plan import FEWEST_NULLS
from measure.report.verdict_answer import answer_of_markers
from measure.trajectories import Hold, Observation, Setup, WindTrack, from_arrays, observe, sheet
from measure.trajectories.mesh_observations import from_sequence
from measure.verdict.criteria import CRITERIA
from sim.cloth.material import MATERIALS, named_material

Recordings: TypeAlias = ArrayLike | MeshSequence | Sequence[ArrayLike | MeshSequence]


def close_on_arrays(chosen: Closing) -> Closed:
    """Closes the loop on arrays; see `flagdata.close_loop`.

    Raises:
        FlagdataError: see `flagdata.close_loop`.
    """
    options = LoopOptions(
        seed=chosen.seed,
        workers=chosen.workers,
        level=CRITERIA.level if chosen.level is None else chosen.level,
        nulls=FEWEST_NULLS if chosen.nulls is None else chosen.nulls,
    )
    observed = observe(_tracked_observations(chosen), _setup(chosen))
    verdict = with_warnings(
        close_loop(observed.experiment, options), check_findings(observed.findings)
    )
    return answer_of_markers(verdict, experiment=observed.experiment)


def _setup(chosen: Closing) -> Setup:
    if chosen.material not in MATERIALS.names():
        raise UnknownNameError.of("material", chosen.material, MATERIALS.names(), where="material")
    names, attachment = ["corners", *(hold.value for hold in Hold)], chosen.attachment
    if isinstance(attachment, str) and attachment not in names:
        raise UnknownNameError.of("attachment", attachment, names, where="attachment")
    setup = Setup(
        material=named_material(chosen.material),
        pins=Hold(attachment)
        if isinstance(attachment, str)
        else tuple((float(u), float(v)) for u, v in attachment),
        outline=None if chosen.flag_size is None else sheet(*chosen.flag_size),
    )
    weight = None if chosen.area_weight is None else Stated.of(chosen.area_weight)
    return setup.state_weight(weight, chosen.density_uncertainty)


def _tracked_observations(chosen: Closing) -> list[Observation]:
    """Makes one observation of each recording, with the wind beside it."""
    several, wind = _several(chosen.recordings), chosen.wind
    winds = wind if isinstance(wind, list) else [wind] * len(several)
    if len(winds) != len(several):
        raise UsageError(
            f"there are {len(winds)} winds for {len(several)} recordings",
            where="wind",
            fix="give one, or a list with one for each recording",
        )
    return [
        _observation(recording, chosen, name=f"recording {number}", wind=_track(its_wind))
        for number, (recording, its_wind) in enumerate(zip(several, winds, strict=True), start=1)
    ]


def _several(recordings: Recordings) -> list[ArrayLike | MeshSequence]:
    if isinstance(recordings, MeshSequence) or (
        isinstance(recordings, np.ndarray) and recordings.ndim == 3
    ):
        return [recordings]
    return list(recordings)  # type: ignore[arg-type]


def _observation(
    recording: ArrayLike | MeshSequence, chosen: Closing, *, name: str, wind: WindTrack
) -> Observation:
    if isinstance(recording, MeshSequence):
        return replace(from_sequence(recording, name=name), wind=wind, noise=chosen.noise)
    if chosen.rest is None or chosen.rate is None:
        raise UsageError(
            "the positions have no rest coordinates or no rate",
            where=name,
            fix="give rest= and rate=",
        )
    positions, places = (
        np.asarray(values, dtype=np.float64) for values in (recording, chosen.rest)
    )
    return from_arrays(
        name=name, positions=positions, rest=places, rate=chosen.rate, wind=wind, noise=chosen.noise
    )


def _track(wind: Any) -> WindTrack:
    """Makes a track of a speed along +x, a velocity, or times and velocities."""
    if isinstance(wind, tuple) and len(wind) == 2:
        times, velocity = (np.asarray(part, dtype=np.float64) for part in wind)
        return WindTrack(times=times, velocity=velocity)
    velocity = np.atleast_1d(np.asarray(wind, dtype=np.float64))
    if velocity.shape == (1,):
        velocity = np.array([velocity[0], 0.0, 0.0])
    if velocity.shape != (3,) or not math.isfinite(float(velocity.sum())):
        raise InputError(
            f"the wind has the shape {velocity.shape}",
            where="wind",
            fix="give a speed, a velocity (x, y, z), or times (n,) and velocities (n, 3)",
        )
    return WindTrack(times=np.zeros(1), velocity=velocity[None])
