"""A draped disc beside the theory of plates, in its symmetries, and as its mesh is refined."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError
from sim.cloth.material import Material, isotropic
from sim.cloth.mesh import Mesh
from sim.cloth.scene import assemble
from sim.run.cusick_drape import DISC, PEDESTAL, at_rest, disc, drape_scene, on_pedestal

_G = 9.81


def _cloth(bending_length: float, *, area_weight: float = 0.2) -> Material:
    # Nearly equilateral triangles bend as a plate of a quarter of the tables' stiffness: with fold angles
    # θ = (√3/2) l (κ_n − κ_t/3) of hinges in three directions the energy is k/8 κ² per area for a cylinder, which a
    # plate of rigidity B stores as B/2 κ²; for a sphere it is k/6 κ², so that Poisson's ratio is −1/3.
    rigidity = bending_length**3 * area_weight * _G
    return isotropic(
        name="test",
        area_weight=area_weight,
        stretching=300.0,
        shear=100.0,
        bending=4 * rigidity,
        damping=0.01,
    )


def _at_rest(
    mesh: Mesh, materials: list[Material], *, sigma: float = 1e-3, seed: int = 0
) -> FloatArray:
    rng = np.random.default_rng(seed)
    system, state = assemble(
        [drape_scene(mesh, m, rng, sigma=sigma) for m in materials], dtype=torch.float64
    )
    state = at_rest(system, state)
    assert float(state.velocity.abs().max()) < 0.1
    return state.position.numpy()


def _projected(mesh: Mesh, position: FloatArray) -> float:
    """Computes the area of the rim's projection over that of the flat border, as drape coefficients
    are defined."""
    radius = np.hypot(mesh.rest[:, 0], mesh.rest[:, 1])
    rim = np.flatnonzero(radius > DISC - 1e-6)
    x, y, _ = position[rim[np.argsort(np.arctan2(mesh.rest[rim, 1], mesh.rest[rim, 0]))]].T
    area = abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))) / 2
    return (area - np.pi * PEDESTAL**2) / (np.pi * (DISC**2 - PEDESTAL**2))


def _plate_droop(bending_length: float, poisson: float) -> float:
    """Computes the droop of the free rim of an annular plate that is clamped inside, under its own
    weight [m].

    w = A + B r² + C ln r + D r² ln r + q r⁴/64 with q = weight/rigidity; w = w' = 0 inside, no moment and no shear at
    the rim (Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells, 2nd ed., section 17).
    """

    def basis(r: float) -> FloatArray:
        log = np.log(r)
        return np.array(
            [
                [1, r**2, log, r**2 * log],
                [0, 2 * r, 1 / r, 2 * r * log + r],
                [0, 2, -1 / r**2, 2 * log + 3],
                [0, 0, 2 / r**3, 2 / r],
            ]
        )

    def load(r: float) -> FloatArray:
        return np.array([r**4 / 64, r**3 / 16, 3 * r**2 / 16, 3 * r / 8]) / bending_length**3

    def conditions(inner: FloatArray, outer: FloatArray) -> FloatArray:
        moment = outer[2] + poisson * outer[1] / DISC
        shear = outer[3] + outer[2] / DISC - outer[1] / DISC**2
        return np.array([inner[0], inner[1], moment, shear])

    matrix = conditions(basis(PEDESTAL), basis(DISC))
    constants = np.linalg.solve(matrix, -conditions(load(PEDESTAL), load(DISC)))
    return float(basis(DISC)[0] @ constants + load(DISC)[0])


def test_a_stiff_disc_droops_as_an_annular_plate() -> None:
    mesh = disc(np.random.default_rng(0), rows=7)
    droop = -_at_rest(mesh, [_cloth(0.14)], sigma=0.0)[..., 0]
    rim = np.hypot(mesh.rest[:, 0], mesh.rest[:, 1]) > DISC - 1e-6
    # Second order in the width of a row, an eighth of the border; the membrane adds
    # (droop/border)², < 0.1 %.
    assert droop[rim, 2].mean() == pytest.approx(_plate_droop(0.14, -1 / 3), rel=0.04)


def test_finer_meshes_drape_alike_and_stiffer_cloth_less() -> None:
    lengths = (0.018, 0.024)
    found = []
    for rows in (4, 6):
        mesh = disc(np.random.default_rng(rows), rows=rows)
        positions = _at_rest(mesh, [_cloth(length) for length in lengths])
        found.append([_projected(mesh, positions[..., i]) for i in range(len(lengths))])
        radius = np.hypot(positions[:, 0], positions[:, 1])
        assert (radius[positions[:, 2] < 0] > PEDESTAL - 1e-9).all()
    # Two starts of one cloth differ by up to 0.02.
    np.testing.assert_allclose(found[0], found[1], atol=0.035)
    assert (np.diff(found[1]) > 0.08).all()


def test_rest_depends_on_stiffness_over_weight_alone() -> None:
    mesh = disc(np.random.default_rng(0), rows=3)
    light = _cloth(0.02, area_weight=0.1)
    heavy = light.scaled(area_weight=4.0, bending=4.0, stretching=4.0)
    # By a power of two, so that no digit rounds otherwise.
    np.testing.assert_allclose(_at_rest(mesh, [light]), _at_rest(mesh, [heavy]), atol=1e-9)


def test_what_lies_on_the_pedestal_is_clamped_half_a_row_around_its_edge() -> None:
    mesh = disc(np.random.default_rng(0), rows=4)
    radius = np.hypot(mesh.rest[:, 0], mesh.rest[:, 1])
    held = list(on_pedestal(mesh))
    height = (DISC - PEDESTAL) / 4.5
    assert radius[held].max() == pytest.approx(PEDESTAL + height / 2)
    assert np.delete(radius, held).min() == pytest.approx(PEDESTAL + 1.5 * height)


@pytest.mark.parametrize(
    ("arguments", "match"), [({"pedestal": 0.2}, "under a cloth"), ({"rows": 2}, "2 rows")]
)
def test_a_disc_without_a_border_is_refused(arguments: dict[str, float], match: str) -> None:
    with pytest.raises(InputError, match=match):
        disc(np.random.default_rng(0), **arguments)  # pyright: ignore[reportArgumentType]
