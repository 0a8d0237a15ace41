"""Recordings of the base model itself, made with other numerics than the fit's: its errors when it
is right.

Nothing of the fitter's numerics is used: meshes are finer by random factors, half of them
irregular, and steps are shorter by other methods.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace

import numpy as np
import torch

from flagdata.core.arrays import FloatArray
from flagdata.core.provenance import array_hash
from flagdata.core.rng import stream
from flagdata.errors import ErrorKind, FlagdataError
from measure.forecasting.calibrated_parameters import Calibration
from measure.nulls.null_meshes import remesh
from measure.nulls.stiffness import StiffnessFactors
from measure.trajectories.attachment_anchors import carry_attachments
from measure.trajectories.interpolation import onto
from measure.trajectories.trajectory import (
    AttachmentTrack,
    Specimen,
    Trajectory,
    WindTrack,
    describe_cloth,
)
from sim.cloth.anchors import AnchorTracks
from sim.cloth.handles import Handles
from sim.cloth.mesh import Mesh
from sim.cloth.scene import Scene, assemble
from sim.cloth.system import System
from sim.effects import Effect, apply
from sim.integrate import Integrator
from sim.integrate.implicit import BackwardEuler
from sim.integrate.split import SplitEuler
from sim.integrate.symplectic import SAFETY, Symplectic
from sim.run.simulation_loop import Batch, DivergedError, Divergence, after
from sim.wind.sampled import Beyond, Even, SampledWind

# s, before the first frame; a flag of 1.5 m has forgotten a start from rest after two swings
SETTLE = 3.0
_FINER = (1.3, 1.75)
_STEPS = (1e-3, 2e-3)  # s, of backward Euler
_LEVEL = 1e-6  # of the cloth's size: attachments that lie less apart along u are on one vertical
_SAMPLED = 0.05  # s, of winds that blow
CARRIED = 0.01
"""Between samples of the ways of attachments [s]."""
_HALVINGS = 3  # of the step of a run that diverges
_GENTLE = 1e-3  # s of damping: up to it the explicit method is the cheaper one


class FreeRunDivergedError(FlagdataError):
    """Says that the model, run freely, does not stay a cloth."""

    kind = ErrorKind.FREE_RUN_DIVERGED


@dataclass(frozen=True, kw_only=True, eq=False)
class NullBatch:
    """Null recordings that are simulated together, on one mesh by one method.

    Attributes:
        specimen: the cloth, its mesh that of the fit.
        markers: (marker, 2) [m].
        rate: [Hz].
        duration: of each recording [s].
        noise: standard deviation of a marker's coordinate [m].
        calibrations: one a recording.
        speeds: of the wind, along +x, one a recording [m/s].
        winds: that blow in place of steady ones of these speeds, one a recording; none where they
            are steady.
        tracks: of attachments that are carried, one a recording; none where they are held still at
            the anchors.
        seed: of the numerics, the starts and the noise.
        stiffness: how its tables of stiffness differ from the nominal ones.
        effects: what acts beside the base model: none for nulls proper, those named for the floor
            of a larger model.
    """

    specimen: Specimen
    markers: FloatArray
    rate: float
    duration: float
    noise: float
    calibrations: tuple[Calibration, ...]
    speeds: tuple[float, ...]
    seed: int
    stiffness: StiffnessFactors = field(default_factory=StiffnessFactors)
    winds: tuple[WindTrack, ...] = ()
    tracks: tuple[AttachmentTrack, ...] = ()
    effects: tuple[Effect, ...] = ()

    def simulate(self) -> list[Trajectory]:
        """Simulates one recording a calibration."""
        flat, attached = self._mesh()
        tracked = np.einsum(
            "mv,fvcb->fmcb", onto(flat.rest, self.markers), self._frames(flat, attached)
        )
        jitter = self.noise * stream(self.seed, "null", "markers").standard_normal(tracked.shape)
        trajectories = [
            Trajectory(
                name=f"null {self.seed}-{number}",
                markers=self.markers,
                positions=tracked[..., number] + jitter[..., number],
                rate=self.rate,
                wind=wind,
                noise=self.noise,
            )
            for number, wind in enumerate(
                self.winds or [WindTrack.constant((u, 0.0, 0.0)) for u in self.speeds]
            )
        ]
        return (
            [carry_attachments(recording, self.specimen.seats) for recording in trajectories]
            if self.tracks
            else trajectories
        )

    def identity(self) -> str:
        """Hashes all that shapes its recordings, SHA-256."""
        cloth, arrays = describe_cloth(self.specimen)
        del cloth["density-uncertainty"]  # nulls are judged under it, not made by it
        content = cloth | {
            "rate": self.rate,
            "duration": self.duration,
            "noise": self.noise,
            "calibrations": [asdict(own) for own in self.calibrations],
            "speeds": list(self.speeds),
            "seed": self.seed,
            "stiffness": asdict(self.stiffness),
            "effects": [repr(effect) for effect in self.effects],
            "moving": [len(self.winds), len(self.tracks)],
        }
        blown = [part for wind in self.winds for part in (wind.times, wind.velocity)]
        ways = [part for track in self.tracks for part in (track.times, track.places)]
        return array_hash(content, [*arrays, self.markers, *blown, *ways])

    @property
    def effort(self) -> int:
        """About how much work it is, in simulated seconds of all vertices: explicit steps take
        twice as long."""
        integrator, _ = self._method()
        seconds = len(self.speeds) * (SETTLE + self.duration)
        return round(
            seconds
            * self._mesh()[0].vertex_count
            * (2 if isinstance(integrator, Symplectic) else 1)
        )

    def _mesh(self) -> tuple[Mesh, tuple[int, ...]]:
        """Makes a finer mesh in the fit's frame, irregular in half of the draws, and finds its
        vertices nearest to the attachments."""
        rng = stream(self.seed, "null", "mesh")
        fit = self.specimen.mesh
        finer, diagonals = rng.uniform(*_FINER), int(rng.integers(2))
        uneven = rng if rng.random() < 0.5 else None
        flat = remesh(fit, finer=finer, diagonals=diagonals, uneven=uneven)
        nearest = (
            int(np.argmin(np.linalg.norm(flat.rest - fit.rest[vertex], axis=1)))
            for vertex in self.specimen.held
        )
        return flat, tuple(nearest)

    def _frames(self, flat: Mesh, attached: tuple[int, ...]) -> FloatArray:
        """Computes positions (frame, vertex, 3, recording) [m], after the start has been forgotten.

        Cloth that is stretched beyond what a stable step is estimated for diverges; it is run anew
        in smaller steps.

        Raises:
            FlagdataError: it diverges in the smallest steps as well.
        """
        for halvings in range(1 + _HALVINGS):
            with suppress(DivergedError):
                return self._run(flat, attached, *self._method(halvings))
        raise FlagdataError(
            f"a simulation of nulls diverges, even in steps {2**_HALVINGS} times smaller than "
            "usual",
            where=f"{self.calibrations[0]}, stretching × {self.stiffness.stretching:.3g}, winds "
            f"{', '.join(f'{speed:.3g}' for speed in self.speeds)} m/s",
            fix="check the unit of the cloth's stretching (N/m), area weight (kg/m²) and of the "
            "winds (m/s)",
        )

    def as_fitted(self) -> FloatArray:
        """Computes the same by the mesh and the steps of the fit, without noise, (frame, marker, 3,
        recording) [m].

        Raises:
            FreeRunDivergedError: it diverges.
        """
        specimen = self.specimen
        try:
            frames = self._run(specimen.mesh, specimen.held, SplitEuler(), 0.0)
        except DivergedError:
            raise FreeRunDivergedError(
                "a free run of the model diverges",
                where=f"{self.calibrations[0]}",
                fix="check the unit of the cloth's stretching (N/m), area weight (kg/m²) and of "
                "the winds (m/s)",
            ) from None
        return np.einsum("mv,fvcb->fmcb", onto(specimen.mesh.rest, self.markers), frames)

    def _run(
        self, flat: Mesh, attached: tuple[int, ...], integrator: Integrator, damped: float
    ) -> FloatArray:
        """Runs the flags by a method that damps by itself so much [s].

        Raises:
            DivergedError: a position is not finite.
        """
        specimen = self.specimen
        first = np.array([-self._begins])
        begun = [track.at(first)[0] for track in self.tracks] or [specimen.anchors] * len(
            self.speeds
        )
        roughness = 2e-3 * stream(self.seed, "null", "start").standard_normal(
            (len(self.speeds), len(flat.rest), 3)
        )
        scenes = []
        for calibration, rough, speed, anchors in zip(
            self.calibrations, roughness, self.speeds, begun, strict=True
        ):
            position = _hung(flat.rest, specimen.seats, anchors) + rough
            position[list(attached)] = anchors
            material = calibration.material(self.stiffness.of(specimen.material))
            scenes.append(
                Scene(
                    mesh=flat,
                    position=position,
                    gravity=specimen.gravity,
                    air=specimen.air,
                    wind=(speed, 0.0, 0.0),
                    material=replace(material, damping=max(material.damping - damped, 0.0)),
                    handles=Handles(vertices=attached, stiffness=specimen.stiffness),
                )
            )
        system, state = assemble(scenes)
        if self.winds:  # before the effects, of which some change the wind
            system = replace(system, wind=self._blowing(system))
        if self.tracks:
            system = replace(system, motion=self._carrying(system))
        system, state = apply(self.effects, system, state)
        batch = Batch(
            system=system,
            state=state,
            integrator=integrator,
            divergence=Divergence.REFUSE,
            speed_limit=math.inf,
        )
        return batch.positions(after(SETTLE, self.duration, self.rate), self.rate)

    @property
    def _begins(self) -> float:
        """When the recording's first frame is, since the start of the run [s]."""
        return after(SETTLE, self.duration, self.rate).start / self.rate

    def _times(self, period: float) -> FloatArray:
        """Lists times (n,) of a run, so far apart, since the recording's first frame [s]."""
        return (
            np.arange(math.ceil((SETTLE + self.duration) / period) + 2, dtype=np.float64) * period
            - self._begins
        )

    def _blowing(self, system: System) -> SampledWind:
        """Samples the winds since the start of the run."""
        times = self._times(_SAMPLED)
        samples = np.stack([wind.at(times) for wind in self.winds], axis=-1)
        blown = torch.as_tensor(samples, dtype=system.cloth.dtype, device=system.cloth.device)
        even = Even(start=0.0, period=_SAMPLED, count=len(times))
        return SampledWind(times=even, samples=blown, beyond=Beyond.HOLD)

    def _carrying(self, system: System) -> AnchorTracks:
        """Samples the paths of the attachments since the start of the run."""
        places = np.stack([track.at(self._times(CARRIED)) for track in self.tracks], axis=-1)
        moved = torch.as_tensor(
            places - places[0], dtype=system.cloth.dtype, device=system.cloth.device
        )
        return AnchorTracks(start=0.0, period=CARRIED, samples=moved)

    def _method(self, halvings: int = 0) -> tuple[Integrator, float]:
        """Chooses a method for these dampings with steps that were halved so often, and the damping
        it adds by itself [s]."""
        if max(c.damping for c in self.calibrations) <= _GENTLE and not self.effects:
            return Symplectic(safety=SAFETY / 2**halvings), 0.0
        step = _STEPS[stream(self.seed, "null", "method").integers(len(_STEPS))] / 2**halvings
        base = BackwardEuler(step=step, tolerance=1e-4)
        return SplitEuler(base=base) if self.effects else base, step


def _hung(rest: FloatArray, seats: FloatArray, anchors: FloatArray) -> FloatArray:
    """Hangs a plane upright cloth below or beside its anchors (held, 3) [m], turned about the
    vertical as they are, (vertex, 3); one that is held along a vertical stands along +x.

    Args:
        rest, seats: (vertex, 2) of the cloth, (held, 2) of its attachments [m].
    """
    lowest = int(np.argmin(anchors[:, 2]))
    along, (x, y) = (
        seats[:, 0] - seats[:, 0].mean(),
        (anchors[:, :2] - anchors[:, :2].mean(axis=0)).T,
    )
    level = np.ptp(along) > _LEVEL * np.ptp(rest)
    angle = math.atan2(float(along @ y), float(along @ x)) if level else 0.0
    offset = rest - seats[lowest]
    turned = [math.cos(angle) * offset[:, 0], math.sin(angle) * offset[:, 0], offset[:, 1]]
    return anchors[lowest] + np.stack(turned, axis=1)
