"""What was observed: tracked points of one cloth in one or more recordings, and the wind beside
each."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from flagdata.core.arrays import AnyArray, BoolArray, FloatArray
from flagdata.errors import InputError
from flagdata.timebase import NANOSECONDS
from sim.cloth.air import AirForce, QuadraticNormal
from sim.cloth.handles import ARCSIM_STIFFNESS
from sim.cloth.material import Material
from sim.cloth.mesh import Mesh
from sim.cloth.scene import GRAVITY

GAIN = 0.03
"""Share: calibrated cups and sonics are good to 1 to 3 % (IEC 61400-12-1, annex I, classes them
so)."""
DIRECTION = math.radians(5.0)
"""rad: how well north, or the axis of a tunnel, is lined up with a camera's axes by eye and
compass."""
CLOCK = 0.3
"""s: a log of 1 Hz whose stamps are rounded, or a cup's lag at a few metres a second."""
AREA_WEIGHT_UNCERTAINTY = 0.3
"""Relative standard uncertainty of a cloth's area weight [kg/m²] where nobody says how well it is
known."""


@dataclass(frozen=True, kw_only=True, eq=False)
class WindTrack:
    """The wind as it was logged, linear between its samples.

    Attributes:
        times: (n,) since the recording's first frame [s], increasing.
        velocity: (n, 3) where the air goes to [m/s]. One sample means a constant wind.
        gain: standard deviation of the share by which the wind is stronger than logged.
        direction: the same of the angle by which it is turned about the vertical [rad].
        clock: the same of the time by which the log lags behind the recording [s].
        start: instant of the recording's first frame on the log's clock [UTC ns]; None where no
            log states it.
        sensor: what logged it, in words; empty where that is not known.

    Raises:
        InputError: shapes that disagree, values that are not finite, times that do not increase, a
            negative deviation.
    """

    times: FloatArray
    velocity: FloatArray
    gain: float = GAIN
    direction: float = DIRECTION
    clock: float = CLOCK
    start: int | None = None
    sensor: str = ""

    def __post_init__(self) -> None:
        times, velocity = _frozen(self.times), _frozen(self.velocity)
        if times.ndim != 1 or velocity.shape != (len(times), 3) or not len(times):
            raise InputError(
                f"the times have the shape {times.shape}, the velocities {velocity.shape}",
                where="wind",
                fix="give (n,) seconds and (n, 3) m/s",
            )
        if (
            not (np.isfinite(times).all() and np.isfinite(velocity).all())
            or (np.diff(times) <= 0).any()
        ):
            raise InputError(
                "the times do not increase, or a value is not finite",
                where="wind",
                fix="sort the log and leave its gaps out",
            )
        if not all(0 <= deviation < math.inf for deviation in self.uncertainty):
            raise InputError(
                f"the standard deviations are {self.uncertainty}",
                where="wind",
                fix="give gain, direction and clock, or 0",
            )
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "velocity", velocity)

    @classmethod
    def constant(cls, velocity: tuple[float, float, float]) -> WindTrack:
        """Makes a track of the same wind (x, y, z) [m/s] all the time."""
        return cls(times=np.zeros(1), velocity=np.array([velocity], dtype=np.float64))

    @property
    def uncertainty(self) -> tuple[float, float, float]:
        """Standard deviations of gain, direction [rad] and clock [s]."""
        return self.gain, self.direction, self.clock

    @property
    def steady(self) -> bool:
        """Whether it never changes."""
        return bool((self.velocity == self.velocity[0]).all())

    @property
    def speed(self) -> float:
        """Mean speed [m/s]."""
        return float(np.linalg.norm(self.velocity, axis=1).mean())

    def later(self, seconds: float) -> WindTrack:
        """Shifts the wind's times to an instant that many seconds later."""
        start = None if self.start is None else self.start + round(seconds * NANOSECONDS)
        return replace(self, times=self.times - seconds, start=start)

    def between(self, begin: float, end: float) -> WindTrack:
        """Cuts the wind to the part from `begin` to `end` [s], or as much of that as the log
        has."""
        begin, end = max(begin, float(self.times[0])), min(end, float(self.times[-1]))
        if not begin < end:
            return self
        inside = self.times[(self.times > begin) & (self.times < end)]
        times = np.concatenate([[begin], inside, [end]])
        return replace(self, times=times, velocity=self.at(times))

    def at(self, times: FloatArray) -> FloatArray:
        """Interpolates velocities (k, 3) [m/s] at times (k,) [s]; outside the log its first and
        last sample."""
        return np.stack(
            [np.interp(times, self.times, self.velocity[:, axis]) for axis in range(3)], axis=-1
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class AttachmentTrack:
    """Where the attachments of a carried cloth go, linear between samples and still before and
    after them.

    Attributes:
        times: (n,) since the recording's first frame [s], increasing.
        places: (n, held, 3) [m].

    Raises:
        InputError: shapes that disagree, values that are not finite, times that do not increase.
    """

    times: FloatArray
    places: FloatArray

    def __post_init__(self) -> None:
        times, places = _frozen(self.times), _frozen(self.places)
        if (
            times.ndim != 1
            or not len(times)
            or places.ndim != 3
            or places.shape[::2] != (len(times), 3)
        ):
            raise InputError(
                f"the times have the shape {times.shape}, the places {places.shape}",
                where="attachments",
                fix="give (n,) seconds and (n, held, 3) metres",
            )
        if (
            not (np.isfinite(times).all() and np.isfinite(places).all())
            or (np.diff(times) <= 0).any()
        ):
            raise InputError(
                "the times do not increase, or a value is not finite",
                where="attachments",
                fix="sort the track and fill its gaps",
            )
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "places", places)

    def at(self, times: FloatArray) -> FloatArray:
        """Interpolates (k, held, 3) [m] at times (k,) [s]."""
        flat = self.places.reshape(len(self.times), -1)
        interpolated = np.stack(
            [np.interp(times, self.times, values) for values in flat.T], axis=-1
        )
        return interpolated.reshape(len(times), *self.places.shape[1:])


@dataclass(frozen=True, kw_only=True, eq=False)
class Trajectory:
    """One recording: tracked points at a constant rate.

    Attributes:
        name: what reports call it.
        markers: (marker, 2) where the points are on the flat cloth [m].
        positions: (frame, marker, 3) [m], z up; NaN where a point was not tracked.
        rate: frames a second [Hz].
        wind: beside it.
        noise: standard deviation of a coordinate [m].
        source: identity of the artifact it was read from; empty where there is none.
        seen: (frame, marker) whether each position was tracked, where gaps are filled; None where
            all were. What is filled starts a prediction, and is never compared with one.
        attachments: (frame, held, 3) where the cloth is held, if that moves [m]; None where it is
            held still.
        session: one set-up at one place; None where nobody stated one.

    Raises:
        InputError: shapes that disagree, a rate or noise that makes no sense, infinite positions.
    """

    name: str
    markers: FloatArray
    positions: FloatArray
    rate: float
    wind: WindTrack
    noise: float = 0.0
    source: str = ""
    seen: BoolArray | None = None
    attachments: FloatArray | None = None
    session: str | None = None

    def __post_init__(self) -> None:
        markers, positions = _frozen(self.markers), _frozen(self.positions)
        where = f"recording {self.name!r}"
        if markers.ndim != 2 or markers.shape[1] != 2 or positions.shape[1:] != (len(markers), 3):
            raise InputError(
                f"the markers have the shape {markers.shape}, the positions have {positions.shape}",
                where=where,
                fix="give (marker, 2) and (frame, marker, 3), in metres",
            )
        if not np.isfinite(markers).all() or np.isinf(positions).any():
            raise InputError(
                "a coordinate is not finite", where=where, fix="mark points that were lost by NaN"
            )
        if not (np.isfinite(self.rate) and self.rate > 0):
            raise InputError(
                f"the rate is {self.rate!r} frames a second", where=where, fix="give Hz"
            )
        if not (np.isfinite(self.noise) and self.noise >= 0):
            raise InputError(
                f"the noise is {self.noise!r} m", where=where, fix="give at least 0 metres"
            )
        if self.seen is not None and self.seen.shape != positions.shape[:2]:
            raise InputError(
                f"the mask has the shape {self.seen.shape}, the positions have {positions.shape}",
                where=where,
                fix="give (frame, marker)",
            )
        if self.attachments is not None:
            attachments = _frozen(self.attachments)
            if (
                attachments.ndim != 3
                or attachments.shape[::2] != (len(positions), 3)
                or not np.isfinite(attachments).all()
            ):
                raise InputError(
                    f"the attachments have the shape {attachments.shape}, or are not finite; the "
                    "positions have "
                    f"{positions.shape}",
                    where=where,
                    fix="give (frame, held, 3), in metres, without gaps",
                )
            object.__setattr__(self, "attachments", attachments)
        object.__setattr__(self, "markers", markers)
        object.__setattr__(self, "positions", positions)

    @property
    def times(self) -> FloatArray:
        """(frame,) since the first frame [s]."""
        return np.arange(len(self.positions)) / self.rate

    @property
    def track(self) -> AttachmentTrack | None:
        """Where its attachments go; None where they are held still."""
        return (
            None
            if self.attachments is None
            else AttachmentTrack(times=self.times, places=self.attachments)
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Specimen:
    """The cloth before anything is fitted.

    Attributes:
        mesh: the model's, in its flat rest state; as wide and high as the cloth.
        material: nominal.
        area_weight_uncertainty: relative standard uncertainty of its area weight; None where that
            is a guess, not known as well as from a material's name.
        held: vertices of `mesh` that are attached.
        anchors: (held, 3) where they are tied [m].
        stiffness: of each attachment, on each axis [N/m].
        anchors_given: whether `anchors` are known by themselves, not taken from where recordings
            show the attachments.
        gravity: (x, y, z) [m/s²].
        air: the base model's force.

    Raises:
        InputError: attachments and anchors that do not fit.
    """

    mesh: Mesh
    material: Material
    held: tuple[int, ...]
    anchors: FloatArray
    stiffness: float = ARCSIM_STIFFNESS
    anchors_given: bool = True
    area_weight_uncertainty: float | None = AREA_WEIGHT_UNCERTAINTY
    gravity: tuple[float, float, float] = GRAVITY
    air: AirForce = field(default_factory=QuadraticNormal)

    def __post_init__(self) -> None:
        anchors = _frozen(self.anchors)
        if not self.held or anchors.shape != (len(self.held), 3) or not np.isfinite(anchors).all():
            raise InputError(
                f"{len(self.held)} attachments have anchors of shape {anchors.shape}",
                where="specimen",
                fix="give one finite (x, y, z) for each attached vertex",
            )
        object.__setattr__(self, "anchors", anchors)

    @property
    def seats(self) -> FloatArray:
        """(held, 2) where the attachments are on the flat cloth [m]."""
        return self.mesh.rest[list(self.held)]


@dataclass(frozen=True, kw_only=True, eq=False)
class Experiment:
    """One cloth in one or more recordings.

    Raises:
        InputError: no recording, two of one name, attachments that are not the cloth's, or markers
            beyond the cloth.
    """

    specimen: Specimen
    recordings: tuple[Trajectory, ...]

    @property
    def carried(self) -> bool:
        """Whether the attachments move."""
        return any(recording.attachments is not None for recording in self.recordings)

    def __post_init__(self) -> None:
        names = [r.name for r in self.recordings]
        if not names or len(set(names)) != len(names):
            raise InputError(
                f"the recordings' names are {names!r}",
                where="experiment",
                fix="give one or more, each its own name",
            )
        rest = self.specimen.mesh.rest
        slack = 1e-3 * float(np.ptp(rest, axis=0).max())
        counts = {
            None if r.attachments is None else r.attachments.shape[1] for r in self.recordings
        }
        if counts not in ({None}, {len(self.specimen.held)}):
            raise InputError(
                "some recordings have attachments that move and some not, or not the cloth's",
                where="experiment",
                fix="give the tracks of all attachments in all recordings, or none",
            )
        for recording in self.recordings:
            beyond = (recording.markers < rest.min(axis=0) - slack) | (
                recording.markers > rest.max(axis=0) + slack
            )
            if beyond.any():
                marker = int(np.flatnonzero(beyond.any(axis=1))[0])
                raise InputError(
                    f"{int(beyond.any(axis=1).sum())} markers are not on the cloth",
                    where=f"recording {recording.name!r}, {marker_at(recording.markers[marker])}",
                    fix="give rest coordinates in the cloth's own frame and in metres",
                )


def marker_at(rest: FloatArray) -> str:
    """Returns how a marker is named in messages: by its rest coordinates (2,) [m], since its index
    is not its name."""
    return f"marker at (u, v) = ({rest[0]:.4g}, {rest[1]:.4g}) m"


def _frozen(values: FloatArray) -> FloatArray:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def describe_cloth(specimen: Specimen) -> tuple[dict[str, Any], list[AnyArray]]:
    """Lists plain values and arrays that say all of a cloth and its uncertainties, to be hashed; no
    names and files."""
    material = specimen.material
    content: dict[str, Any] = {
        "held": list(specimen.held),
        "stiffness": repr(specimen.stiffness),
        "anchors-told": specimen.anchors_given,
        "gravity": list(specimen.gravity),
        "air": [type(specimen.air).__name__, *vars(specimen.air).items()],
        "material": [material.area_weight, material.damping],
        "density-uncertainty": specimen.area_weight_uncertainty,
    }
    return content, [
        specimen.mesh.rest,
        specimen.mesh.faces,
        specimen.anchors,
        material.stretching,
        material.bending,
    ]
