"""The members of a recipe: what each draws from its own named streams, and the batch that some of
them form."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np
import torch

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import child_seed, stream
from flagdata.recipes.retired_names import hashed_key
from flagdata.recipes.typed_tables import Quantity, Range, ends
from sim.cloth import handles as held
from sim.cloth.handles import Handles
from sim.cloth.material import BENDING_SHAPE, Material
from sim.cloth.mesh import Mesh, grid
from sim.cloth.scene import Scene, assemble, roughen_start, upright
from sim.cloth.state import State
from sim.cloth.system import System
from sim.effects import EFFECTS, Effect, apply
from sim.effects.gusts import Gusts
from sim.run.simulation_recipe import Attachment, EffectSpec, MaterialSpec, Recipe, SceneSpec, Shape

Parameter: TypeAlias = float | str | tuple[float, ...]
_GUST_RATE = 10.0  # Hz; the run is linear between samples
_CALM = 0.01  # m/s; winds below it carry no eddies past within a run


@dataclass(frozen=True, kw_only=True)
class Member:
    """One simulation of a recipe.

    Attributes:
        index: 0, 1, … within the recipe.
        seed: of its own streams; follows from the recipe's seed and the index.
        base: place of its material among the recipe's.
        scene: what is simulated.
        parameters: what it drew and what was fixed, by name, SI; for the catalog.
        effects: name → parameter → value.
    """

    index: int
    seed: int
    base: int
    scene: Scene
    parameters: Mapping[str, Parameter]
    effects: Mapping[str, Mapping[str, float]]

    @property
    def wind_speed(self) -> float:
        """Horizontal speed of the mean wind [m/s]."""
        return math.hypot(*self.scene.wind[:2])


@dataclass(frozen=True)
class Crew:
    """Makes the members of one recipe, on one mesh."""

    recipe: Recipe

    @cached_property
    def mesh(self) -> Mesh:
        spec = self.recipe.scene
        if spec.arcsim is not None:
            return spec.arcsim.scene.mesh
        if spec.given is not None:
            return Mesh(rest=np.array(spec.given.rest), faces=np.array(spec.given.faces))
        rows = max(1, round(spec.columns * spec.height / spec.width))
        return grid(width=spec.width, height=spec.height, columns=spec.columns, rows=rows)

    @cached_property
    def handles(self) -> Handles:
        spec = self.recipe.scene
        if spec.arcsim is not None:
            return spec.arcsim.scene.handles
        return Handles(vertices=self._anchor_vertices(spec), stiffness=spec.stiffness)

    def _anchor_vertices(self, spec: SceneSpec) -> tuple[int, ...]:
        if spec.given is not None:
            return spec.given.held
        if spec.shape is Shape.HANGING_CLOTH:
            return held.top_corners(self.mesh.rest)
        hoist = spec.attachment is Attachment.HOIST
        return held.full_hoist(self.mesh.rest) if hoist else held.corners(self.mesh.rest)

    def seed(self, index: int) -> int:
        """Returns the seed of a member."""
        return child_seed(self.recipe.seed, "member", index)

    def base(self, index: int) -> int:
        """Draws which of the recipe's materials a member has, as an index."""
        return int(
            stream(self.seed(index), "material", "names").random() * len(self.recipe.material.bases)
        )

    def member(self, index: int) -> Member:
        """Draws a member, which depends on the recipe's seed and the index alone.

        Raises:
            InputError: what it drew makes no scene.
        """
        seed = self.seed(index)

        def drawn(quantity: Quantity, *path: str) -> float:
            return (
                quantity.at(stream(seed, *path).random())
                if isinstance(quantity, Range)
                else quantity
            )

        spec, wind = self.recipe.material, self.recipe.wind
        material_index = self.base(index)
        base = spec.bases[material_index]
        factors = _factors(
            spec, stream(seed, "material", "bending-factors").random(math.prod(BENDING_SHAPE))
        )
        material = _material(
            base,
            area_weight=drawn(
                _of(spec.area_weight, base.area_weight), "material", hashed_key("area-weight")
            )
            * drawn(spec.area_weight_factor, "material", hashed_key("area-weight-factor")),
            stretching=drawn(spec.stretching, "material", "stretching-factor"),
            bending=drawn(spec.bending, "material", "bending-factor") * factors,
            damping=drawn(_of(spec.damping, base.damping), "material", "damping"),
        )
        speed, toward = drawn(wind.speed, "wind", "speed"), drawn(wind.toward, "wind", "toward")
        effects = {
            name: {
                key: drawn(value, "effects", name, key) for key, value in effect.parameters.items()
            }
            for name, effect in self.recipe.effects.items()
        }
        scene = Scene(
            mesh=self.mesh,
            position=self._start(seed),
            material=material,
            handles=self.handles,
            wind=(speed * math.cos(toward), speed * math.sin(toward), wind.vertical),
            gravity=_gravity(self.recipe.scene),
            air=wind.force,
            evaluation=self.recipe.scene.evaluation,
            contact=self.recipe.contact,
            limits=self.recipe.limits,
            remeshing=self.recipe.remeshing,
        )
        parameters: dict[str, Parameter] = {
            "material": base.name,
            "wind_speed": speed,
            "wind_toward": toward,
            "wind_vertical": wind.vertical,
            "area_weight": material.area_weight,
            "damping": material.damping,
            "stretching": tuple(material.stretching.ravel().tolist()),
            "bending": tuple(material.bending.ravel().tolist()),
        }
        parameters |= {
            f"{name}.{key}": value
            for name, chosen in effects.items()
            for key, value in chosen.items()
        }
        return Member(
            index=index,
            seed=seed,
            base=material_index,
            scene=scene,
            parameters=parameters,
            effects=effects,
        )

    def assemble(
        self, members: Sequence[Member], *, device: torch.device | str = "cpu"
    ) -> tuple[System, State]:
        """Assembles the batch of these members with their effects, and its start.

        Raises:
            UsageError: an effect that does not fit.
        """
        system, state = assemble([m.scene for m in members], dtype=self.recipe.dtype, device=device)
        samples = self.recipe.wind.samples
        if samples is not None:
            system = replace(
                system, wind=samples.wind(self.recipe.time.first, len(members), system.anchors)
            )
        return apply([self._effect(name, members) for name in self.recipe.effects], system, state)

    def corners(self, material_index: int) -> tuple[System, State]:
        """Assembles members of a material at the ends of all ranges: a step that suits them suits
        all members."""
        spec, wind = self.recipe.material, self.recipe.wind
        stiffest = np.full(BENDING_SHAPE, ends(spec.bending)[1] * ends(spec.bending_each)[1])
        members: list[Member] = []
        base = spec.bases[material_index]
        for end in (0, 1):
            material = _material(
                base,
                area_weight=ends(_of(spec.area_weight, base.area_weight))[0]
                * ends(spec.area_weight_factor)[0],
                damping=ends(_of(spec.damping, base.damping))[1],
                stretching=ends(spec.stretching)[1],
                bending=stiffest,
            )
            scene = Scene(
                mesh=self.mesh,
                position=self._start(0),
                material=material,
                handles=self.handles,
                air=wind.force,
                evaluation=self.recipe.scene.evaluation,
                contact=self.recipe.contact,
                limits=self.recipe.limits,
            )
            effects = {
                name: {key: ends(value)[end] for key, value in effect.parameters.items()}
                for name, effect in self.recipe.effects.items()
            }
            members.append(
                Member(
                    index=end,
                    seed=0,
                    base=material_index,
                    scene=scene,
                    parameters={},
                    effects=effects,
                )
            )
        return self.assemble(members)

    def _start(self, seed: int) -> FloatArray:
        spec = self.recipe.scene
        flat = self._flat(spec)
        return (
            roughen_start(flat, self.handles, stream(seed, "start"), spec.start_noise)
            if spec.start_noise
            else flat
        )

    def _flat(self, spec: SceneSpec) -> FloatArray:
        """Returns where the cloth starts, before its noise, (vertex, 3) [m]."""
        if spec.arcsim is not None:
            return spec.arcsim.scene.position
        if spec.given is None:
            return upright(self.mesh)
        anchors, vertices = np.array(spec.given.anchors), list(spec.given.held)
        lowest = int(anchors[:, 2].argmin())
        along = self.mesh.rest - self.mesh.rest[vertices[lowest]]
        flat = anchors[lowest] + np.stack([along[:, 0], 0 * along[:, 0], along[:, 1]], axis=1)
        flat[vertices] = anchors
        return flat

    def _effect(self, name: str, members: Sequence[Member]) -> Effect:
        values = {
            key: torch.tensor(
                [member.effects[name][key] for member in members], dtype=torch.float64
            )
            for key in self.recipe.effects[name].parameters
        }
        effect = EFFECTS[name](**values)
        if isinstance(effect, Gusts):
            return self._gusty(effect, self.recipe.effects[name], members)
        return effect

    def _gusty(self, effect: Gusts, spec: EffectSpec, members: Sequence[Member]) -> Gusts:
        """Draws each member's gusts from its own stream, whatever the others draw."""
        time = self.recipe.time
        duration = max(time.settle + (time.frames + 1) / time.rate, 2 / _GUST_RATE)
        series: list[Gusts] = []
        for member in members:
            speed = member.wind_speed
            series.append(
                effect.with_series(
                    stream(member.seed, "effects", "gusts", "series"),
                    batch=1,
                    speed=max(speed, _CALM),
                    length=spec.length or 0.0,
                    duration=duration,
                    rate=_GUST_RATE,
                )
            )
        return replace(
            effect, times=series[0].times, samples=torch.cat([s.samples for s in series], dim=-1)
        )


def _of(quantity: Quantity | None, default: float) -> Quantity:
    return default if quantity is None else quantity


def _factors(spec: MaterialSpec, shares: FloatArray) -> FloatArray:
    quantity = spec.bending_each
    values = [
        quantity.at(share) if isinstance(quantity, Range) else quantity for share in shares.tolist()
    ]
    return np.array(values).reshape(BENDING_SHAPE)


def _material(
    base: Material, *, area_weight: float, stretching: float, bending: FloatArray, damping: float
) -> Material:
    return replace(
        base,
        area_weight=area_weight,
        damping=damping,
        stretching=base.stretching * stretching,
        bending=base.bending * bending,
    )


def _gravity(spec: SceneSpec) -> tuple[float, float, float]:
    return spec.arcsim.scene.gravity if spec.arcsim is not None else (0.0, 0.0, -spec.gravity)
