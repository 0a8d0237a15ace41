"""From recordings as they came to an experiment: put in order, checked, on one model mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from flagdata.errors import InputError
from flagdata.findings import Finding, Severity
from measure.observe import cloth, noise
from measure.observe.interpolation import onto
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
    recordings = tuple(_trajectory(seen, low) for seen in observations)
    known = [seen.known for seen in observations]
    mesh, held = hold(mesh, _pins(known, setup, low))
    specimen = Specimen(
        mesh=mesh, material=_material(known, setup), held=held, anchors=_anchors(recordings, mesh.rest[list(held)]),
        stiffness=_agreed([k.stiffness for k in known], setup.stiffness, ARCSIM_STIFFNESS, "stiffness of the pins"),
        gravity=(
            _agreed([k.gravity for k in known], None, GRAVITY, "gravity")
            if setup.gravity is None else (0.0, 0.0, -setup.gravity)
        ),
        air=_agreed([k.air for k in known], setup.air, QuadraticNormal(), "wind force"),
    )  # fmt: skip
    experiment = Experiment(specimen=specimen, recordings=recordings)
    return Observed(experiment=experiment, findings=(*found, *(f for seen in observations for f in seen.findings)))


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
            kind="cloth-assumed-to-end-at-markers", severity=Severity.WARNING, where="cloth",
            what=f"the size of the cloth is not given; it is taken to be {size[0]:.4g} m × {size[1]:.4g} m, as far "
            "as the markers reach",
            fix="give its width and height, or its rest mesh",
        )  # fmt: skip
        return edge, (found,)
    return (corners if cloth.area(corners) > 0 else corners[::-1]), ()


def _trajectory(seen: Observation, low: Floats) -> Trajectory:
    where = f"recording {seen.name!r}"
    wind = seen.wind or seen.known.wind
    if wind is None:
        raise InputError("no wind is known", where=where, fix="give its velocity, or an anemometer's log")
    rate = (len(seen.times) - 1) / float(seen.times[-1] - seen.times[0])
    sigma = noise.estimate(seen.markers, seen.positions, where=where) if seen.noise is None else seen.noise
    return Trajectory(
        name=seen.name, markers=seen.markers - low, positions=seen.positions, rate=rate, wind=wind, noise=sigma,
        source=seen.source,
    )  # fmt: skip


def _material(known: Sequence[Known], setup: Setup) -> Material:
    if setup.material is not None:
        return setup.material
    given = [k.material for k in known if k.material is not None]
    if not given:
        raise InputError("the material is not known", where="cloth", fix="name one of the catalog, or a file")
    first = given[0]
    for other in given[1:]:
        same = (first.density, first.damping) == (other.density, other.damping)
        tables = ((first.stretching, other.stretching), (first.bending, other.bending))
        if not same or not all(np.array_equal(a, b) for a, b in tables):
            raise InputError(
                f"recordings of two materials, {first.name!r} and {other.name!r}",
                where="cloth", fix="take recordings of one cloth, or say by the setup which material it is",
            )  # fmt: skip
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
            "where the cloth is held is not known", where="cloth",
            fix=f"name its pins: {', '.join(Hold)}, or their rest coordinates",
        )  # fmt: skip
    for other in given[1:]:
        if other.shape != given[0].shape or not np.allclose(other, given[0]):
            raise InputError(
                "recordings whose cloth is held differently", where="cloth", fix="take those with the same pins"
            )
    return given[0] - low


def _anchors(recordings: Sequence[Trajectory], seats: Floats) -> Floats:
    """(held, 3) where the held points are on the average of all frames [m], each recording counting alike."""
    means = [onto(r.markers, seats) @ r.positions.mean(axis=0) for r in recordings]
    return np.mean(means, axis=0)


T = TypeVar("T")


def _agreed(known: Sequence[T | None], given: T | None, default: T, what: str) -> T:
    """What the user gives, else what the recordings' descriptions agree on, else the default."""
    if given is not None:
        return given
    said = [value for value in known if value is not None]
    if any(value != said[0] for value in said[1:]):
        raise InputError(
            f"recordings of different {what}: {', '.join(map(repr, said))}",
            where="experiment", fix="take recordings of one set-up, or say by the setup which it is",
        )  # fmt: skip
    return said[0] if said else default
