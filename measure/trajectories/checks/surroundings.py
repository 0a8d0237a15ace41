"""Wind, gravity and clock against what the cloth shows: it flies downwind, sags downward, and is
not flung about."""

from __future__ import annotations

import math

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding
from flagdata.errors import InputError
from measure.trajectories.checks.attachment import centre_of_pins
from measure.trajectories.trajectory import Specimen, Trajectory, WindTrack

# of the cloth's size: a mean offset from the pins that is less says nothing of the wind's direction
_FLIES = 0.15
_BLOWS = 1.0  # of the ratio ρU²/(m g): wind that is weaker does not set the direction
_UPWIND, _ASIDE = math.radians(100), math.radians(45)
_RISES, _SAGS = 0.02, 0.05  # of the cloth's size
_DOWNWARD = (
    0.3  # of a length along v: the mean cloth falls by so much at least where v runs downward
)
_COVERED = 0.98  # of the recording: a log must cover so much
_WILD, _SLOW = (
    30.0,
    0.01,
)  # of g + ρU²/m: root-mean-square accelerations beyond are of another clock or unit
_QUASI_STATIC = 0.02  # of g x/L, a pendulum's at that motion: slower is no swinging cloth
_CALM, _FLAT, _STRONG, _LIMP = 0.1, 0.5, 10.0, 0.25
"""ρU²/(m g), and the cloth's mean horizontal offset over what it is at most."""


def check_overlap(recording: Trajectory) -> None:
    """Refuses a log that does not cover the recording. A constant wind covers all.

    Raises:
        InputError: it covers less than 98 % of it.
    """
    times, wind = recording.times, recording.wind.times
    if len(wind) == 1:
        return
    step = float(np.median(np.diff(wind)))
    begin, end = float(wind[0]) - step, float(wind[-1]) + step
    covered = min(end, float(times[-1])) - max(begin, 0.0)
    if covered < _COVERED * float(times[-1]):
        raise InputError(
            f"the wind log spans {wind[0]:.4g} s to {wind[-1]:.4g} s after the first frame, the "
            "recording lasts "
            f"{times[-1]:.4g} s",
            where=f"recording {recording.name!r}",
            fix="give the instant of the first frame on the log's clock, or another log",
        )


def check_up(recording: Trajectory, specimen: Specimen) -> None:
    """Refuses a cloth that lies above its pins, or sags sideways: z is not up.

    Raises:
        InputError: so it does.
    """
    if not any(specimen.gravity):
        return
    where = f"recording {recording.name!r}"
    size = float(np.ptp(specimen.mesh.rest, axis=0).max())
    offset = _centre(recording) - centre_of_pins(recording, specimen)
    if offset[2] > _RISES * size:
        raise InputError(
            f"the cloth is {offset[2]:.3g} m above its pins on the average",
            where=where,
            fix=f"z must point up: {_sagging(offset, size, recording.wind)}",
        )
    wind = recording.wind.at(recording.times).mean(axis=0)
    across = np.array([-wind[1], wind[0], 0.0]) / max(float(np.hypot(wind[0], wind[1])), 1e-9)
    sideways = float(offset @ across)
    if _ratio(specimen, recording.wind) < _CALM:
        sideways = float(np.hypot(offset[0], offset[1]))
    if offset[2] > -_RISES * size and abs(sideways) > _SAGS * size:
        raise InputError(
            f"the cloth does not sag along −z but is {abs(sideways):.3g} m off sideways",
            where=where,
            fix="z must point up, and the wind be in the same axes: "
            f"{_sagging(offset, size, recording.wind)}",
        )


def check_direction(recording: Trajectory, specimen: Specimen) -> tuple[Finding, ...]:
    """Refuses a cloth that flies upwind, and reports one that flies far aside.

    Raises:
        InputError: on the average it streams against the wind as it was given.
    """
    where = f"recording {recording.name!r}"
    size = float(np.ptp(specimen.mesh.rest, axis=0).max())
    offset = (_centre(recording) - centre_of_pins(recording, specimen))[:2]
    wind = recording.wind.at(recording.times).mean(axis=0)[:2]
    distance, speed = float(np.hypot(*offset)), float(np.hypot(*wind))
    if distance < _FLIES * size or _ratio(specimen, recording.wind) < _BLOWS or speed == 0:
        return ()
    angle = math.acos(float(np.clip(offset @ wind / (distance * speed), -1, 1)))
    heading, blown = (math.degrees(math.atan2(y, x)) for x, y in (offset, wind))
    directions = (
        f"the cloth streams towards {heading:.0f}°, the wind as given blows towards {blown:.0f}° "
        "(from +x towards +y)"
    )
    if angle > _UPWIND:
        raise InputError(
            f"the cloth streams upwind: {directions}",
            where=where,
            fix="wind velocities say where the air goes to; turn a direction it comes from, and "
            "check the axes",
        )
    if angle <= _ASIDE:
        return ()
    return (
        Finding.of(
            "flies-aside",
            directions,
            where=where,
            value=angle,
            fix="check the direction of the wind in the recording's axes",
        ),
    )


def check_strength(recording: Trajectory, specimen: Specimen) -> tuple[Finding, ...]:
    """Reports a cloth that hangs in a strong wind or flies in none: wrong units, or not the wind at
    the flag."""
    ratio = _ratio(specimen, recording.wind)
    pins = centre_of_pins(recording, specimen)
    seats = specimen.mesh.rest[list(specimen.held)].mean(axis=0)
    reach = float(np.hypot(*(specimen.mesh.rest - seats).T) @ specimen.mesh.vertex_areas) / float(
        specimen.mesh.areas.sum()
    )
    out = float(np.hypot(*(_centre(recording) - pins)[:2])) / reach
    calm, strong = ratio < _CALM and out > _FLAT, ratio > _STRONG and out < _LIMP
    if not (calm or strong):
        return ()
    motion = "flies nearly flat, though its wind" if calm else "hangs limp, though its wind"
    return (
        Finding.of(
            "wind-does-not-fit",
            f"the cloth {motion} of {recording.wind.speed:.3g} m/s has {ratio:.2g} times the force "
            "of its weight",
            where=f"recording {recording.name!r}",
            value=ratio,
            fix="check the unit of the wind, and the clock of its log",
        ),
    )


def check_sides(recording: Trajectory) -> tuple[Finding, ...]:
    """Reports rest coordinates whose v runs downward: top and bottom, and the two faces, are
    exchanged."""
    design = np.concatenate([recording.markers, np.ones((len(recording.markers), 1))], axis=1)
    slope = np.linalg.lstsq(design, recording.positions.mean(axis=0), rcond=None)[0]
    if slope[1, 2] > -_DOWNWARD:
        return ()
    return (
        Finding.of(
            "rest-upside-down",
            "the markers' v runs downward as the cloth hangs: what the answer calls the top is the "
            "bottom",
            where=f"recording {recording.name!r}",
            value=float(slope[1, 2]),
            fix="let v run from the bottom to the top, and u from the hoist to the fly",
        ),
    )


def check_accelerations(recording: Trajectory, specimen: Specimen) -> None:
    """Refuses accelerations far from what gravity and the wind's force give: another frame rate, or
    another unit.

    Raises:
        InputError: their root mean square is beyond 0.01 to 30 times g + ρU²/m, or below a fiftieth
            of what a pendulum of the cloth's length has at such a motion.
    """
    positions, rate = recording.positions, recording.rate
    second = np.diff(positions, n=2, axis=0)
    square = float(np.median((second**2).sum(axis=2).mean(axis=0))) - 18 * recording.noise**2
    typical = math.sqrt(max(square, 0.0)) * rate**2
    weight = float(np.linalg.norm(specimen.gravity))
    expected = weight + _pressure(specimen, recording.wind) / specimen.material.area_weight
    where = f"recording {recording.name!r}"
    if typical > _WILD * expected:
        raise InputError(
            f"accelerations of {typical:.3g} m/s², where gravity and wind give about "
            f"{expected:.3g}",
            where=where,
            fix=f"is the rate of {rate:.4g} Hz too high, or the wind or the unit of the positions "
            "wrong?",
        )
    motion = float(np.sqrt(np.median(positions.var(axis=0).sum(axis=1))))
    swing = weight * motion / float(np.ptp(specimen.mesh.rest, axis=0).max())
    blows = _ratio(specimen, recording.wind) > _BLOWS
    if typical < max(_SLOW * expected * blows, _QUASI_STATIC * swing):
        raise InputError(
            f"accelerations of {typical:.3g} m/s², where gravity and wind give about "
            f"{expected:.3g}",
            where=where,
            fix=f"is the rate of {rate:.4g} Hz that of slow motion, or the unit of the wind "
            "another? Give the rate at "
            "which the camera ran, and the wind in m/s",
        )


def _centre(recording: Trajectory) -> FloatArray:
    """Averages the markers' positions over all frames, (3,) [m]."""
    return recording.positions.mean(axis=(0, 1))


def _pressure(specimen: Specimen, wind: WindTrack) -> float:
    """Computes ρU² [N/m²] of the base model's force."""
    return specimen.air.plain.density * float((wind.velocity**2).sum(axis=1).mean())


def _ratio(specimen: Specimen, wind: WindTrack) -> float:
    """Computes ρU²/(m g); infinite without gravity."""
    weight = specimen.material.area_weight * float(np.linalg.norm(specimen.gravity))
    return _pressure(specimen, wind) / weight if weight else math.inf


def _sagging(offset: FloatArray, size: float, wind: WindTrack) -> str:
    """Advises on the vertical: the axis against which the cloth is off its pins, the wind's left
    aside."""
    blown = np.abs(wind.velocity.mean(axis=0))
    candidates = np.abs(offset) / size - 2.0 * (blown > 0.5 * blown.max()) * (blown.max() > 0)
    axis = int(candidates.argmax())
    sign = "" if offset[axis] < 0 else "-"
    return f"the cloth sags as if up were {sign}{'xyz'[axis]}"
