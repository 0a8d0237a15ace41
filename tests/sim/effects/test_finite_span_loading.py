"""The inertia of the air of a finite span, against the potential flow of a strip and against its limits."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import k0, k1

from sim.effects import apply
from sim.effects.finite_span_loading import FiniteSpanLoading, cosines, profile_over_height, relative_masses, strip_mass
from sim.material import named
from sim.mesh import grid
from sim.scene import assemble, flag
from sim.system import InapplicableError


def potential_flow(wavenumber: float, *, panels: int = 80) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """m/ρ of a wave e^(ikx) on a strip of height 1 in potential flow, mean over it; and where, and the load there.

    Doublets of constant strength g on panels between ζ₁ and ζ₂, in air that obeys (∂yy + ∂zz − k²) φ = 0: the velocity
    across the strip is (∂zz − k²) ∫ K₀(k|z − z′|) g dz′ / 2π.
    """
    ends = -np.cos(np.linspace(0, np.pi, panels + 1)) / 2
    middles = (ends[1:] + ends[:-1]) / 2
    nodes, weights = np.polynomial.legendre.leggauss(40)
    below, above = middles[:, None] - ends[:-1], middles[:, None] - ends[1:]
    slope = wavenumber * (np.sign(below) * k1(wavenumber * abs(below)) - np.sign(above) * k1(wavenumber * abs(above)))
    inside = np.zeros_like(slope)
    for column, (low, high) in enumerate(pairwise(ends)):
        for first, last in ((low, middles[column]), (middles[column], high)):  # the logarithm is at the middle
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
    # A panel's width at the edges, and the mean of the profile over cells instead of over the height.
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


def test_a_strip_of_one_row_of_cells_is_refused() -> None:
    system, state = assemble([flag(material=named("camel-ponte-roma"), wind_speed=4.0, height=0.05, columns=30)])
    with pytest.raises(InapplicableError, match="no vertex between"):
        apply([FiniteSpanLoading(share=0.5)], system, state)
