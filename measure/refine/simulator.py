"""From points of the search space to films: simulated in one joint batch, then filmed one by one.

Replicates of one θ differ in a start that is a millimetre off, of which nothing is left after the seconds that settle
but another phase of the same motion, in the camera's noise, and in ζ where it is not known.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import torch
from numpy.typing import NDArray

from flagdata.errors import InputError
from flagdata.provenance import canonical, digest
from flagdata.rng import child_seed, stream
from measure.refine.space import DENSITY, WIND, Space
from measure.refine.view import View
from sim.assets import Assets
from sim.material import BENDING_SHAPE
from sim.render import RENDERERS, Meshes
from sim.render.renderer import Renderer
from sim.run.batch import Stepper, run
from sim.run.members import Crew, Member
from sim.run.recipe import Recipe

START_NOISE = 1e-3
"""Standard deviation of the free vertices' start about the flat cloth [m]."""


@dataclass(frozen=True, kw_only=True)
class Request:
    """A film to be made.

    Attributes:
        point: θ in [−1, 1]¹⁷.
        seed: of the start, the camera's noise and, where it is drawn, ζ.
    """

    point: tuple[float, ...]
    seed: int


@dataclass(frozen=True, kw_only=True, eq=False)
class Film:
    """What became of a request.

    Attributes:
        clip: (frame, height, width) uint8 gray; None where the simulation failed.
        seconds: by stage, this film's share of them: "simulate", "render".
    """

    clip: NDArray[np.uint8] | None
    seconds: dict[str, float]


@dataclass(frozen=True)
class Simulator:
    """Simulates and films flags of one scene.

    Attributes:
        recipe: of the scene, with `time` as the network's clips need it; see `of`.
        view: how they are filmed.
        renderer: a name of `sim.render.RENDERERS`.
        batch: flags that are simulated together. Results depend on it in their last bits, so that batches are filled
            up to it.
        assets: textures and backgrounds.
    """

    recipe: Recipe
    view: View
    renderer: str = "raster"
    batch: int = 8
    assets: Assets = field(default_factory=Assets)

    @classmethod
    def of(
        cls, recipe: Recipe, view: View, *, frames: int, rate: float, renderer: str = "raster", batch: int = 8
    ) -> Simulator:
        """A simulator of clips of this length [frames] and rate [Hz].

        Raises:
            InputError: see `Space.of`; fewer than one flag in a batch.
        """
        if batch < 1:
            raise InputError(f"batches of {batch}", fix="take at least one flag")
        Space.of(recipe)
        timed = replace(recipe, time=replace(recipe.time, frames=frames, rate=rate))
        return cls(recipe=timed, view=view, renderer=renderer, batch=batch)

    @cached_property
    def space(self) -> Space:
        return Space.of(self.recipe)

    @property
    def identity(self) -> str:
        """A hash of all that shapes a film beside its request."""
        own = {
            "recipe": self.recipe.identity(), "view": self.view.identity, "renderer": self.renderer,
            "batch": self.batch, "start_noise": START_NOISE, "space": self.space.identity,
        }  # fmt: skip
        return digest(canonical(own))

    def films(self, requests: Sequence[Request]) -> list[Film]:
        """Simulate and film requests, in batches of `batch`."""
        out: list[Film] = []
        for first in range(0, len(requests), self.batch):
            out += self._batch(requests[first : first + self.batch])
        return out

    def _batch(self, requests: Sequence[Request]) -> list[Film]:
        begun = time.perf_counter()
        members = [self._member(request) for request in requests]
        outcomes = run(self._crew, self._stepper, members, size=self.batch)
        share = (time.perf_counter() - begun) / len(requests)
        films: list[Film] = []
        for request, outcome in zip(requests, outcomes, strict=True):
            begun, clip = time.perf_counter(), None
            if outcome.sequence is not None:
                zeta, camera = self.view.at(request.seed)
                with torch.no_grad():
                    seen = self._renderer.render(Meshes.flag(outcome.sequence, heading=0.0), zeta)
                clip = camera.filmed(seen.numpy(), seed=child_seed(request.seed, "camera"))
            films.append(Film(clip=clip, seconds={"simulate": share, "render": time.perf_counter() - begun}))
        return films

    @cached_property
    def _crew(self) -> Crew:
        return Crew(self.recipe)

    @cached_property
    def _stepper(self) -> Stepper:
        return Stepper.of(self._crew)

    @cached_property
    def _template(self) -> Member:
        return Crew(replace(self.recipe, scene=replace(self.recipe.scene, start_noise=0.0))).member(0)

    @cached_property
    def _renderer(self) -> Renderer:
        return RENDERERS[self.renderer](assets=self.assets)

    def _member(self, request: Request) -> Member:
        values = self.space.values(np.array([request.point]))[0]
        scene = self._template.scene
        noise = stream(request.seed, "start").normal(0.0, START_NOISE, scene.position.shape)
        noise[list(scene.handles.vertices)] = 0.0
        material = replace(
            scene.material, density=float(values[DENSITY]), bending=values[:DENSITY].reshape(BENDING_SHAPE)
        )
        flag = replace(scene, position=scene.position + noise, material=material, wind=(float(values[WIND]), 0.0, 0.0))
        return replace(self._template, scene=flag, seed=request.seed, parameters={})
