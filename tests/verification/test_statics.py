"""Verification 2 and 3: a hung strip under its own weight, and the heavy elastica."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_bvp
from scipy.optimize import brentq

from sim.handles import Handles
from sim.material import isotropic
from sim.mesh import grid

G = 9.81


def test_hung_strip_stretches_by_its_own_weight(build, settle) -> None:
    # Without Poisson effect the strip is a bar in tension: K λ (λ² − 1)/2 = ρ g (L − s) at distance s below the
    # support, K the membrane stiffness, and the lower end at ∫ λ ds. Lumped masses and faces of constant strain are of
    # second order.
    length, stiffness, density = 1.0, 30.0, 0.3

    def stretch(s: float) -> float:
        pull = density * G * (length - s) / stiffness
        return brentq(lambda x: x * (x * x - 1) / 2 - pull, 0.5, 3.0, xtol=1e-15)

    expected = quad(stretch, 0, length, epsabs=1e-13)[0]
    assert expected > 1.04  # well into the nonlinear range
    errors = []
    for rows in (8, 16):
        mesh = grid(width=0.2, height=length, columns=2, rows=rows)
        top = tuple(int(i) for i in np.flatnonzero(mesh.rest[:, 1] > length - 1e-9))
        material = isotropic(name="bar", density=density, stretching=stiffness, shear=30.0, bending=0.0)
        system, state = build(
            mesh, [material], handles=Handles(vertices=top, stiffness=math.inf), gravity=(0.0, 0.0, -G)
        )
        final = settle(system, state)
        bottom = np.flatnonzero(mesh.rest[:, 1] < 1e-9)
        # The lumped masses of a row differ, so that it is not quite level: the row's mean by mass.
        z = np.average(final.position[bottom, 2, 0].numpy(), weights=mesh.vertex_areas[bottom])
        errors.append(abs((length - z) - expected))
    assert errors[1] < 1e-4
    # Observed 1.76: the uneven lumped masses along a row add a term of their own.
    assert 1.6 < math.log2(errors[0] / errors[1]) < 2.2


def elastica_tip(rigidity: float, weight: float, length: float) -> tuple[float, float]:
    """Tip of an inextensible strip clamped level: B θ'' = q (L − s) cos θ, θ(0) = 0, θ'(L) = 0, q = ρ g (θ downwards
    positive, so θ'' = −q (L − s) cos θ / B). Returns how far out and how far down the tip is [m]."""

    def slope(s: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.stack([y[1], -weight * (length - s) * np.cos(y[0]) / rigidity, np.cos(y[0]), np.sin(y[0])])

    def ends(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.array([a[0], b[1], a[2], a[3]])

    s = np.linspace(0, length, 200)
    guess = np.stack([1.2 * s / length, 0 * s, s, 0.5 * s])
    solution = solve_bvp(slope, ends, s, guess, tol=1e-9, max_nodes=100_000)
    assert solution.success
    return float(solution.y[2, -1]), float(solution.y[3, -1])


def test_clamped_strip_droops_as_the_heavy_elastica(build, settle) -> None:
    # The cantilever test by which fabrics are measured. The flexural rigidity B of the grid with alternating diagonals,
    # by hand: let the lines along the strip turn by a at vertices where eight triangles meet and by b where four do,
    # a + b = 2 κ h. Edges across the strip fold by a, S = 1/2; the diagonals by (b − a)/√2, S = 1. The energy k S θ²/4
    # of a cell, k (a² + (b − a)²)/8, is least at a = 0.8 κ h, where it is 0.8 k κ² h²/8 = B κ² h²/2: B = k/5. The fixed
    # first cell clamps the strip at its middle: half a cell counts as free. Error of second order in the cell.
    length, density, columns = 0.15, 0.2, 24
    cell = length / (columns - 0.5)
    tables = [4e-4, 1e-3, 4e-3, 1.5e-2]
    mesh = grid(width=cell * columns, height=cell, columns=columns, rows=1)
    materials = [
        isotropic(name=f"k{k}", density=density, stretching=400.0, shear=400.0, bending=k, damping=2e-5) for k in tables
    ]
    clamp = tuple(int(i) for i in np.flatnonzero(mesh.rest[:, 0] < 1.5 * cell))
    flat = np.concatenate([mesh.rest, np.zeros((mesh.vertex_count, 1))], axis=1)
    system, state = build(
        mesh, materials, position=flat, handles=Handles(vertices=clamp, stiffness=math.inf), gravity=(0.0, 0.0, -G)
    )
    final = settle(system, state, rest=1e-4)  # accelerations below g/500: tips to 1e-3 of their deflection
    tip = np.flatnonzero(mesh.rest[:, 0] > cell * (columns - 0.5))
    for member, k in enumerate(tables):
        out, down = elastica_tip(k / 5, density * G, length)
        x = final.position[tip, :, member].mean(0).numpy()
        assert x[0] - cell / 2 == pytest.approx(out, abs=0.01 * length), f"k = {k}"
        assert -x[2] == pytest.approx(down, abs=0.01 * length), f"k = {k}"
    # The range covers limp (tip hanging below) to stiff (barely bent).
    assert elastica_tip(tables[0] / 5, density * G, length)[0] < 0.4 * length
    assert elastica_tip(tables[-1] / 5, density * G, length)[1] < 0.3 * length
