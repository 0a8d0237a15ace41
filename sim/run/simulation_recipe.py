"""What a recipe says: the scene, what members differ in, how and how long they are simulated.

The form of the file is in `sim.run.simulation_toml`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Annotated, Any

import torch

from flagdata.core.json_values import json_values
from flagdata.core.provenance import canonical, digest
from flagdata.errors import LimitError, UsageError
from flagdata.recipes.retired_names import hashed_name
from flagdata.recipes.typed_tables import Count, Named, NotNegative, Positive, Quantity
from sim.arcsim import ArcsimScene
from sim.cloth.air import AIR_FORCES, AirForce, QuadraticNormal
from sim.cloth.contact import Contact
from sim.cloth.handles import ARCSIM_STIFFNESS
from sim.cloth.limits import StrainLimits
from sim.cloth.material import Material
from sim.cloth.sizing import Remeshing
from sim.cloth.stiffness_tables import Evaluation
from sim.integrate import INTEGRATORS
from sim.integrate.backend import Backend
from sim.integrate.implicit import AirShape
from sim.run.blowing import WindSamples

MEMBERS_LIMIT = 1_000_000
"""Most members of a recipe, and of a batch."""
FRAMES_LIMIT = 10_000_000
"""Most frames of a member, those that settle included."""
VERTICES_LIMIT = 1_000_000
"""Most vertices of a cloth."""
BATCH_BYTES_LIMIT = 64 << 30
"""Most bytes of the positions that a batch keeps."""
DTYPES: Mapping[str, torch.dtype] = {"float32": torch.float32, "float64": torch.float64}


class Shape(StrEnum):
    """What is simulated."""

    FLAG = "flag"
    HANGING_CLOTH = "hanging-cloth"
    ARCSIM = "arcsim"
    MESH = "mesh"
    """A cloth of any outline, held anywhere: its mesh is in the recipe."""


class Attachment(StrEnum):
    """Where it is held."""

    CORNERS = "corners"
    """A flag's two hoist corners, a hanging cloth's two top corners."""
    HOIST = "hoist"
    """All of a flag's hoist."""


@dataclass(frozen=True, kw_only=True)
class GivenCloth:
    """A mesh, where it is held and where it starts.

    Attributes:
        rest: (u, v) of each vertex on the flat cloth [m].
        faces: three vertices each, counter-clockwise.
        held: vertices that are held.
        anchors: (x, y, z) of each of them [m]; the others start flat in the x–z plane, u along x,
            as the lowest anchor has it.
    """

    rest: tuple[tuple[float, float], ...]
    faces: tuple[tuple[int, int, int], ...]
    held: tuple[int, ...]
    anchors: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, kw_only=True)
class SceneSpec:
    """Shape, size and start of the cloth.

    Attributes:
        width, height: [m].
        columns: cells along the width; rows follow from the aspect ratio.
        attachment: where it is held.
        start_noise: standard deviation of the free vertices' start about the flat shape [m].
        evaluation: how the material's tables are read.
        gravity: downward [m/s²].
        stiffness: of the handles on each axis [N/m]; infinite for rigid. An ArcSim scene has its
            own.
        arcsim: the scene file, where the shape is that.
        given: the cloth, where the shape is a mesh.
        content: SHA-256 of its mesh, start, handles and gravity, where it was read from a scene
            file or is given.
    """

    shape: Shape
    width: float
    height: float
    columns: int
    attachment: Attachment
    start_noise: float
    evaluation: Evaluation
    gravity: float
    stiffness: float = ARCSIM_STIFFNESS
    arcsim: ArcsimScene | None = None
    given: GivenCloth | None = None
    content: str = ""

    @property
    def vertices(self) -> float:
        """About how many the mesh will have; endless where one side is as good as none."""
        if self.given is not None:
            return len(self.given.rest)
        if self.arcsim is not None:
            return len(self.arcsim.scene.mesh.rest)
        rows = max(1.0, self.columns * self.height / self.width) if self.width > 0 else math.inf
        return (self.columns + 1) * (rows + 1)


@dataclass(frozen=True, kw_only=True)
class MaterialSpec:
    """A material and what is changed of it.

    Attributes:
        bases: the materials, of which each member draws one.
        area_weight: [kg/m²]; None for the base's.
        area_weight_factor: factor on it.
        stretching: factor on its table.
        bending: factor on its table.
        bending_each: factor drawn for each of the 15 coefficients on its own.
        damping: [s]; None for the base's.
    """

    bases: tuple[Material, ...]
    area_weight: Quantity | None = None
    area_weight_factor: Quantity = 1.0
    stretching: Quantity = 1.0
    bending: Quantity = 1.0
    bending_each: Quantity = 1.0
    damping: Quantity | None = None


@dataclass(frozen=True, kw_only=True)
class WindSpec:
    """The mean wind and its force.

    Attributes:
        speed: [m/s].
        toward: where the air goes to, from +x towards +y [rad]; a flag starts in the y–z plane.
        vertical: upward speed of the air [m/s].
        force: how it pushes.
        samples: what blows in place of a steady wind, whose mean the others then are; None where it
            is steady.
    """

    speed: Quantity
    toward: Quantity = 0.0
    vertical: float = 0.0
    force: AirForce = field(default_factory=QuadraticNormal)
    samples: WindSamples | None = None


@dataclass(frozen=True, kw_only=True)
class IntegratorSpec:
    """A method of `sim.integrate.INTEGRATORS`; `step` None lets the symplectic one take its stable
    step [s].

    `backend` is what computes the steps.
    """

    name: Annotated[str, Named("integrator", INTEGRATORS)] = "symplectic"
    step: Positive | None = None
    air_shape: AirShape = AirShape.CURRENT
    backend: Backend = Backend.AUTO


@dataclass(frozen=True, kw_only=True)
class TimeSpec:
    """What is kept: `frames` at `rate` [Hz] after `settle` [s] that are not."""

    settle: NotNegative = 4.0
    frames: Count = 60
    rate: Positive = 25.0

    @property
    def settling(self) -> int:
        """Frames that are not kept: as many as cover `settle`."""
        return math.ceil(self.settle * self.rate - 1e-9)

    def __post_init__(self) -> None:
        if not self.settle * self.rate + self.frames <= FRAMES_LIMIT:
            raise LimitError(
                f"{self.frames} frames after {self.settle:g} s at {self.rate:g} Hz",
                where="[time]",
                fix=f"have at most {FRAMES_LIMIT} frames in all",
            )

    @property
    def first(self) -> float:
        """When the first frame that is kept is, on the clock of the run [s]."""
        return self.settling / self.rate

    @property
    def total(self) -> int:
        """Frames in all."""
        return self.settling + self.frames


@dataclass(frozen=True, kw_only=True)
class EffectSpec:
    """An effect of `sim.effects.EFFECTS`, its parameters, and for gusts the eddies' length scale
    [m]."""

    parameters: Mapping[str, Quantity]
    length: float | None = None


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """What to simulate.

    Attributes:
        name: what the artifacts are called after.
        count: how many members.
        batch: members that are simulated together.
        contact: as of `sim.cloth.scene.Scene`.
        limits: as of `sim.cloth.scene.Scene`.
        remeshing: as of `sim.cloth.scene.Scene`; its members are simulated one by one.
        precision: of the arithmetic, a name of `DTYPES`.
        model: artifact of the lake that the recipe was read from; empty for none.

    Raises:
        LimitError: more than one of this module's limits.
        UsageError: remeshing of several members in a batch, or with steps that depend on the mesh.
    """

    name: str
    title: str
    seed: int
    count: int
    batch: int
    precision: str
    scene: SceneSpec
    material: MaterialSpec
    wind: WindSpec
    contact: Contact | None
    limits: StrainLimits | None
    remeshing: Remeshing | None
    integrator: IntegratorSpec
    time: TimeSpec
    effects: Mapping[str, EffectSpec]
    model: str = ""

    def __post_init__(self) -> None:
        for counted, number in (("members", self.count), ("members a batch", self.batch)):
            if number > MEMBERS_LIMIT:
                raise LimitError(
                    f"the recipe has {number} {counted}",
                    where=self.name,
                    fix=f"have at most {MEMBERS_LIMIT}",
                )
        vertices = self.scene.vertices
        if self.remeshing is not None:
            self._check_remeshing()
            vertices = max(vertices, self.remeshing.vertices(self.scene.width * self.scene.height))
        if vertices > VERTICES_LIMIT:
            raise LimitError(
                f"the mesh has {vertices:.3g} vertices",
                where=f"{self.name} [scene]",
                fix=f"have at most {VERTICES_LIMIT}: lower columns, or mind the ratio of width and "
                "height",
            )
        size = 12 * vertices * self.time.frames * min(self.batch, self.count)
        if size > BATCH_BYTES_LIMIT:
            raise LimitError(
                f"a batch keeps {size:.3g} bytes of positions",
                where=self.name,
                fix=f"have at most {BATCH_BYTES_LIMIT}: fewer members a batch, frames or columns",
            )

    def _check_remeshing(self) -> None:
        if self.integrator.name != "implicit":
            raise UsageError(
                f"the integrator {self.integrator.name} takes steps that suit one mesh, and "
                "remeshing changes it",
                where=f"{self.name} [remeshing]",
                fix='put name = "implicit" into [integrator]',
            )
        if self.batch != 1:
            raise UsageError(
                f"batches of {self.batch} members are asked for, and with remeshing each has a "
                "mesh of its own",
                where=f"{self.name} [remeshing]",
                fix="leave out batch: such members are simulated one by one",
            )

    @property
    def parents(self) -> tuple[str, ...]:
        """Artifacts of the lake that it was read from: a model, a log."""
        samples = self.wind.samples
        return tuple(
            artifact for artifact in (self.model, samples.artifact if samples else "") if artifact
        )

    @property
    def dtype(self) -> torch.dtype:
        return DTYPES[self.precision]

    def identity(self) -> dict[str, Any]:
        """Returns all that shapes a member besides its index, defaults filled in, as JSON."""
        scene, material, wind = self.scene, self.material, self.wind
        return {
            "simulate": 1,
            "seed": self.seed,
            "precision": self.precision,
            "scene": {
                "shape": scene.shape.value,
                "width": scene.width,
                "height": scene.height,
                "columns": scene.columns,
                "attachment": scene.attachment.value,
                "start_noise": scene.start_noise,
                "evaluation": scene.evaluation.value,
                "gravity": scene.gravity,
                "content": scene.content,
                "left_out": list(scene.arcsim.left_out) if scene.arcsim else [],
                **_stiffness_entry(scene),
            },
            "material": {
                "bases": [_base(base) for base in material.bases],
                hashed_name("area_weight"): json_values(material.area_weight),
                "stretching_factor": json_values(material.stretching),
                "bending_factor": json_values(material.bending),
                "bending_factors": json_values(material.bending_each),
                "damping": json_values(material.damping),
                **_area_weight_factor_entry(material),
            },
            "wind": {
                "speed": json_values(wind.speed),
                "toward": json_values(wind.toward),
                "vertical": wind.vertical,
                "force": _force(wind.force),
                **({} if wind.samples is None else {"samples": wind.samples.content()}),
            },
            "contact": None if self.contact is None else vars(self.contact).copy(),
            **({} if self.limits is None else {"limits": vars(self.limits).copy()}),
            **({} if self.remeshing is None else {"remeshing": vars(self.remeshing).copy()}),
            "integrator": {
                "name": self.integrator.name,
                "step": self.integrator.step,
                "air_shape": self.integrator.air_shape.value,
                **_backend_entry(self.integrator.backend),
            },
            "time": vars(self.time).copy(),
            "effects": {
                name: {
                    **json_values(effect.parameters),
                    **({} if effect.length is None else {"length": effect.length}),
                }
                for name, effect in self.effects.items()
            },
        }


def _backend_entry(backend: Backend) -> dict[str, Any]:
    """Describes the backend where it is not the default: its results differ from the others' by
    rounding."""
    return {} if backend is Backend.AUTO else {"backend": backend.value}


def _stiffness_entry(scene: SceneSpec) -> dict[str, Any]:
    """Describes the handles' stiffness where it is not the usual one."""
    if scene.stiffness == ARCSIM_STIFFNESS:
        return {}
    return {"stiffness": "rigid" if math.isinf(scene.stiffness) else scene.stiffness}


def _area_weight_factor_entry(material: MaterialSpec) -> dict[str, Any]:
    """Describes the factor on the area weight, where there is one."""
    factor = material.area_weight_factor
    return {} if factor == 1.0 else {hashed_name("area_weight_factor"): json_values(factor)}


def _base(base: Material) -> dict[str, Any]:
    tables = {"stretching": base.stretching.tolist(), "bending": base.bending.tolist()}
    return {
        "name": base.name,
        hashed_name("area_weight"): base.area_weight,
        "damping": base.damping,
        "tables": digest(canonical(tables)),
    }


def _force(force: AirForce) -> dict[str, Any]:
    name = next(
        (candidate for candidate in AIR_FORCES if isinstance(force, AIR_FORCES[candidate])),
        type(force).__name__,
    )
    return {"name": name, **vars(force)}
