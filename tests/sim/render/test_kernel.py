"""The compiled kernel against torch, exact coverage, and what happens without a compiler."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from sim import compiler as build
from sim.render import raster_kernel
from sim.render.coverage import Triangles, fragments
from sim.render.develop import develop
from tests.sim.render.conftest import camera_of, look
from tests.sim.render.pieces import meshes, sheet


@pytest.fixture
def no_compiler(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(build, "compiler", lambda: None)
    raster_kernel.library.cache_clear()
    yield
    raster_kernel.library.cache_clear()


def crumpled(seed: int, *, cells: int = 9):
    """A sheet with folds in all directions, in two frames."""
    rng = np.random.default_rng(seed)
    position, faces, uv = sheet(side=1.6, cells=cells)
    for _ in range(4):
        wave = np.sin(uv @ rng.uniform(-12, 12, 2) + rng.uniform(0, 6))
        position = position + 0.08 * wave[:, None] * rng.normal(size=3)
    return meshes((position, faces, uv), moves=np.array([[0.0, 0.0, 0.0], [0.05, -0.1, 0.02]]))


@pytest.mark.parametrize(
    ("seed", "cells", "changes"),
    [
        (1, 9, {"sun_softness": 0.0, "pole_radius": 0.05}),
        (2, 9, {"sun_softness": 4.0, "exposure_time": 0.02, "translucency": 0.4}),
        (
            3,
            9,
            {
                "width": 213,
                "height": 97,
                "camera_angle": -0.7,
                "camera_height": 1.5,
                "pole_radius": 0.05,
            },
        ),
        (
            4,
            2,
            {"width": 300, "height": 300, "camera_radius": 2.5},
        ),  # faces too large for narrow arithmetic
    ],
)
def test_the_kernel_makes_the_bytes_that_torch_makes(monkeypatch, seed, cells, changes) -> None:
    if raster_kernel.library() is None:
        pytest.skip("no C++ compiler")
    rng = np.random.default_rng(seed)
    picture = rng.integers(0, 256, (40, 60, 3), dtype=np.uint8)
    small = {
        "width": 120,
        "height": 120,
        "raster_samples": 2,
        "texture": "noise",
        "background": "noise",
    }
    zeta = look(**small | {"sun_strength": 4.0, "sun_radius": 2.0, "sun_height": 3.0} | changes)
    renderer, scene = camera_of(noise=picture), crumpled(seed, cells=cells)
    compiled = renderer.render(scene, zeta)
    monkeypatch.setattr("sim.render.raster.library", lambda: None)
    defined = renderer.render(scene, zeta)
    apart = (compiled.int() - defined.int()).abs()
    # The same operations in float32, some fused: bytes differ by rounding, and samples where two
    # surfaces cross or a shadow's edge lies may go the other way.
    assert float((apart > 1).float().mean()) < 1e-3


def test_the_kernel_encodes_every_value_as_torch_does() -> None:
    code = raster_kernel.library()
    if code is None:
        pytest.skip("no C++ compiler")
    ramp, cover = (
        torch.linspace(0, 1.2, 120_000).view(1, 200, 600),
        torch.linspace(0, 1, 600).expand(1, 200, 600),
    )
    scene = torch.stack(
        [ramp * cover, ramp * cover / 2, ramp * cover * 2, cover], dim=3
    ).contiguous()
    behind = torch.rand((200, 600, 3), generator=torch.Generator().manual_seed(1))
    apart = (
        raster_kernel.develop(code, scene, behind, gain=0.9).int()
        - develop(scene, behind, gain=0.9).int()
    )
    assert int(apart.abs().max()) <= 1
    assert (
        float((apart != 0).float().mean()) < 1e-4
    )  # values within rounding of the bound between two bytes


@pytest.mark.usefixtures("no_compiler")
def test_without_a_compiler_torch_renders_after_one_warning() -> None:
    with pytest.warns(RuntimeWarning, match="raster renderer runs as plain torch") as caught:
        image = camera_of().render(meshes(sheet()), look(raster_samples=2))
    assert len(caught) == 1
    assert image[0, 150, 150].tolist() == [255, 255, 255]


def test_equal_input_gives_equal_bytes() -> None:
    zeta = look(sun_strength=4.0, exposure_time=0.01)
    first, second = (camera_of().render(crumpled(5), zeta) for _ in range(2))
    assert torch.equal(first, second)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_triangles_that_tile_a_region_cover_each_sample_once(seed) -> None:
    rng = np.random.default_rng(seed)
    _, faces, uv = sheet(cells=9)
    inner = ((uv > 0) & (uv < 1)).all(axis=1)
    places = 8 + 48 * uv
    places[inner] += rng.uniform(-1.5, 1.5, (int(inner.sum()), 2))
    places = np.where(
        rng.random(places.shape) < 0.3, np.floor(places) + 0.5, places
    )  # many samples on edges and corners
    places[~inner] = 8 + 48 * uv[~inner]
    turned = np.random.default_rng(seed).permutation(len(faces))
    triangles = Triangles.of(torch.from_numpy(places), torch.from_numpy(faces[turned]))
    count = torch.zeros(64 * 64, dtype=torch.int64)
    for part in fragments(triangles, width=64, height=64):
        count.index_add_(0, part.pixel, torch.ones_like(part.pixel))
    expected = torch.zeros((64, 64), dtype=torch.int64)
    expected[8:56, 8:56] = 1  # samples at 8.5 … 55.5
    assert torch.equal(count.view(64, 64), expected)
