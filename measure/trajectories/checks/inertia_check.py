"""Inertia against wind and gravity: whether frame rate, wind, unit and area weight are those of one
and the same cloth.

Reactions at pins on a line have no moment about it, nor have internal forces at all, so that the
cloth's moment of momentum changes by what the air and gravity give. All but the wind's speed is
observed or nominal: the speed at which the balance holds is the wind that the motion shows. A rate
that is twice the true one doubles it, a wind of 3.6 times the true one divides it by 3.6 in terms
of the wind that is given.

In calm air the balance does not constrain the clock: the air's force and the inertia both go by the
inverse square of the time. There a swinging cloth constrains it: its kinetic energy comes from its
height.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding
from measure.trajectories.interpolation import onto
from measure.trajectories.trajectory import Specimen, Trajectory

# s: frames closer than this are left out, since differences of noise grow with the square of the
# rate
_PERIOD = 0.03
# of the cloth's size: pins that are further from a line have reactions with a moment about it
_LINE = 0.02
_FACTORS = np.geomspace(1 / 12, 12, 241)  # of the wind, in steps of 2 %
_EXPLAINED = 0.4  # of the moment's variance: a balance that explains less says nothing of the wind
# The wind that the motion shows over the one given. In 72 recordings with and without strong
# effects (3 to 8 m/s, 25 and 60 Hz, 0 to 4 mm of noise) it is 0.81 to 1.09, once 1.36, once
# nothing: no false alarm, at most 4.1 % (95 %). With the rate twice or half the true one, km/h for
# m/s or the reverse, 25 of them give 1.68 or more, 0.54 or less: reported.
_SHOWN = (0.65, 1.5)
_SWING = (
    0.4,
    2.0,
)  # kinetic energy over that from height; released reference runs give 0.77 to 0.87
_CALM = 0.5  # m/s


@dataclass(frozen=True, kw_only=True, eq=False)
class MarkerMotion:
    """Position, velocity and acceleration of the mesh's vertices, interpolated from the markers, by
    central differences.

    Attributes:
        times: (frame,) [s].
        position, velocity, acceleration: (frame, vertex, 3).
        mass: (vertex,) nominal [kg].
    """

    times: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    mass: FloatArray

    @classmethod
    def of(cls, recording: Trajectory, specimen: Specimen) -> MarkerMotion:
        """Differentiates by central differences over about `_PERIOD`."""
        stride = max(1, int(recording.rate * _PERIOD))
        step = stride / recording.rate
        at = onto(recording.markers, specimen.mesh.rest) @ recording.positions[::stride]
        return cls(
            times=np.asarray(np.arange(1, len(at) - 1) * step, dtype=np.float64),
            position=at[1:-1],
            velocity=(at[2:] - at[:-2]) / (2 * step),
            acceleration=(at[2:] - 2 * at[1:-1] + at[:-2]) / step**2,
            mass=specimen.material.area_weight * specimen.mesh.vertex_areas,
        )


def check_inertia(recording: Trajectory, specimen: Specimen) -> tuple[Finding, ...]:
    """Reports a wind or a clock with which the cloth's inertia does not fit."""
    if recording.wind.speed < _CALM:
        return _check_swing(recording, specimen)
    factor = wind_shown(recording, specimen)
    if factor is None or _SHOWN[0] <= factor <= _SHOWN[1]:
        return ()
    speed = recording.wind.speed
    return (
        Finding.of(
            "inertia-does-not-fit",
            f"by its accelerations the cloth moves as in {factor * speed:.2g} m/s, {factor:.2g} "
            "times the wind "
            f"given, {speed:.3g} m/s",
            where=f"recording {recording.name!r}",
            value=factor,
            fix=f"check the unit of the wind (km/h are {1 / 3.6:.2g} m/s), the frame rate "
            f"({recording.rate:.4g} Hz; "
            f"{recording.rate / factor:.3g} Hz would fit) and the cloth's area weight",
        ),
    )


def wind_shown(recording: Trajectory, specimen: Specimen) -> float | None:
    """Estimates the ratio of the wind speed that balances the moments about the pins to the wind
    speed given; None if the moments do not determine it.

    That is, the factor q of least ‖M_a − M_g − M_w(q U)‖² over all frames, each less its mean,
    where M are the moments of the accelerations, of gravity and of the base model's wind force.
    """
    axis = _axis(recording, specimen)
    if axis is None:
        return None
    origin, direction = axis
    motion, mesh = MarkerMotion.of(recording, specimen), specimen.mesh
    arms = motion.position - origin
    needed = motion.mass[:, None] * (motion.acceleration - np.array(specimen.gravity))
    moment = _centre_values((np.cross(arms, needed) @ direction).sum(axis=1))
    corners = [motion.position[:, mesh.faces[:, c]] for c in range(3)]
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), np.finfo(np.float64).tiny)
    lever = np.cross(sum(arms[:, mesh.faces[:, c]] for c in range(3)) / 3, normal) @ direction
    along_normal = (normal * motion.velocity[:, mesh.faces].mean(axis=2)).sum(axis=2)
    blown = (normal * recording.wind.at(motion.times)[:, None]).sum(axis=2)
    weight = lever * mesh.areas * specimen.air.plain.density
    residuals = np.array(
        [
            (
                (
                    moment
                    - _centre_values(
                        (
                            weight * np.abs(q * blown - along_normal) * (q * blown - along_normal)
                        ).sum(axis=1)
                    )
                )
                ** 2
            ).sum()
            for q in _FACTORS
        ]
    )
    total = float((moment**2).sum())
    best = int(residuals.argmin())
    if total == 0 or residuals[best] > (1 - _EXPLAINED) * total or best in (0, len(_FACTORS) - 1):
        return None
    return float(_FACTORS[best])


def swing(recording: Trajectory, specimen: Specimen) -> float | None:
    """Estimates the ratio of the kinetic energy gained to the potential energy lost, by least
    squares in time; None where neither determines the other.

    It is 1 less what friction takes, and goes with the square of the frame rate.
    """
    motion = MarkerMotion.of(recording, specimen)
    step = float(motion.times[1] - motion.times[0])
    kinetic = (motion.mass[:, None] * motion.velocity**2).sum(axis=(1, 2)) / 2
    height = -np.einsum("v,fvi,i->f", motion.mass, motion.position, np.array(specimen.gravity))
    gained, lost = (_centre_values((e[2:] - e[:-2]) / (2 * step)) for e in (kinetic, -height))
    power = float(lost @ lost)
    if power == 0 or (gained @ lost) ** 2 < _CLEAR * power * float(gained @ gained):
        return None
    return float(gained @ lost) / power


# of the squared correlation of the two: energies that go together less are exchanged with others
_CLEAR = 0.7


def _check_swing(recording: Trajectory, specimen: Specimen) -> tuple[Finding, ...]:
    ratio = swing(recording, specimen)
    if ratio is None or _SWING[0] <= ratio <= _SWING[1]:
        return ()
    return (
        Finding.of(
            "inertia-does-not-fit",
            f"in calm air the swinging cloth gains {ratio:.2g} times the energy that its height "
            "loses",
            where=f"recording {recording.name!r}",
            value=ratio,
            fix=f"check the frame rate ({recording.rate:.4g} Hz; {recording.rate / ratio**0.5:.3g} "
            "Hz would fit)",
        ),
    )


def _axis(recording: Trajectory, specimen: Specimen) -> tuple[FloatArray, FloatArray] | None:
    """Fits the line through the pins, a point of it and its direction; the vertical through a
    single one; None if no line."""
    seats = onto(recording.markers, specimen.mesh.rest[list(specimen.held)])
    pins = seats @ recording.positions.mean(axis=0)
    origin = pins.mean(axis=0)
    if len(pins) == 1:
        return origin, np.array([0.0, 0.0, 1.0])
    spread, directions = np.linalg.svd(pins - origin, full_matrices=False)[1:]
    size = float(np.ptp(specimen.mesh.rest, axis=0).max())
    return None if spread[1] > _LINE * size else (origin, directions[0])


def _centre_values(values: FloatArray) -> FloatArray:
    return values - values.mean()
