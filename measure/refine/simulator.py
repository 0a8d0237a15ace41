"""From points of the search space to films: simulated in joint batches, then filmed and conditioned
one by one.

A film that is measured is conditioned before anything is judged (`models.conditioning`). So what is
compared with it is filmed by the target's view and then conditioned by the same code, which frames
its flag as it frames the target's.

Replicates of one θ differ in a start that is a millimetre off, of which nothing is left after the
seconds that settle but another phase of the same motion, in the camera's noise, in ζ where it is
not known, and in the internal damping: nobody knows that of a cloth which is filmed, and steps of
an integrator damp by themselves. So they take turns at scenes which differ in their integrator, and
each draws its damping where its scene has a range of it.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import torch

from flagdata.core.arrays import UInt8Array
from flagdata.core.provenance import canonical, digest
from flagdata.core.rng import child_seed, stream
from flagdata.errors import InputError
from flagdata.recipes.typed_tables import Range
from measure.refine.space import AREA_WEIGHT_COLUMN, WIND_COLUMN, Space
from measure.refine.target_view import View
from models.conditioning.conditioning import VERSION
from models.training.conditioned_clips import FitFilm
from sim.assets import Assets
from sim.cloth.material import BENDING_SHAPE
from sim.cloth.scene import roughen_start
from sim.render import RENDERERS, Meshes
from sim.render.renderer import Renderer
from sim.run.member_batch import Stepper, run
from sim.run.members import Crew, Member
from sim.run.simulation_recipe import Recipe

START_NOISE = 1e-3
"""Standard deviation of the free vertices' start about the flat cloth [m]."""


@dataclass(frozen=True, kw_only=True)
class FilmRequest:
    """A film to be made.

    Attributes:
        point: θ in [−1, 1]¹⁷.
        seed: of the start, the damping, the camera's noise and, where it is drawn, ζ.
        replicate: its number, which says whose turn it is among the scenes.
    """

    point: tuple[float, ...]
    seed: int
    replicate: int = 0


@dataclass(frozen=True, kw_only=True, eq=False)
class SimulatedFilm:
    """What became of a request.

    Attributes:
        clip: (frame, height, width) uint8 gray, conditioned; None where the simulation failed.
        seconds: by stage, this film's share of them: "simulate", "render", which includes filming
            and conditioning.
    """

    clip: UInt8Array | None
    seconds: dict[str, float]


@dataclass(frozen=True)
class Simulator:
    """Simulates and films flags of one space.

    Attributes:
        scenes: that replicates take turns at, with `time` as the network's clips need it; see `of`.
        view: how they are filmed.
        renderer: a name of `sim.render.RENDERERS`.
        batch: flags that are simulated together. Results depend on it in their last bits, so that
            batches are filled up to it. Several scenes share it.
        assets: textures and backgrounds.
    """

    scenes: tuple[SimulatedScene, ...]
    view: View
    renderer: str = "raster"
    batch: int = 8
    assets: Assets = field(default_factory=Assets)

    @classmethod
    def of(
        cls,
        recipes: Recipe | Sequence[Recipe],
        view: View,
        *,
        frames: int,
        rate: float,
        renderer: str = "raster",
        batch: int = 8,
    ) -> Simulator:
        """Makes a simulator of clips of this length [frames] and rate [Hz].

        Args:
            recipes: a scene's, or those of several scenes of one space.

        Raises:
            InputError: see `Space.of`; scenes of different spaces, or none; fewer than one flag in
                a batch.
        """
        if batch < 1:
            raise InputError(f"the batches are of {batch}", fix="take at least one flag")
        several = (recipes,) if isinstance(recipes, Recipe) else tuple(recipes)
        spaces = {Space.of(recipe).identity for recipe in several}
        if len(spaces) != 1:
            raise InputError(
                f"{len(several)} scenes have {len(spaces)} different search spaces",
                fix="give scenes of the same ranges",
            )
        scenes = tuple(
            SimulatedScene(replace(recipe, time=replace(recipe.time, frames=frames, rate=rate)))
            for recipe in several
        )
        return cls(scenes=scenes, view=view, renderer=renderer, batch=batch)

    @cached_property
    def space(self) -> Space:
        return self.scenes[0].space

    @property
    def aspect(self) -> float:
        """Length over height of the flags."""
        scene = self.scenes[0].recipe.scene
        return scene.width / scene.height

    @property
    def draws_damping(self) -> bool:
        """Whether the damping differs among replicates."""
        return any(isinstance(scene.recipe.material.damping, Range) for scene in self.scenes)

    @property
    def identity(self) -> str:
        """Hashes all that shapes a film beside its request."""
        ingredients = {
            "recipes": [scene.recipe.identity() for scene in self.scenes],
            "view": self.view.identity,
            "renderer": self.renderer,
            "batch": self.batch,
            "start_noise": START_NOISE,
            "space": self.space.identity,
            "conditioning": VERSION,
        }
        return digest(canonical(ingredients))

    def films(self, requests: Sequence[FilmRequest]) -> list[SimulatedFilm]:
        """Simulates, films and conditions requests, those of each scene in batches."""
        size = -(-self.batch // len(self.scenes))
        films_made: dict[int, SimulatedFilm] = {}
        for number, scene in enumerate(self.scenes):
            of_scene = [
                index
                for index, request in enumerate(requests)
                if request.replicate % len(self.scenes) == number
            ]
            for first in range(0, len(of_scene), size):
                part = of_scene[first : first + size]
                films_made |= zip(
                    part,
                    self._batch(scene, [requests[index] for index in part], size=size),
                    strict=True,
                )
        return [films_made[index] for index in range(len(requests))]

    def _batch(
        self, scene: SimulatedScene, requests: Sequence[FilmRequest], *, size: int
    ) -> list[SimulatedFilm]:
        begun = time.perf_counter()
        outcomes = run(
            scene.crew, scene.stepper, [scene.member(request) for request in requests], size=size
        )
        share = (time.perf_counter() - begun) / len(requests)
        films: list[SimulatedFilm] = []
        for request, outcome in zip(requests, outcomes, strict=True):
            begun, clip = time.perf_counter(), None
            if outcome.sequence is not None:
                zeta, camera = self.view.at(request.seed)
                with torch.no_grad():
                    rendered = self._renderer.render(
                        Meshes.flag(outcome.sequence, heading=0.0), zeta
                    )
                filmed = camera.filmed(rendered.numpy(), seed=child_seed(request.seed, "camera"))
                clip = FitFilm.of(filmed, np.arange(len(filmed)) / scene.recipe.time.rate).frames
            films.append(
                SimulatedFilm(
                    clip=clip, seconds={"simulate": share, "render": time.perf_counter() - begun}
                )
            )
        return films

    @cached_property
    def _renderer(self) -> Renderer:
        return RENDERERS[self.renderer](assets=self.assets)


@dataclass(frozen=True, eq=False)
class SimulatedScene:
    """A scene's recipe, and what is made of it once."""

    recipe: Recipe

    @cached_property
    def space(self) -> Space:
        return Space.of(self.recipe)

    @cached_property
    def crew(self) -> Crew:
        return Crew(self.recipe)

    @cached_property
    def stepper(self) -> Stepper:
        return Stepper.of(self.crew)

    def member(self, request: FilmRequest) -> Member:
        """Makes the flag of a request."""
        values = self.space.values(np.array([request.point]))[0]
        scene = self._template.scene
        start = roughen_start(
            scene.position, scene.handles, stream(request.seed, "start"), START_NOISE
        )
        damping = self.recipe.material.damping
        material = replace(
            scene.material,
            area_weight=float(values[AREA_WEIGHT_COLUMN]),
            bending=values[:AREA_WEIGHT_COLUMN].reshape(BENDING_SHAPE),
            damping=(
                damping.at(stream(request.seed, "damping").random())
                if isinstance(damping, Range)
                else scene.material.damping
            ),
        )
        flag = replace(
            scene, position=start, material=material, wind=(float(values[WIND_COLUMN]), 0.0, 0.0)
        )
        return replace(self._template, scene=flag, seed=request.seed, parameters={})

    @cached_property
    def _template(self) -> Member:
        return Crew(replace(self.recipe, scene=replace(self.recipe.scene, start_noise=0.0))).member(
            0
        )
