"""Cycles under the renderers' contract, against the rasteriser and against itself."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from flagdata.errors import NotFoundError
from sim.assets import Assets
from sim.blender import Environment
from sim.blender.environment import SETTING
from sim.render import (
    RENDERERS,
    Cycles,
    Meshes,
    RenderParameters,
    Workbench,
    named_prior,
    plate,
    to_linear,
)

needs_blender = pytest.mark.usefixtures("blender")
SIZE = 96


@pytest.fixture(scope="module")
def cycles(blender: Environment) -> Iterator[Cycles]:
    assert blender.blender.startswith("4.5.")
    with Cycles(Assets()) as renderer:
        yield renderer


def flag(*, frames: int = 1, speed: float = 0.0) -> Meshes:
    """A flag of 1.5 m × 1 m bent into waves, which moves upwards."""
    u, v = np.meshgrid(np.linspace(0, 1, 31), np.linspace(0, 1, 21))
    still = np.stack([1.5 * u, 0.12 * u * np.sin(7 * u + 2 * v), v], axis=-1).reshape(-1, 3)
    at = np.arange(u.size).reshape(u.shape)
    a, b, c, d = (part.ravel() for part in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    rise = speed * np.arange(frames)[:, None] / 25.0
    positions = np.repeat(still[None], frames, axis=0)
    positions[..., 2] += rise
    return Meshes.fixed(
        positions=torch.from_numpy(positions).float(),
        faces=torch.from_numpy(faces),
        uv=torch.from_numpy(np.stack([u, v], axis=-1).reshape(-1, 2)),
        anchor=(0.0, 0.0, 1.0),
    )


def zeta(seed: int, **changes: object) -> RenderParameters:
    drawn = named_prior("flags").draw(seed, Assets())
    return replace(drawn, width=SIZE, height=SIZE, cycles_samples=16, cycles_bounces=1, **changes)


def black(parameters: RenderParameters) -> RenderParameters:
    """Without light: what is darker than the background is cloth or pole."""
    return replace(
        parameters, sun_strength=0.0, sky_strength=0.0, exposure_time=0.0, background="sky/1"
    )


def covered(frames: torch.Tensor) -> torch.Tensor:
    return frames.int().sum(-1) < 30


@needs_blender
@pytest.mark.parametrize("seed", [1, 2, 5])
def test_cycles_and_the_rasteriser_see_the_same_silhouette_and_nearly_the_same_light(
    cycles: Cycles, seed: int
) -> None:
    meshes, parameters = flag(), zeta(seed, exposure_time=0.0)
    raster = RENDERERS["raster"](assets=Assets())
    one, other = (
        covered(renderer.render(meshes, black(parameters))) for renderer in (cycles, raster)
    )
    assert bool(one.any())
    # The project's aim is 0.97 at 300 pixels; at 96 the rim, where half-covered pixels fall either
    # way, weighs more.
    assert float((one & other).sum() / (one | other).sum()) > 0.97
    seen, drawn = (renderer.render(meshes, parameters).float() for renderer in (cycles, raster))
    inside = one & other
    # 16 paths a pixel are noisy, the mean over the cloth is not: within 8 of 255.
    assert float((seen[inside] - drawn[inside]).mean().abs()) < 8
    assert float((seen[~(one | other)] - drawn[~(one | other)]).abs().mean()) < 1


@needs_blender
def test_the_same_arguments_give_the_same_bytes_also_after_a_restart(cycles: Cycles) -> None:
    meshes, parameters = flag(frames=2), zeta(3)
    first = cycles.render(meshes, parameters)
    assert first.shape == (2, SIZE, SIZE, 3)
    assert first.dtype == torch.uint8
    cycles.close()
    assert torch.equal(cycles.render(meshes, parameters), first)


@needs_blender
def test_an_exposure_blurs_along_the_motion(cycles: Cycles) -> None:
    # 10 m/s upwards for 20 ms are 0.2 m, at 5 m and 200 px of focal length some 8 px: an edge that
    # one pixel held is spread over eight.
    meshes = flag(frames=3, speed=10.0)
    still = RenderParameters(
        background="sky/1",
        texture="flag/japan",
        width=SIZE,
        height=SIZE,
        sun_strength=0.0,
        sky_strength=0.0,
        pole_radius=0.0,
        cycles_samples=16,
        cycles_bounces=0,
    )
    behind = torch.from_numpy(plate(Assets().background("sky/1"), still)).mean(-1)
    steepest = []
    for parameters in (still, replace(still, exposure_time=0.02)):
        linear = torch.from_numpy(to_linear(cycles.render(meshes, parameters)[1].numpy())).mean(-1)
        cover = (1 - linear / behind).clamp(0, 1)
        crossed = cover.amax(0) > 0.9
        assert int(crossed.sum()) > SIZE // 3
        steepest.append(float((cover[1:] - cover[:-1]).abs().amax(0)[crossed].median()))
    assert steepest[0] > 0.5
    assert (
        steepest[1] < 0.3
    )  # an eighth for each of the eight pictures, of which two may fall into a row


@needs_blender
def test_workbench_sees_the_same_silhouette() -> None:
    meshes, parameters = flag(), zeta(1, exposure_time=0.0)
    raster = RENDERERS["raster"](assets=Assets())
    with Workbench(Assets()) as workbench:
        seen = workbench.render(meshes, parameters)
    other = covered(raster.render(meshes, black(parameters)))
    plain = raster.render(meshes, replace(parameters, sun_strength=0.0, sky_strength=0.0))
    # Outside of the silhouette both show the background; a pixel of rim is left aside.
    outside = (
        torch.nn.functional.max_pool2d(other[:, None].float(), 5, stride=1, padding=2)[:, 0] == 0
    )
    assert float((seen[outside].float() - plain[outside].float()).abs().max()) <= 1
    assert float((seen.float() - plain.float()).abs().mean()) > 1


def test_without_blender_the_error_says_what_to_do(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv(SETTING, raising=False)
    monkeypatch.setenv("FLAGDATA_CACHE", str(tmp_path))
    with pytest.raises(NotFoundError, match="flagdata blender-setup"):
        Cycles(Assets()).render(flag(), zeta(1))


def test_cycles_is_a_renderer_by_name() -> None:
    assert RENDERERS["cycles"] is Cycles
    assert RENDERERS["workbench"] is Workbench
