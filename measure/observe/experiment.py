"""From recordings as they came to an experiment: put in order, checked, on one model mesh.

Where the model mesh is held: the vertices of a named attachment, or one vertex at each given point.

Marker noise, estimated from what no smooth motion of a cloth does.

A high difference in time leaves little of a motion that is well sampled, a marker's departure from the polynomial
through its neighbours little of a shape that is. Of noise that is independent from marker to marker and from frame to
frame both leave a known multiple, so their product does. Each pair of orders gives an estimate, which is that of the
noise plus what is left of the motion; the smallest is taken. The same noise is supposed at all markers, so those that
move least (near the pins) say most: of the markers' variances the lower decile is taken, over that decile of a χ².

Noise that neighbours or frames share (a camera that shakes, a smoothing tracker) is not counted as noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.stats import chi2

from flagdata.errors import InputError
from flagdata.findings import Finding
from measure.observe import cloth
from measure.observe.anchors import anchors_of, carried
from measure.observe.checks import attachment, frames, inertia, shape, surroundings
from measure.observe.common import at_same_points, at_same_rate
from measure.observe.gaps import fill_positions
from measure.observe.observation import Known, Observation
from measure.observe.setup import Hold, Setup
from measure.observe.trajectory import Experiment, Floats, Specimen, Trajectory
from sim import handles
from sim.air import QuadraticNormal
from sim.handles import ARCSIM_STIFFNESS
from sim.material import Material
from sim.mesh import Mesh
from sim.scene import GRAVITY

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

    neighbours: NDArray[np.int64]
    weights: NDArray[np.float64]

    def of(self, values: NDArray[np.float64], step: int = 1) -> NDArray[np.float64]:
        """(frame, …, 3) departures of every `step`-th marker, from values (frame, marker, 3); NaN where one is NaN."""
        weights, neighbours = self.weights[::step], self.neighbours[::step]
        departure = np.zeros((len(values), len(neighbours), 3))
        for column in range(neighbours.shape[1]):
            departure += weights[:, column, None] * values[:, neighbours[:, column]]
        return departure


def estimate(markers: NDArray[np.float64], positions: NDArray[np.float64], *, where: str) -> float:
    """Standard deviation of a coordinate's noise [m].

    Within 10 % for white noise on a motion that is smooth on the scale of the frames or of the markers; too large where
    it is smooth on neither.

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
            "too few values to estimate the noise from", where=where, fix="give the standard deviation of a coordinate"
        )
    return smallest


def stencils(markers: NDArray[np.float64], degree: int) -> Stencils | None:
    """Departures from polynomials of a degree fitted to the nearest neighbours; None where there are too few of them.

    Args:
        markers: (marker, 2) [m].
        degree: 0 for the values themselves.
    """
    count = len(markers)
    if degree == 0:
        return Stencils(neighbours=np.arange(count)[:, None], weights=np.ones((count, 1)))
    terms = (degree + 1) * (degree + 2) // 2
    near = math.ceil(_SPARE * terms) + 1
    if count < near:
        return None
    neighbours = np.asarray(KDTree(markers).query(markers, k=near)[1], dtype=np.int64)
    arms = markers[neighbours] - markers[:, None]
    arms = arms / np.abs(arms).max(axis=(1, 2), keepdims=True)
    powers = [(i, j) for i in range(degree + 1) for j in range(degree + 1 - i)]
    basis = np.stack([arms[..., 0] ** i * arms[..., 1] ** j for i, j in powers], axis=-1)
    # The fit to the neighbours alone, at the marker: the constant term.
    fit = np.linalg.pinv(basis[:, 1:], rcond=1e-6)[:, 0]
    weights = np.concatenate([np.ones((count, 1)), -fit], axis=1)
    return Stencils(neighbours=neighbours, weights=weights / np.linalg.norm(weights, axis=1, keepdims=True))


def _quietest(values: NDArray[np.float64], order: int) -> float:
    """Standard deviation at the markers that move least, from differences (frame, marker, 3) of an order in time;
    infinite where too few values are there."""
    square = (values * values).sum(axis=2) / 3
    there = np.isfinite(square)
    frames = there.sum(axis=0)
    enough = 3 * frames >= min(_LEAST, 3 * len(square))
    if not enough.any():
        return math.inf
    means = np.where(there, square, 0.0).sum(axis=0)[enough] / frames[enough]
    # Differences of white noise are correlated, ρ_k = C(2d, d+k)/C(2d, d); Σ ρ_k² = C(4d, 2d)/C(2d, d)² of them count
    # as one.
    together = math.comb(4 * order, 2 * order) / math.comb(2 * order, order) ** 2
    scale = math.comb(2 * order, order)  # variance of the difference of unit white noise
    free = max(1.0, 3 * float(np.median(frames[enough])) / together)
    return math.sqrt(float(np.quantile(means, _SHARE)) / (scale * float(chi2.ppf(_SHARE, free)) / free))


_NAMED = {Hold.HOIST_CORNERS: handles.corners, Hold.TOP_CORNERS: handles.top_corners, Hold.HOIST: handles.full_hoist}
_NEAR = 1e-6
"""Share of the cloth's size: what is nearer than this is in one place."""


def hold(mesh: Mesh, pins: Hold | Floats) -> tuple[Mesh, tuple[int, ...]]:
    """The mesh with a vertex at each pin, and those vertices.

    Args:
        pins: a named attachment, or (pin, 2) in the mesh's coordinates [m]. Where no vertex is at a pin, the nearest
            is moved there: one of the edge to a pin on the edge, an inner one to a pin within, never a corner.

    Raises:
        InputError: a pin that is not on the cloth, or two in one place.
    """
    if isinstance(pins, Hold):
        return mesh, tuple(int(vertex) for vertex in _NAMED[pins](mesh.rest))
    rest, near = mesh.rest.copy(), _NEAR * float(np.ptp(mesh.rest, axis=0).max())
    corners = cloth.outline(mesh.rest, mesh.faces, where="model mesh")
    sharp = corners[cloth.sharp_corners(corners)]
    fixed = (np.hypot(*(rest[:, None] - sharp).transpose(2, 0, 1)) <= near).any(axis=1)
    edge = np.zeros(len(rest), dtype=bool)
    edge[mesh.boundary] = True
    held: list[int] = []
    for pin in pins:
        where = f"pin (u, v) = ({pin[0]:.4g}, {pin[1]:.4g}) m from the cloth's lower left"
        away = np.hypot(*(rest - pin).T)
        vertex = int(away.argmin())
        if away[vertex] > near:
            at_edge = cloth.distance_to(corners, pin) <= near
            if not at_edge and not cloth.inside(corners, pin[None])[0]:
                raise InputError(
                    "it is not on the cloth", where=where, fix="give pins in the coordinates of the markers, in metres"
                )
            free = (edge == at_edge) & ~fixed
            free[held] = False
            if not free.any():
                raise InputError("no vertex of the model mesh is free for it", where=where, fix="ask for more vertices")
            vertex = int(np.where(free, away, np.inf).argmin())
            rest[vertex] = pin
        if vertex in held:
            raise InputError("two pins in one place", where=where, fix="give each pin once")
        held.append(vertex)
    return Mesh(rest=rest, faces=mesh.faces), tuple(held)


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
    return estimate(seen.markers, seen.positions, where=f"recording {seen.name!r}")


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
        found = Finding.of(
            "cloth-assumed-to-end-at-markers",
            f"the size of the cloth is not given; it is taken to be {size[0]:.4g} m × {size[1]:.4g} m, as far "
            "as the markers reach",
            where="cloth",
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
