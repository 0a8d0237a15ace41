"""What the compiled library computes on faces and hinges is what the torch source defines."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor

from sim.cloth import Cloth, bending, inertia, on_mesh
from sim.cloth.air import NO_AIR, QuadraticNormal, Stokes, face_wind
from sim.cloth.material import named_material
from sim.effects import Permeability, PowerLawDrag
from tests.sim.conftest import make_system

BATCHES = (1, 3, 8, 20)
"""Fewer members than are taken at a time, as many, and more with some left over."""


@pytest.fixture(params=BATCHES)
def cloth(request: pytest.FixtureRequest, distorted) -> Cloth:
    return Cloth.build(
        distorted, [named_material("camel-ponte-roma")] * request.param, dtype=torch.float64
    )


def field(cloth: Cloth, seed: int, *, size: float = 1.0) -> Tensor:
    """At the vertices, its members a part of a longer row of them, as those of a joint batch
    are."""
    rng = torch.Generator().manual_seed(seed)
    wide = torch.randn(
        (cloth.mesh.vertex_count, 3, cloth.batch + 5), generator=rng, dtype=torch.float64
    )
    return size * wide[..., 2 : 2 + cloth.batch]


def position(cloth: Cloth) -> Tensor:
    rest = torch.tensor(cloth.mesh.rest)
    flat = torch.stack([rest[:, 0], 0 * rest[:, 0], rest[:, 1]], dim=1)
    return flat[..., None] + field(cloth, 1, size=0.02)


def test_it_is_left_alone_where_gradients_are_wanted_or_the_type_is_another(cloth: Cloth) -> None:
    x = position(cloth)
    assert on_mesh.usable(x)
    assert not on_mesh.usable(x, x.clone().requires_grad_())
    assert not on_mesh.usable(x.half())
    assert not on_mesh.usable(x, x.float())
    with torch.no_grad():
        assert on_mesh.usable(x.clone().requires_grad_())


@pytest.mark.parametrize("everywhere", [True, False])
def test_face_winds_are_those_of_torch(cloth: Cloth, everywhere: bool) -> None:
    x, v, wind = position(cloth), field(cloth, 2), field(cloth, 3, size=5.0)
    wind = wind[0] if everywhere else wind
    compiled, defined = (
        face_wind(cloth, x, v, wind),
        face_wind(cloth, x.clone().requires_grad_(), v, wind),
    )
    for name in ("normal", "relative", "across"):
        torch.testing.assert_close(
            getattr(compiled, name), getattr(defined, name).detach(), rtol=0, atol=1e-12
        )


def test_a_face_without_an_area_has_no_normal_and_no_nan(cloth: Cloth) -> None:
    seen = face_wind(cloth, torch.zeros_like(position(cloth)), field(cloth, 2), field(cloth, 3))
    assert bool((seen.normal == 0).all())
    assert bool((seen.across == 0).all())


def test_sums_at_the_vertices_are_those_of_torch_to_the_bit(cloth: Cloth) -> None:
    for parts in (1, 3):
        corners = [
            field(cloth, seed)[:1, :parts].repeat(len(cloth.hinges), 1, 1) * (1 + seed)
            for seed in range(4)
        ]
        corners = [c * torch.linspace(-1, 1, len(c), dtype=c.dtype)[:, None, None] for c in corners]
        stacked = torch.cat([*corners, torch.zeros_like(corners[0][:1])])
        expected = torch.zeros((cloth.mesh.vertex_count, parts, cloth.batch), dtype=torch.float64)
        for row in cloth.hinge_slots:
            expected = expected + stacked[row]
        assert torch.equal(on_mesh.gather_sum(corners, cloth.hinge_slots), expected)


def test_mean_normals_and_their_rates_are_those_of_torch(cloth: Cloth) -> None:
    x, v = position(cloth), field(cloth, 2)
    wanted = x.clone().requires_grad_()
    torch.testing.assert_close(
        inertia.mean_normals(cloth, x),
        inertia.mean_normals(cloth, wanted).detach(),
        rtol=0,
        atol=1e-12,
    )
    torch.testing.assert_close(
        inertia.mean_normal_rates(cloth, x, v),
        inertia.mean_normal_rates(cloth, wanted, v).detach(),
        rtol=0,
        atol=1e-12,
    )


def test_folds_are_those_of_torch(cloth: Cloth) -> None:
    x = position(cloth)
    compiled, defined = bending.fold(cloth, x), bending.fold(cloth, x.clone().requires_grad_())
    torch.testing.assert_close(compiled.angle, defined.angle.detach(), rtol=0, atol=1e-12)
    for own, expected in zip(compiled.gradient, defined.gradient, strict=True):
        torch.testing.assert_close(
            own, expected.detach(), rtol=0, atol=1e-12 * float(expected.detach().abs().max())
        )
    assert torch.equal(bending.fold_angle(cloth, x), compiled.angle)


@pytest.mark.parametrize(
    "air",
    [
        QuadraticNormal(density=1.2, drag=0.1),
        NO_AIR,
        Stokes(),
    ],
)
def test_a_force_of_the_air_is_its_plain_one_and_what_is_beyond(cloth: Cloth, air) -> None:
    given = position(cloth), field(cloth, 2), field(cloth, 3, size=5.0)
    whole = air.plain.force(cloth, *given) + air.beyond(cloth, *given)
    torch.testing.assert_close(air.force(cloth, *given), whole, rtol=1e-12, atol=1e-14)


def test_factors_on_the_pressure_multiply_the_normal_force_alone(distorted) -> None:
    # ρ a |w_n| w_n times the product of the factors, plus the tangential part as it is.
    system, state = make_system(
        distorted,
        [named_material("camel-ponte-roma")] * 3,
        air=QuadraticNormal(density=1.2, drag=0.1),
        wind=(5.0, 1.0, 0.0),
    )
    power, porous = PowerLawDrag(exponent=0.4, speed=5.0), Permeability(permeability=0.01)
    for effect in (power, porous):
        system, state = effect.apply(system, state)
    cloth = system.cloth
    x, v, wind = position(cloth), field(cloth, 2), field(cloth, 3, size=5.0)
    seen = face_wind(cloth, x, v, wind)
    factor = power.factor(1.2, seen.across) * porous.factor(1.2, seen.across)
    third = (cloth.areas / 3)[:, None, None]
    push = third * (1.2 * factor * seen.across.abs() * seen.across * seen.normal + 0.1 * seen.along)
    torch.testing.assert_close(
        system.air.force(cloth, x, v, wind), cloth.shared_out(push), rtol=1e-12, atol=1e-14
    )
