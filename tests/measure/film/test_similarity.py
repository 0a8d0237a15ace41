"""Dynamic similarity: against the simulator, and what follows for films of flags of other sizes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from flagdata.errors import RefusedError, UsageError
from measure.film import FlagSize, scaled_back, sizes
from measure.film.similarity import SizePrior, spacing
from sim.cloth.material import Material, named_material
from sim.cloth.scene import assemble, flag
from sim.integrate import Symplectic

CAMEL = named_material("camel-ponte-roma")


def flight(scale: float, *, wind: float, material: Material, frames: int = 12) -> FloatArray:
    """(frame, vertex, 3) positions of a flag of length 1.5 m · scale, in its own lengths, frames
    √scale/25 s apart."""
    scene = flag(
        material=material, wind_speed=wind, width=1.5 * scale, height=1.0 * scale, columns=6
    )
    stiffness = scene.handles.stiffness * scale**2
    scene = replace(scene, handles=replace(scene.handles, stiffness=stiffness))
    system, state = assemble([scene], dtype=torch.float64)
    shown = []
    for _ in range(frames):
        state = Symplectic().advance(system, state, spacing(scale, rate=25.0))
        shown.append(state.position[..., 0].numpy() / (1.5 * scale))
    return np.stack(shown)


def cloth(*, area_weight: float, bending: float, scale: float = 1.0) -> Material:
    """Of constant bending stiffness; stretching and damping follow the scale."""
    return replace(
        CAMEL,
        area_weight=area_weight,
        bending=np.full((3, 5), bending),
        stretching=CAMEL.stretching * scale**2,
        damping=CAMEL.damping * np.sqrt(scale),
    )


def test_values_scaled_back_make_half_a_flag_move_like_the_whole() -> None:
    # The simulator knows nothing of similarity: air and gravity are the same for both.
    values = np.array([4.0, 0.12, np.log10(3e-5)])
    names = ("wind_speed", "area_weight", "bending_scale")
    wind, area_weight, bending = scaled_back(values, names, 0.5)
    whole = flight(1.0, wind=4.0, material=cloth(area_weight=0.12, bending=3e-5))
    half = flight(
        0.5, wind=wind, material=cloth(area_weight=area_weight, bending=10**bending, scale=0.5)
    )
    moved = np.abs(whole - whole[0]).max()
    assert moved > 0.1  # of a length; it is not a flag at rest that is compared
    # The step follows from the mesh, so it scales by √s too: equal to rounding, which motion
    # amplifies (10⁻¹⁵ seen).
    np.testing.assert_allclose(half, whole, atol=1e-9)
    unscaled = flight(
        0.5, wind=4.0, material=cloth(area_weight=area_weight, bending=10**bending, scale=0.5)
    )
    assert np.abs(unscaled - whole).max() > 0.01


def test_scaling_back_at_the_trained_size_changes_nothing() -> None:
    values = np.array([[4.0, 0.12, -4.5, 0.3]])
    np.testing.assert_array_equal(
        scaled_back(values, ("wind_speed", "area_weight", "bending_scale", "anisotropy"), 1.0),
        values,
    )


def test_a_flag_four_times_as_long_is_in_twice_the_wind_and_four_times_the_weight() -> None:
    values = np.array([3.0, 0.1, -4.0, 0.2])
    found = scaled_back(values, ("wind_speed", "area_weight", "bending_scale", "anisotropy"), 4.0)
    np.testing.assert_allclose(found, [6.0, 0.4, -4.0 + np.log10(256.0), 0.2])
    assert spacing(4.0, rate=25.0) == pytest.approx(0.08)


def test_a_film_slower_than_the_scaled_frames_is_refused_with_the_least_rate() -> None:
    small = FlagSize(length=0.375, height=0.25)  # s = 1/4: frames 1/50 s apart
    with pytest.raises(RefusedError, match=r"needs 47\.5; film at 47\.5"):
        sizes(small, rate=30.0, frames_rate=25.0, draws=4, generator=stream(0, "sizes"))
    assert (
        sizes(small, rate=50.0, frames_rate=25.0, draws=4, generator=stream(0, "sizes")).scale[0]
        == 0.25
    )


def test_an_unknown_size_is_drawn_from_its_stated_prior() -> None:
    prior = SizePrior()
    found = sizes(None, rate=100.0, frames_rate=25.0, draws=2000, generator=stream(0, "sizes"))
    logs = np.log(found.draws.ravel() * 1.5)
    assert np.mean(logs) == pytest.approx(np.log(1.5), abs=0.01)
    assert np.std(logs) == pytest.approx(np.log(1.3), rel=0.03)
    assert [f.kind for f in found.findings] == ["size-assumed"]
    assert prior.share_above(1.5) == pytest.approx(0.5)


def test_sizes_that_the_frame_rate_cannot_show_are_left_out_and_reported() -> None:
    found = sizes(None, rate=25.0, frames_rate=25.0, draws=500, generator=stream(0, "sizes"))
    assert found.draws.min() >= 0.95**2 - 1e-9
    assert "small-sizes-left-out" in {f.kind for f in found.findings}
    with pytest.raises(RefusedError, match="size was not given"):
        sizes(None, rate=15.0, frames_rate=25.0, draws=5, generator=stream(0, "sizes"))


def test_another_shape_is_a_finding() -> None:
    assert [f.kind for f in FlagSize(length=1.5, height=1.5).findings()] == ["aspect-ratio"]
    assert not FlagSize(length=0.9, height=0.6).findings()


@pytest.mark.parametrize("text", ["1.5", "axb", "0x1", "1.5x", "-1x1", "30x20"])
def test_what_is_no_size_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="metres"):
        FlagSize.of(text)
    assert FlagSize.of("1.5x1.0") == FlagSize(length=1.5, height=1.0)
