"""The inertia of the air of a finite span, against the potential flow of a strip and against its
limits."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import torch
from scipy.special import k0, k1

from flagdata.core.arrays import FloatArray
from sim.cloth import Cloth
from sim.cloth.material import named_material
from sim.cloth.mesh import grid
from sim.cloth.scene import assemble, flag
from sim.cloth.system import InapplicableError
from sim.effects import FiniteSpanLoading, apply
from sim.effects.finite_span_loading import (
    cosines,
    profile_over_height,
    relative_masses,
    strip_mass,
)


def potential_flow(wavenumber: float, *, panels: int = 80) -> tuple[float, FloatArray, FloatArray]:
    """m/ρ of a wave e^(ikx) on a strip of height 1 in potential flow, mean over it; and where, and
    the load there.

    Doublets of constant strength g on panels between ζ₁ and ζ₂, in air that obeys (∂yy + ∂zz − k²)
    φ = 0: the velocity across the strip is (∂zz − k²) ∫ K₀(k|z − z′|) g dz′ / 2π.
    """
    ends = -np.cos(np.linspace(0, np.pi, panels + 1)) / 2
    middles = (ends[1:] + ends[:-1]) / 2
    nodes, weights = np.polynomial.legendre.leggauss(40)
    below, above = middles[:, None] - ends[:-1], middles[:, None] - ends[1:]
    slope = wavenumber * (
        np.sign(below) * k1(wavenumber * abs(below)) - np.sign(above) * k1(wavenumber * abs(above))
    )
    inside = np.zeros_like(slope)
    for column, (low, high) in enumerate(pairwise(ends)):
        for first, last in (
            (low, middles[column]),
            (middles[column], high),
        ):  # the logarithm is at the middle
            places = (first + last) / 2 + (last - first) / 2 * nodes
            distance = wavenumber * abs(middles[:, None] - places)
            inside[:, column] += (k0(distance) * weights).sum(1) * (last - first) / 2
    jump = np.linalg.solve((slope + wavenumber**2 * inside) / (2 * np.pi), np.ones(panels))
    return float((jump * np.diff(ends)).sum()), middles, jump


@pytest.mark.parametrize("wavenumber", [0.3, 1.0, 2.0, 4.0, 8.0, 20.0])
def test_the_mass_of_a_strip_is_that_of_potential_flow(wavenumber: float) -> None:
    exact, _, _ = potential_flow(wavenumber)
    assert strip_mass(wavenumber, 1.0) == pytest.approx(exact, rel=0.04)


def test_the_load_of_long_waves_over_the_height_is_an_elongated_bodys() -> None:
    exact, middles, jump = potential_flow(0.1)
    mesh = grid(width=1.0, height=1.0, columns=2, rows=40)
    column = np.argsort(mesh.rest[:, 1])[mesh.rest[np.argsort(mesh.rest[:, 1]), 0] < 1e-9]
    expected = np.interp(mesh.rest[column, 1] - 0.5, middles, jump / exact, left=0, right=0)
    # A panel's width at the edges, and the mean of the profile over cells instead of over the
    # height.
    assert np.abs(profile_over_height(mesh)[column] - expected)[2:-2].max() < 0.03


def test_a_wave_that_the_cells_resolve_has_its_own_mass_and_one_that_they_do_not_has_none() -> None:
    """The load of a cosine along the cloth is m(k)/m(k₀) of that cosine."""
    mesh = grid(width=1.5, height=1.0, columns=30, rows=20)
    modes, gains = cosines(mesh), relative_masses(mesh)
    for mode in (1, 3, 6):
        wave = np.cos(np.pi * mode * mesh.rest[:, 0] / 1.5)
        smooth = modes @ (gains * (modes.T @ (wave * mesh.vertex_areas)))
        mass, reference = (potential_flow(np.pi / 1.5 * k)[0] for k in (mode, 1))
        np.testing.assert_allclose(smooth, mass / reference * wave, atol=0.06)
    coarse = relative_masses(grid(width=1.5, height=1.0, columns=6, rows=4))
    assert coarse[9] == 0
    assert coarse[1] > 0


U, SHARE, DENSITY, AMPLITUDE = 6.0, 0.5, 1.2, 1e-5


def errors_at_the_ends(columns: int, *, still: float = 1.0, celerity: float = 0.0) -> FloatArray:
    """(hoist, fly) of the load per area in the two outer rows of vertices, over the largest.

    A wave η = A cos(k u − ω t + φ) of half the cloth's length, ω = c U k: D V without the
    acceleration's term is 2 U η_xt + U² η_xx = (2 c − 1) U² k² η, whose load the effect's masses of
    its cosines give. Root mean square over φ of 0 and π/2, so that no zero of the error is taken
    for its size.

    Args:
        still: factor on the shape η, and so on U² η_xx; at 0 there is the rate of a flat cloth
            alone, 2 U η_xt.
    """
    mesh = grid(width=1.5, height=1.0, columns=columns, rows=2 * columns // 3)
    cloth = Cloth.build(mesh, [named_material("camel-ponte-roma")], dtype=torch.float64)
    effect = FiniteSpanLoading(share=SHARE, density=DENSITY)
    modes, gains = cosines(mesh), relative_masses(mesh)
    root = np.sqrt(profile_over_height(mesh))
    longest = SHARE * DENSITY * strip_mass(np.pi / 1.5, 1.0)
    u, v = mesh.rest.T
    k = 4 * np.pi / 1.5
    wind = torch.tensor([U, 0.0, 0.0], dtype=torch.float64)[:, None]
    squares, largest = np.zeros(len(u)), 0.0
    for shift in (0.0, np.pi / 2):
        height = AMPLITUDE * np.cos(k * u + shift)
        rate = celerity * U * k * AMPLITUDE * np.sin(k * u + shift)
        position = torch.tensor(np.stack([u, v, still * height], axis=1))[..., None]
        velocity = torch.tensor(np.stack([0 * u, 0 * u, rate], axis=1))[..., None]
        load = (
            effect.force(cloth, 0.0, position, velocity, wind)[:, 2, 0].numpy() / mesh.vertex_areas
        )
        exact = (2 * celerity - still) * (U * k) ** 2 * height
        expected = (
            -longest * root * (modes @ (gains * (modes.T @ (root * exact * mesh.vertex_areas))))
        )
        squares += (load - expected) ** 2 / 2
        largest = max(largest, float(np.abs(expected).max()))
    error = np.sqrt(squares) / largest
    return np.array([error[np.abs(u - end) < 1.5 * 1.5 / columns].max() for end in (0.0, 1.5)])


@pytest.mark.parametrize(("still", "celerity"), [(1.0, 0.0), (0.0, 0.6)])
def test_each_term_of_the_load_converges_at_second_order_at_hoist_and_fly(
    still: float, celerity: float
) -> None:
    errors = np.array(
        [errors_at_the_ends(columns, still=still, celerity=celerity) for columns in (20, 40, 80)]
    )
    assert np.log2(errors[:-1] / errors[1:]).min() >= 1.8


def test_a_wave_that_travels_at_six_tenths_of_the_stream_has_its_load_at_both_ends() -> None:
    """Terms of −1 and 1.2 cancel to 0.2, so that means over half of what is there have errors of
    1.4, 0.72 and 0.36."""
    errors = np.array([errors_at_the_ends(columns, celerity=0.6) for columns in (20, 40, 80)])
    assert (errors.max(1) < [0.08, 0.045, 0.015]).all()


def test_a_strip_of_one_row_of_cells_is_refused() -> None:
    system, state = assemble(
        [flag(material=named_material("camel-ponte-roma"), wind_speed=4.0, height=0.05, columns=30)]
    )
    with pytest.raises(InapplicableError, match="no vertex between"):
        apply([FiniteSpanLoading(share=0.5)], system, state)
