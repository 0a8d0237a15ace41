"""From recordings as they came to an experiment: put in order, checked, on one model mesh.

Where the model mesh is held: the vertices of a named attachment, or one vertex at each given point.

Marker noise, estimated from what no smooth motion of a cloth does.

A high difference in time leaves little of a motion that is well sampled, a marker's departure from
the polynomial through its neighbours little of a shape that is. Of noise that is independent from
marker to marker and from frame to frame both leave a known multiple, so their product does. Each
pair of orders gives an estimate, which is that of the noise plus what is left of the motion; the
smallest is taken. The same noise is supposed at all markers, so those that move least (near the
pins) say most: of the markers' variances the lower decile is taken, over that decile of a χ².

Noise that neighbours or frames share (a camera that shakes, a smoothing tracker) is not counted as
noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from scipy.spatial import KDTree
from scipy.stats import chi2

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.core.findings import Finding
from flagdata.errors import InputError
from measure.trajectories import cloth_mesh
from measure.trajectories.attachment_anchors import anchors_of, carry_attachments
from measure.trajectories.checks import (
    attachment,
    cloth_lengths,
    frames,
    inertia_check,
    surroundings,
)
from measure.trajectories.common import at_same_points, at_same_rate
from measure.trajectories.gaps import fill_positions
from measure.trajectories.observation import Known, Observation
from measure.trajectories.setup import Hold, Setup
from measure.trajectories.trajectory import Experiment, Specimen, Trajectory
from sim.cloth import handles
from sim.cloth.air import QuadraticNormal
from sim.cloth.handles import ARCSIM_STIFFNESS
from sim.cloth.material import Material
from sim.cloth.mesh import Mesh
from sim.cloth.scene import GRAVITY

_TIME_ORDERS = (2, 4, 6, 8, 10, 12)
_DEGREES = (0, 1, 2, 3, 4)  # of the polynomial in (u, v); 0 stands for the marker itself
_SPARE = 1.5  # neighbours for each coefficient of the polynomial
_LEAST = 30  # values that a marker's mean square needs, or all there are
_ENOUGH = 50_000  # positions are looked at, about; of more, every so many-th marker
_SHARE = 0.1  # of the markers, those that move least


@dataclass(frozen=True, kw_only=True)
class Stencils:
    """How far each marker is from the polynomial through its neighbours.

    Attributes:
        neighbours: (marker, k), the marker itself first.
        weights: (marker, k) with unit sum of squares, so that unit noise leaves unit noise.
    """

    neighbours: IntArray
    weights: FloatArray

    def of(self, values: FloatArray, step: int = 1) -> FloatArray:
        """Computes departures of every `step`-th marker, (frame, …, 3), from values (frame, marker,
        3); NaN where one is NaN."""
        weights, neighbours = self.weights[::step], self.neighbours[::step]
        departure = np.zeros((len(values), len(neighbours), 3))
        for column in range(neighbours.shape[1]):
            departure += weights[:, column, None] * values[:, neighbours[:, column]]
        return departure


def estimate(markers: FloatArray, positions: FloatArray, *, where: str) -> float:
    """Estimates the standard deviation of a coordinate's noise [m].

    Within 10 % for white noise on a motion that is smooth on the scale of the frames or of the
    markers; too large where it is smooth on neither.

    Args:
        markers: (marker, 2) rest coordinates [m].
        positions: (frame, marker, 3) [m]; NaN where not tracked.

    Raises:
        InputError: too few frames or tracked markers for any estimate.
    """
    smallest = math.inf
    step = max(1, round(positions.shape[0] * positions.shape[1] / _ENOUGH))
    for degree in _DEGREES:
        fits = stencils(markers, degree)
        if fits is None:
            break
        departure, before = fits.of(positions, step), 0
        for order in _TIME_ORDERS:
            if len(departure) <= order - before:
                break
            departure, before = np.diff(departure, n=order - before, axis=0), order
            smallest = min(smallest, _quietest(departure, order))
    if not math.isfinite(smallest):
        raise InputError(
            "too few values to estimate the noise from",
            where=where,
            fix="give the standard deviation of a coordinate",
        )
    return smallest


def stencils(markers: FloatArray, degree: int) -> Stencils | None:
    """Computes departures from polynomials of a degree fitted to the nearest neighbours; None where
    there are too few of them.

    Args:
        markers: (marker, 2) [m].
        degree: 0 for the values themselves.
    """
    count = len(markers)
    if degree == 0:
        return Stencils(neighbours=np.arange(count)[:, None], weights=np.ones((count, 1)))
    terms = (degree + 1) * (degree + 2) // 2
    neighbour_count = math.ceil(_SPARE * terms) + 1
    if count < neighbour_count:
        return None
    neighbours = np.asarray(KDTree(markers).query(markers, k=neighbour_count)[1], dtype=np.int64)
    arms = markers[neighbours] - markers[:, None]
    arms = arms / np.abs(arms).max(axis=(1, 2), keepdims=True)
    powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    basis = np.stack([arms[..., 0] ** i * arms[..., 1] ** j for i, j in powers], axis=-1)
    # The fit to the neighbours alone, at the marker: the constant term.
    fit = np.linalg.pinv(basis[:, 1:], rcond=1e-6)[:, 0]
    weights = np.concatenate([np.ones((count, 1)), -fit], axis=1)
    return Stencils(
        neighbours=neighbours, weights=weights / np.linalg.norm(weights, axis=1, keepdims=True)
    )


def _quietest(values: FloatArray, order: int) -> float:
    """Estimates the standard deviation at the markers that move least, from differences (frame,
    marker, 3) of an order in time; infinite where too few values are finite."""
    square = (values * values).sum(axis=2) / 3
    finite = np.isfinite(square)
    frames = finite.sum(axis=0)
    enough = 3 * frames >= min(_LEAST, 3 * len(square))
    if not enough.any():
        return math.inf
    means = np.where(finite, square, 0.0).sum(axis=0)[enough] / frames[enough]
    # Differences of white noise are correlated, ρ_k = C(2d, d+k)/C(2d, d); Σ ρ_k² = C(4d, 2d)/C(2d,
    # d)² of them count as one.
    together = math.comb(4 * order, 2 * order) / math.comb(2 * order, order) ** 2
    scale = math.comb(2 * order, order)  # variance of the difference of unit white noise
    free = max(1.0, 3 * float(np.median(frames[enough])) / together)
    return math.sqrt(
        float(np.quantile(means, _SHARE)) / (scale * float(chi2.ppf(_SHARE, free)) / free)
    )


_NAMED = {
    Hold.HOIST_CORNERS: handles.corners,
    Hold.TOP_CORNERS: handles.top_corners,
    Hold.HOIST: handles.full_hoist,
}
_AROUND, _CLOCKS = 5.0, 5.0
"""Time [s], and standard deviations of a log's clock, by which its wind is kept before and behind
the recording: means over more would say nothing of the wind at the cloth."""
_NEAR = 1e-6
"""Share of the cloth's size: what is nearer than this is in one place."""


def hold(mesh: Mesh, pins: Hold | FloatArray) -> tuple[Mesh, tuple[int, ...]]:
    """Moves a vertex of the mesh to each pin; returns the mesh and those vertices.

    Args:
        pins: a named attachment, or (pin, 2) in the mesh's coordinates [m]. Where no vertex is at a
            pin, the nearest is moved there: one of the edge to a pin on the edge, an inner one to a
            pin within, never a corner.

    Raises:
        InputError: a pin that is not on the cloth, or two in one place.
    """
    if isinstance(pins, Hold):
        return mesh, tuple(int(vertex) for vertex in _NAMED[pins](mesh.rest))
    rest, tolerance = mesh.rest.copy(), _NEAR * float(np.ptp(mesh.rest, axis=0).max())
    corners = cloth_mesh.outline(mesh.rest, mesh.faces, where="model mesh")
    sharp = corners[cloth_mesh.sharp_corners(corners)]
    fixed = (np.hypot(*(rest[:, None] - sharp).transpose(2, 0, 1)) <= tolerance).any(axis=1)
    edge = np.zeros(len(rest), dtype=bool)
    edge[mesh.boundary] = True
    vertices: list[int] = []
    for pin in pins:
        where = f"pin (u, v) = ({pin[0]:.4g}, {pin[1]:.4g}) m from the cloth's lower left"
        away = np.hypot(*(rest - pin).T)
        vertex = int(away.argmin())
        if away[vertex] > tolerance:
            at_edge = cloth_mesh.distance_to(corners, pin) <= tolerance
            if not at_edge and not cloth_mesh.inside(corners, pin[None])[0]:
                raise InputError(
                    "it is not on the cloth",
                    where=where,
                    fix="give pins in the coordinates of the markers, in metres",
                )
            free = (edge == at_edge) & ~fixed
            free[vertices] = False
            if not free.any():
                raise InputError(
                    "no vertex of the model mesh is free for it",
                    where=where,
                    fix="ask for more vertices",
                )
            vertex = int(np.where(free, away, np.inf).argmin())
            rest[vertex] = pin
        if vertex in vertices:
            raise InputError(
                "two pins are at the same point", where=where, fix="give each pin once"
            )
        vertices.append(vertex)
    return Mesh(rest=rest, faces=mesh.faces), tuple(vertices)


@dataclass(frozen=True, kw_only=True, eq=False)
class Observed:
    """An experiment and what was found on the way to it."""

    experiment: Experiment
    findings: tuple[Finding, ...]


def observe(observations: Sequence[Observation], setup: Setup | None = None) -> Observed:
    """Makes the experiment of these recordings of one cloth.

    Raises:
        InputError: recordings that cannot be used, with the reason and what to do.
    """
    setup = setup or Setup()
    if not observations:
        raise InputError("there are no recordings", where="experiment", fix="give at least one")
    corners, findings = _outline(observations, setup)
    low = corners.min(axis=0)
    mesh = cloth_mesh.model_mesh(corners - low, vertices=setup.vertices)
    prepared = [_prepare_recording(observation, corners) for observation in observations]
    at_rate, resampled = at_same_rate([_trajectory(observation, low) for observation in prepared])
    recordings, moved = at_same_points(at_rate, mesh.rest)
    descriptions = [observation.known for observation in prepared]
    mesh, vertices = hold(mesh, _pins(descriptions, setup, low))
    seats = mesh.rest[list(vertices)]
    if setup.carried:
        recordings = tuple(carry_attachments(recording, seats) for recording in recordings)
    specimen = Specimen(
        mesh=mesh,
        material=_material(descriptions, setup),
        area_weight_uncertainty=setup.relative,
        held=vertices,
        anchors=anchors_of(recordings, seats),
        anchors_given=False,
        stiffness=_stiffness(descriptions, setup),
        gravity=(
            _agreed_value([k.gravity for k in descriptions], None, GRAVITY, "gravity")
            if setup.gravity is None
            else (0.0, 0.0, -setup.gravity)
        ),
        air=_agreed_value(
            [k.air for k in descriptions], setup.air, QuadraticNormal(), "wind force"
        ),
    )
    experiment = Experiment(specimen=specimen, recordings=recordings)
    findings = (
        *findings,
        *(f for observation in prepared for f in observation.findings),
        *resampled,
        *moved,
        *_check_experiment(experiment),
    )
    return Observed(experiment=experiment, findings=findings)


def _prepare_recording(observation: Observation, corners: FloatArray) -> Observation:
    """Prepares a recording with even frames and no gaps, its noise settled, its lengths those of
    the rest shape.

    Wrong values become NaN and are reported; then all NaN are filled or left out together.

    Raises:
        InputError: it cannot be used.
    """
    where = f"recording {observation.name!r}"
    if not np.isfinite(observation.positions).all(axis=2).any():
        raise InputError(
            "no marker was tracked in any frame",
            where=where,
            fix="check the columns of the positions",
        )
    observation = frames.even(observation)
    edges = cloth_lengths.Edges.between(observation.markers, where=where)
    observation = frames.without_stuck_markers(observation)
    sigma = _noise(observation)
    scaled = cloth_lengths.check_scale(observation, edges, sigma)
    observation = frames.without_repeats(
        cloth_lengths.without_strays(observation, edges, sigma), sigma
    )
    period = float(observation.times[1] - observation.times[0])
    filled = fill_positions(observation.positions, observation.markers, period=period, where=where)
    begin = float(observation.times[filled.frames.start])
    markers = observation.markers[filled.markers]
    if len(markers) < cloth_lengths.FEWEST:
        raise InputError(
            f"{len(markers)} of {len(observation.markers)} markers are left",
            where=where,
            fix="track more of them",
        )
    times = observation.times[filled.frames]
    if len(times) < frames.FEWEST or times[-1] - times[0] < frames.SHORTEST * (1 - 1e-9):
        raise InputError(
            f"{len(times)} frames are left in which enough markers are tracked",
            where=where,
            fix="track more of them",
        )
    wind = observation.wind or observation.known.wind
    observation = replace(
        observation,
        markers=markers,
        positions=filled.positions,
        times=times - begin,
        seen=filled.seen,
        wind=None if wind is None else wind.later(begin),
        findings=(
            *observation.findings,
            *scaled,
            *filled.findings,
            *cloth_lengths.check_cover(markers, corners, where=where),
            *frames.lost_frames(filled.positions, where=where),
        ),
    )
    # What is filled in is smoother than what was tracked, and would make the noise look smaller.
    observation = replace(
        observation,
        noise=sigma if filled.seen is not None or not filled.findings else _noise(observation),
    )
    frames.check_motion(
        filled.positions,
        observation.noise or 0.0,
        float(np.ptp(corners, axis=0).max()),
        where=where,
    )
    return observation


def _noise(observation: Observation) -> float:
    if observation.noise is not None:
        return observation.noise
    return estimate(
        observation.markers, observation.positions, where=f"recording {observation.name!r}"
    )


def _check_experiment(experiment: Experiment) -> tuple[Finding, ...]:
    """Checks the cloth, its pins and its wind. Whether pins stand still, and whether the motion
    about them is that of the wind's moment, is not asked where they are carried.

    Raises:
        InputError: pins, wind, axes or rate that cannot be those of the recording.
    """
    specimen = experiment.specimen
    findings: list[Finding] = []
    for recording in experiment.recordings:
        surroundings.check_overlap(recording)
        if not experiment.carried:
            findings += attachment.check_pins(recording, specimen)
            findings += attachment.beside_pins(recording, specimen)
        surroundings.check_up(recording, specimen)
        findings += surroundings.check_direction(recording, specimen)
        findings += surroundings.check_sides(recording)
        surroundings.check_accelerations(recording, specimen)
        findings += surroundings.check_strength(recording, specimen)
        if specimen.area_weight_uncertainty is not None and not experiment.carried:
            findings += inertia_check.check_inertia(recording, specimen)
    if not experiment.carried:
        attachment.check_places(experiment.recordings, specimen)
    return tuple(findings)


def _stiffness(descriptions: Sequence[Known], setup: Setup) -> float:
    """Chooses the stiffness of the pins [N/m]; those that are carried hold rigidly."""
    if setup.carried:
        return math.inf
    return _agreed_value(
        [k.stiffness for k in descriptions],
        setup.stiffness,
        ARCSIM_STIFFNESS,
        "stiffness of the pins",
    )


def _outline(
    observations: Sequence[Observation], setup: Setup
) -> tuple[FloatArray, tuple[Finding, ...]]:
    """Finds the cloth's outline, as the set-up states it, as the meshes have it, or as far as the
    markers reach."""
    if setup.outline is not None:
        corners = np.asarray(setup.outline, dtype=np.float64)
    elif (
        outline := next(
            (
                observation.outline
                for observation in observations
                if observation.outline is not None
            ),
            None,
        )
    ) is not None:
        corners = outline
    else:
        markers = np.concatenate([observation.markers for observation in observations])
        edge = cloth_mesh.hull(markers, where="cloth")
        size = np.ptp(edge, axis=0)
        finding = Finding.of(
            "cloth-assumed-to-end-at-markers",
            f"the size of the cloth is not given; it is taken to be {size[0]:.4g} m × "
            f"{size[1]:.4g} m, as far "
            "as the markers reach",
            where="cloth",
            fix="give its width and height, or its rest mesh",
        )
        return edge, (finding,)
    return (corners if cloth_mesh.area(corners) > 0 else corners[::-1]), ()


def _trajectory(observation: Observation, low: FloatArray) -> Trajectory:
    where = f"recording {observation.name!r}"
    if observation.wind is None:
        raise InputError(
            "no wind is known",
            where=where,
            fix="give its velocity, or an anemometer's log (--wind)",
        )
    # Rounded, so that recordings of one rate and of different lengths have the same one to the last
    # bit.
    duration = float(observation.times[-1] - observation.times[0])
    rate = float(f"{(len(observation.times) - 1) / duration:.9g}")
    reach = _AROUND + _CLOCKS * observation.wind.clock
    return Trajectory(
        name=observation.name,
        markers=observation.markers - low,
        positions=observation.positions,
        rate=rate,
        wind=observation.wind.between(-reach, duration + reach),
        noise=_noise(observation),
        source=observation.source,
        seen=observation.seen,
        session=observation.session,
    )


def _material(descriptions: Sequence[Known], setup: Setup) -> Material:
    material = _nominal(descriptions, setup)
    stated = setup.area_weight
    return material if stated is None else replace(material, area_weight=stated.middle)


def _nominal(descriptions: Sequence[Known], setup: Setup) -> Material:
    if setup.material is not None:
        return setup.material
    materials = [k.material for k in descriptions if k.material is not None]
    if not materials:
        raise InputError(
            "the material is not known, or not one of the catalog",
            where="cloth",
            fix="name one of the catalog (--material), or a file in a recipe ([material] file)",
        )
    first = materials[0]
    for material in materials[1:]:
        same = (first.area_weight, first.damping) == (material.area_weight, material.damping)
        tables = ((first.stretching, material.stretching), (first.bending, material.bending))
        if not same or not all(np.array_equal(a, b) for a, b in tables):
            raise InputError(
                f"the recordings are of two materials, {first.name!r} and {material.name!r}",
                where="cloth",
                fix="take recordings of one cloth, or say by the setup which material it is",
            )
    return first


def _pins(descriptions: Sequence[Known], setup: Setup, low: FloatArray) -> Hold | FloatArray:
    """Returns (pin, 2) in the mesh's coordinates, or a name."""
    if isinstance(setup.pins, Hold):
        return setup.pins
    if setup.pins is not None:
        return np.array(setup.pins, dtype=np.float64) - low
    pins = [k.pins for k in descriptions if k.pins is not None]
    if not pins:
        raise InputError(
            "where the cloth is held is not known",
            where="cloth",
            fix=f"say how it is held (--attachment): {', '.join(Hold)}, or their rest coordinates",
        )
    for points in pins[1:]:
        if points.shape != pins[0].shape or not np.allclose(points, pins[0]):
            raise InputError(
                "the recordings' cloth is held differently",
                where="cloth",
                fix="take those with the same pins",
            )
    return pins[0] - low


T = TypeVar("T")


def _agreed_value(
    descriptions: Sequence[T | None], chosen: T | None, default: T, quantity: str
) -> T:
    """Returns what the user gives, else what the recordings' descriptions agree on, else the
    default."""
    if chosen is not None:
        return chosen
    values = [value for value in descriptions if value is not None]
    if any(value != values[0] for value in values[1:]):
        raise InputError(
            f"the recordings differ in {quantity}: {', '.join(map(repr, values))}",
            where="experiment",
            fix="take recordings of one set-up, or say by the setup which it is",
        )
    return values[0] if values else default
