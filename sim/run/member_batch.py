"""A batch of members through time: frames kept, energies noted, members that fail taken out.

What is measured of every member on the way: energies, strain, and whether its shape can be
believed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import Float32Array, FloatArray, IntArray
from flagdata.errors import LimitError
from flagdata.lake.mesh_sequences import MeshSequence, RaggedMeshSequence
from flagdata.timebase import NANOSECONDS
from sim.cloth import membrane
from sim.cloth.cloth_batch import Cloth
from sim.cloth.mesh import Mesh
from sim.cloth.state import State
from sim.cloth.system import System
from sim.integrate import Integrator
from sim.integrate.backend import Backend
from sim.integrate.implicit import BackwardEuler
from sim.integrate.stability import stiffest
from sim.integrate.symplectic import Symplectic, advance
from sim.kernel_warp.warp_batch import WarpKernel
from sim.run.members import Crew, Member, Parameter
from sim.run.simulation_loop import Batch, Divergence
from sim.run.simulation_recipe import Recipe

CRUMPLED = 0.2
"""Root mean square compression of the faces beyond which a sheet has crumpled. Cloth gives way to
compression by buckling, so that its faces keep their area: flags of 12 and 30 columns in 0 to 10
m/s, at 0.12 and 0.284 kg/m², have at most 0.11 with the declared damping of 0.25 ms once they have
settled, and at most 0.15 in the first frames.

Without damping a sheet with a measured stretching table becomes a ball of noise, at 0.43 to 0.52.
It is not the step's
doing: as in the reference simulator, the force takes the table's stiffness at each strain as if it
were constant, so that it derives from no energy, and gives some in every cycle. (12 columns without
air: from 3 J at 0.6 s to 390 J at 2.4 s. In 4 m/s of wind the compression passes 0.3 within 1.2 s
in the automatic step, half of it and a quarter. With constant stiffness it stays at 0.02.) The
declared damping takes more than the tables give. In the ball faces are stretched to twice their
length and stiffer than the 15 % that the stable step is estimated for: in the automatic step most
such sheets diverge within a second or two more, in half of it none. Both are reported and not
stored."""
_LATE = 4
"""Share of the kept frames that is looked at, the last quarter: starts are rough, and no sheet
uncrumples."""


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """Diagnostics of one member.

    Attributes:
        energies: name → value at each kept frame [J]: kinetic, stretching, bending, gravity, and
            where there are such, handles, contact.
        largest_strain: at each kept frame, the largest principal stretch of any face, less 1.
        compression: at each kept frame, how much faces are compressed, root mean square (see
            `CRUMPLED`).
    """

    energies: Mapping[str, tuple[float, ...]]
    largest_strain: tuple[float, ...]
    compression: tuple[float, ...]

    @property
    def is_crumpled(self) -> bool:
        """Whether the sheet is a ball of noise at the end."""
        return self.late_compression > CRUMPLED

    @property
    def late_compression(self) -> float:
        """Mean over the last quarter of the kept frames."""
        late = self.compression[-max(1, len(self.compression) // _LATE) :]
        return math.fsum(late) / len(late)

    def summary(self) -> dict[str, Any]:
        """Means over the kept frames, and the largest strain of all, as JSON."""
        means = {name: math.fsum(values) / len(values) for name, values in self.energies.items()}
        return {
            "mean_energies": means,
            "largest_strain": max(self.largest_strain),
            "late_compression": self.late_compression,
        }


@dataclass
class Monitor:
    """Collects diagnoses of a batch, frame by frame."""

    energies: list[dict[str, Tensor]] = field(default_factory=list)
    strains: list[Tensor] = field(default_factory=list)
    compressions: list[Tensor] = field(default_factory=list)

    def look(self, system: System, state: State) -> None:
        """Take note of a kept frame."""
        self.energies.append({name: value.cpu() for name, value in system.energies(state).items()})
        strains = principal_strains(system.cloth, state.position)
        self.strains.append(strains.amax((0, 1)).cpu())
        self.compressions.append((strains[:, 0].clamp(max=0) ** 2).mean(0).sqrt().cpu())

    def of(self, member: int) -> Diagnosis:
        """Returns the diagnosis of the member at an index of the batch."""
        names = self.energies[0] if self.energies else {}
        return Diagnosis(
            energies={name: tuple(float(e[name][member]) for e in self.energies) for name in names},
            largest_strain=tuple(float(s[member]) for s in self.strains),
            compression=tuple(float(c[member]) for c in self.compressions),
        )


def principal_strains(cloth: Cloth, position: Tensor) -> Tensor:
    """Computes principal stretches less 1: (face, 2, batch), the smaller first."""
    e = membrane.strain(cloth, position)
    c00, c11, c01 = 2 * e.g00 + 1, 2 * e.g11 + 1, 2 * e.g01
    middle, half = (c00 + c11) / 2, (((c00 - c11) / 2) ** 2 + c01**2).sqrt()
    return torch.stack([middle - half, middle + half], dim=1).clamp(min=0).sqrt() - 1


STEPS_LIMIT = 100_000
"""Most steps of a frame."""


@dataclass(frozen=True, kw_only=True)
class BatchOutcome:
    """What became of a member.

    Attributes:
        member: which.
        sequence: its meshes; None where it failed.
        wind: (frame, 3) undisturbed air at each kept frame, where it goes to [m/s].
        diagnosis: what was measured on the way.
        failure: kind and sentence, where it failed.
    """

    member: Member
    sequence: MeshSequence | RaggedMeshSequence | None
    wind: FloatArray
    diagnosis: Diagnosis
    failure: tuple[str, str] | None = None


@dataclass(frozen=True, kw_only=True)
class Stepper:
    """Advances batches by frames, in steps that depend on the recipe and a material of it, not on
    what members drew.

    Attributes:
        method: None for the explicit method in `steps` equal steps a frame.
        steps: of a frame.
    """

    recipe: Recipe
    method: Integrator | None
    steps: int

    def __post_init__(self) -> None:
        if self.steps > STEPS_LIMIT:
            raise LimitError(
                f"a stable simulation needs {self.steps:.3g} steps a frame",
                where="recipe [integrator]",
                fix=f"at most {STEPS_LIMIT} are taken: let the cells be larger, or the cloth "
                "softer or heavier",
            )

    @classmethod
    def of(cls, crew: Crew, base: int = 0) -> Stepper:
        """Chooses the method and the steps of a recipe for the members of the material at an index.

        Raises:
            UsageError: a forced step beyond the stability limit of a member at the ends of the
                recipe's ranges; a backend that cannot run such a member.
            InputError: no step is stable.
            LimitError: more than `STEPS_LIMIT` steps a frame.
        """
        recipe, spec = crew.recipe, crew.recipe.integrator
        frame = 1 / recipe.time.rate
        if spec.name == "implicit":
            step = spec.step or 5e-3
            method = BackwardEuler(step=step, air_shape=spec.air_shape, backend=spec.backend)
            return cls(recipe=recipe, method=method, steps=max(1, math.ceil(frame / step - 1e-9)))
        system, _ = crew.corners(base)
        if spec.backend is Backend.WARP:
            WarpKernel.of(system)
        with torch.no_grad():
            return cls(
                recipe=recipe, method=None, steps=Symplectic(step=spec.step).steps(system, frame)
            )

    @property
    def step(self) -> float:
        """[s]."""
        return 1 / self.recipe.time.rate / self.steps

    def advance(self, system: System, state: State, duration: float) -> State:
        """Returns the state one frame of `duration` [s] later."""
        if self.method is not None:
            return self.method.advance(system, state, duration)
        return advance(
            system, state, duration, steps=self.steps, backend=self.recipe.integrator.backend
        )

    def unstable(self, system: System) -> Tensor:
        """Returns whether each member's stability limit is below the step, (batch,)."""
        if self.method is not None:
            return torch.zeros(system.cloth.batch, dtype=torch.bool)
        damping = system.cloth.damping
        limit = (damping**2 + 4 / stiffest(system)).sqrt() - damping
        return (limit <= self.step).cpu()


def run(
    crew: Crew,
    stepper: Stepper,
    members: Sequence[Member],
    *,
    size: int,
    device: torch.device | str = "cpu",
    progress: Callable[[int], object] | None = None,
) -> list[BatchOutcome]:
    """Simulates members of one material together.

    The batch always has `size` members, the last repeated as often as it takes: results then depend
    on a member and the size alone, to the last bit.

    Args:
        progress: called with 1 after each frame, settling included.
    """
    # A full batch, whatever the number of members.
    filled = [*members, *[members[-1]] * (size - len(members))]
    time = crew.recipe.time
    system, state = crew.assemble(filled, device=device)
    batch = Batch(system=system, state=state, integrator=stepper, divergence=Divergence.RESTART)
    monitor, frames, winds = Monitor(), [], []
    meshes: list[Mesh] = []
    with torch.no_grad():
        unstable = torch.nonzero(stepper.unstable(system)).flatten().tolist()
        for frame, state in enumerate(batch.states(range(time.total), time.rate)):
            if frame >= time.settling:
                monitor.look(batch.system, state)
                meshes.append(batch.system.cloth.mesh)
                frames.append(state.position.to("cpu", torch.float32).numpy())
                winds.append(
                    system.wind.velocity(state.time).expand(3, size).double().cpu().numpy()
                )
            if progress is not None:
                progress(1)
    # Why members failed, and sequences of those that did not.
    failures = dict.fromkeys(
        unstable, ("unstable-step", f"its stable step is below the recipe's, {stepper.step:.3g} s")
    )
    failures |= {
        index: ("diverged", f"it diverged before {last_good:.3f} s")
        for index, last_good in batch.diverged.items()
    }
    velocities = np.stack(winds)
    instants = [round((time.settling + i) / time.rate * NANOSECONDS) for i in range(time.frames)]
    outcomes: list[BatchOutcome] = []
    for index, member in enumerate(members):
        diagnosis = monitor.of(index)
        failure = failures.get(index) or _crumpled_reason(diagnosis)
        sequence = None
        if failure is None:
            sequence = _sequence(
                np.array(instants, dtype=np.int64),
                meshes,
                [frame[..., index] for frame in frames],
                _attributes(crew, stepper, member, diagnosis, velocities[..., index]),
            )
        outcomes.append(
            BatchOutcome(
                member=member,
                sequence=sequence,
                wind=velocities[..., index],
                diagnosis=diagnosis,
                failure=failure,
            )
        )
    return outcomes


def _sequence(
    time: IntArray,
    meshes: Sequence[Mesh],
    positions: Sequence[Float32Array],
    attributes: Mapping[str, Any],
) -> MeshSequence | RaggedMeshSequence:
    """Puts frames together at their times [ns], with the mesh and the positions (vertex, 3) [m] of
    each."""
    if all(mesh is meshes[0] for mesh in meshes):
        return MeshSequence(
            time=time,
            positions=np.stack(positions),
            faces=meshes[0].faces.astype(np.int32),
            rest=meshes[0].rest.astype(np.float32),
            attributes=attributes,
        )
    return RaggedMeshSequence(
        time=time,
        positions=np.concatenate(positions),
        faces=np.concatenate([mesh.faces for mesh in meshes]).astype(np.int32),
        rest=np.concatenate([mesh.rest for mesh in meshes]).astype(np.float32),
        vertex_offset=np.cumsum([0, *(mesh.vertex_count for mesh in meshes)]),
        face_offset=np.cumsum([0, *(len(mesh.faces) for mesh in meshes)]),
        attributes=attributes,
    )


def _crumpled_reason(diagnosis: Diagnosis) -> tuple[str, str] | None:
    if not diagnosis.is_crumpled:
        return None
    rate = f"{diagnosis.late_compression:.0%} (root mean square)"
    return "crumpled", f"it crumpled: its faces are compressed by {rate}; declare more damping"


def _attributes(
    crew: Crew, stepper: Stepper, member: Member, diagnosis: Diagnosis, wind: FloatArray
) -> dict[str, Any]:
    """Returns what a sequence says of itself, also outside the lake; the wind where its recipe
    gives samples of it."""
    return {
        "source": "flagdata simulate",
        "recipe": crew.recipe.name,
        "index": member.index,
        "seed": member.seed,
        "parameters": {name: _plain(value) for name, value in member.parameters.items()},
        "step": stepper.step,
        "energies": {name: list(values) for name, values in diagnosis.energies.items()},
        "largest_strain": list(diagnosis.largest_strain),
        "compression": list(diagnosis.compression),
        **({} if crew.recipe.wind.samples is None else {"wind": wind.tolist()}),
    }


def _plain(value: Parameter) -> float | str | list[float]:
    return list(value) if isinstance(value, tuple) else value
