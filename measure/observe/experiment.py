"""From recordings as they came to an experiment: put in order, checked, on one model mesh."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from flagdata.errors import InputError
from flagdata.findings import Finding, Severity
from measure.observe import cloth, noise
from measure.observe.anchors import anchors_of, carried
from measure.observe.checks import attachment, frames, inertia, shape, surroundings
from measure.observe.common import at_same_points, at_same_rate
from measure.observe.gaps import fill_positions
from measure.observe.observation import Known, Observation
from measure.observe.pins import hold
from measure.observe.setup import Hold, Setup
from measure.observe.trajectory import Experiment, Floats, Specimen, Trajectory
from sim.air import QuadraticNormal
from sim.handles import ARCSIM_STIFFNESS
from sim.material import Material
from sim.scene import GRAVITY


@dataclass(frozen=True, kw_only=True, eq=False)
class Observed:
    """An experiment and what was found on the way to it."""

    experiment: Experiment
    findings: tuple[Finding, ...]


def observe(observations: Sequence[Observation], setup: Setup | None = None) -> Observed:
    """The experiment that these recordings of one cloth make.

    Raises:
        InputError: recordings that cannot be used, with the reason and what to do.
    """
    setup = setup or Setup()
    if not observations:
        raise InputError("no recordings", where="experiment", fix="give at least one")
    corners, found = _outline(observations, setup)
    low = corners.min(axis=0)
    mesh = cloth.model_mesh(corners - low, vertices=setup.vertices)
    prepared = [_prepared(seen, corners) for seen in observations]
    at_rate, resampled = at_same_rate([_trajectory(seen, low) for seen in prepared])
    recordings, moved = at_same_points(at_rate, mesh.rest)
    known = [seen.known for seen in prepared]
    mesh, held = hold(mesh, _pins(known, setup, low))
    seats = mesh.rest[list(held)]
    if setup.carried:
        recordings = tuple(carried(recording, seats) for recording in recordings)
    specimen = Specimen(
        mesh=mesh,
        material=_material(known, setup),
        mass_known=setup.mass_known,
        density_uncertainty=setup.density_uncertainty,
        held=held,
        anchors=anchors_of(recordings, seats),
        anchors_given=False,
        stiffness=_stiffness(known, setup),
        gravity=(
            _agreed([k.gravity for k in known], None, GRAVITY, "gravity")
            if setup.gravity is None
            else (0.0, 0.0, -setup.gravity)
        ),
        air=_agreed([k.air for k in known], setup.air, QuadraticNormal(), "wind force"),
    )
    experiment = Experiment(specimen=specimen, recordings=recordings)
    found = (*found, *(f for seen in prepared for f in seen.findings), *resampled, *moved, *_checked(experiment))
    return Observed(experiment=experiment, findings=found)


def _prepared(seen: Observation, corners: Floats) -> Observation:
    """A recording with even frames and no gaps, its noise settled, its lengths those of the rest shape.

    Wrong values become NaN and are reported; then all NaN are filled or left out together.

    Raises:
        InputError: it cannot be used.
    """
    where = f"recording {seen.name!r}"
    if not np.isfinite(seen.positions).all(axis=2).any():
        raise InputError("no marker was tracked in any frame", where=where, fix="check the columns of the positions")
    seen = frames.even(seen)
    edges = shape.Edges.between(seen.markers, where=where)
    seen = frames.without_stuck_markers(seen)
    sigma = _noise(seen)
    scaled = shape.check_scale(seen, edges, sigma)
    seen = frames.without_repeats(shape.without_strays(seen, edges, sigma), sigma)
    period = float(seen.times[1] - seen.times[0])
    filled = fill_positions(seen.positions, seen.markers, period=period, where=where)
    begin = float(seen.times[filled.frames.start])
    markers = seen.markers[filled.markers]
    if len(markers) < shape.FEWEST:
        raise InputError(
            f"{len(markers)} of {len(seen.markers)} markers are left", where=where, fix="track more of them"
        )
    times = seen.times[filled.frames]
    if len(times) < frames.FEWEST or times[-1] - times[0] < frames.SHORTEST * (1 - 1e-9):
        raise InputError(
            f"{len(times)} frames are left in which enough markers are tracked", where=where, fix="track more of them"
        )
    wind = seen.wind or seen.known.wind
    seen = replace(
        seen,
        markers=markers,
        positions=filled.positions,
        times=times - begin,
        seen=filled.seen,
        wind=None if wind is None else wind.later(begin),
        findings=(
            *seen.findings,
            *scaled,
            *filled.findings,
            *shape.check_cover(markers, corners, where=where),
            *frames.lost_frames(filled.positions, where=where),
        ),
    )
    # What is filled in is smoother than what was tracked, and would make the noise look smaller.
    seen = replace(seen, noise=sigma if filled.seen is not None or not filled.findings else _noise(seen))
    frames.check_motion(filled.positions, seen.noise or 0.0, float(np.ptp(corners, axis=0).max()), where=where)
    return seen


def _noise(seen: Observation) -> float:
    if seen.noise is not None:
        return seen.noise
    return noise.estimate(seen.markers, seen.positions, where=f"recording {seen.name!r}")


def _checked(experiment: Experiment) -> tuple[Finding, ...]:
    """Findings on the cloth, its pins and its wind. Whether pins stand still, and whether the motion about them is that
    of the wind's moment, is not asked where they are carried.

    Raises:
        InputError: pins, wind, axes or rate that cannot be those of the recording.
    """
    specimen = experiment.specimen
    found: list[Finding] = []
    for recording in experiment.recordings:
        surroundings.check_overlap(recording)
        if not experiment.carried:
            found += attachment.check_pins(recording, specimen)
            found += attachment.beside_pins(recording, specimen)
        surroundings.check_up(recording, specimen)
        found += surroundings.check_direction(recording, specimen)
        found += surroundings.check_sides(recording)
        surroundings.check_accelerations(recording, specimen)
        found += surroundings.check_strength(recording, specimen)
        if specimen.mass_known and not experiment.carried:
            found += inertia.check_inertia(recording, specimen)
    if not experiment.carried:
        attachment.check_places(experiment.recordings, specimen)
    return tuple(found)


def _stiffness(known: Sequence[Known], setup: Setup) -> float:
    """Stiffness of the pins [N/m]; those that are carried hold rigidly."""
    if setup.carried:
        return math.inf
    return _agreed([k.stiffness for k in known], setup.stiffness, ARCSIM_STIFFNESS, "stiffness of the pins")


def _outline(observations: Sequence[Observation], setup: Setup) -> tuple[Floats, tuple[Finding, ...]]:
    """The cloth's, as given, as the meshes have it, or as far as the markers reach."""
    if setup.outline is not None:
        corners = np.asarray(setup.outline, dtype=np.float64)
    elif (known := next((seen.outline for seen in observations if seen.outline is not None), None)) is not None:
        corners = known
    else:
        markers = np.concatenate([seen.markers for seen in observations])
        edge = cloth.hull(markers, where="cloth")
        size = np.ptp(edge, axis=0)
        found = Finding(
            kind="cloth-assumed-to-end-at-markers",
            severity=Severity.WARNING,
            where="cloth",
            what=f"the size of the cloth is not given; it is taken to be {size[0]:.4g} m × {size[1]:.4g} m, as far "
            "as the markers reach",
            fix="give its width and height, or its rest mesh",
        )
        return edge, (found,)
    return (corners if cloth.area(corners) > 0 else corners[::-1]), ()


def _trajectory(seen: Observation, low: Floats) -> Trajectory:
    where = f"recording {seen.name!r}"
    if seen.wind is None:
        raise InputError("no wind is known", where=where, fix="give its velocity, or an anemometer's log (--wind)")
    # Rounded, so that recordings of one rate and of different lengths have the same one to the last bit.
    rate = float(f"{(len(seen.times) - 1) / float(seen.times[-1] - seen.times[0]):.9g}")
    return Trajectory(
        name=seen.name,
        markers=seen.markers - low,
        positions=seen.positions,
        rate=rate,
        wind=seen.wind,
        noise=_noise(seen),
        source=seen.source,
        seen=seen.seen,
    )


def _material(known: Sequence[Known], setup: Setup) -> Material:
    if setup.material is not None:
        return setup.material
    given = [k.material for k in known if k.material is not None]
    if not given:
        raise InputError(
            "the material is not known, or not one of the catalog",
            where="cloth",
            fix="name one of the catalog (--material), or a file in a recipe ([material] file)",
        )
    first = given[0]
    for other in given[1:]:
        same = (first.density, first.damping) == (other.density, other.damping)
        tables = ((first.stretching, other.stretching), (first.bending, other.bending))
        if not same or not all(np.array_equal(a, b) for a, b in tables):
            raise InputError(
                f"recordings of two materials, {first.name!r} and {other.name!r}",
                where="cloth",
                fix="take recordings of one cloth, or say by the setup which material it is",
            )
    return first


def _pins(known: Sequence[Known], setup: Setup, low: Floats) -> Hold | Floats:
    """(pin, 2) in the mesh's coordinates, or a name."""
    if isinstance(setup.pins, Hold):
        return setup.pins
    if setup.pins is not None:
        return np.array(setup.pins, dtype=np.float64) - low
    given = [k.pins for k in known if k.pins is not None]
    if not given:
        raise InputError(
            "where the cloth is held is not known",
            where="cloth",
            fix=f"name its pins (--pins): {', '.join(Hold)}, or their rest coordinates",
        )
    for other in given[1:]:
        if other.shape != given[0].shape or not np.allclose(other, given[0]):
            raise InputError(
                "recordings whose cloth is held differently", where="cloth", fix="take those with the same pins"
            )
    return given[0] - low


T = TypeVar("T")


def _agreed(known: Sequence[T | None], given: T | None, default: T, what: str) -> T:
    """What the user gives, else what the recordings' descriptions agree on, else the default."""
    if given is not None:
        return given
    said = [value for value in known if value is not None]
    if any(value != said[0] for value in said[1:]):
        raise InputError(
            f"recordings of different {what}: {', '.join(map(repr, said))}",
            where="experiment",
            fix="take recordings of one set-up, or say by the setup which it is",
        )
    return said[0] if said else default
