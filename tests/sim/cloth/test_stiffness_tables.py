"""Verification 6: the stretching and bending tables at their nodes, saturations and sign
changes."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from sim.cloth.material import named_material
from sim.cloth.stiffness_tables import (
    GRIDS,
    Evaluation,
    bending_segments,
    bending_stiffness,
    direction_rows,
    sample_stretching,
    stretching_stiffness,
)

CAMEL = named_material("camel-ponte-roma")


def look_up(
    g00: float, g11: float, g01: float, evaluation: Evaluation = Evaluation.ARCSIM
) -> np.ndarray:
    samples = torch.tensor(sample_stretching(CAMEL.stretching, evaluation)[None])
    strain = [torch.tensor([[value]], dtype=torch.float64) for value in (g00, g11, g01)]
    result = stretching_stiffness(*strain, samples, torch.tensor([0]), GRIDS[evaluation])
    return np.array([float(value) for value in result])


def test_full_strain_along_u_gives_the_row_of_zero_degrees_doubled() -> None:
    # λ = 7/6 is full strain: G00 = (49/36 − 1)/2 = 0.1806. The node (0.25, 1/60, 0) lies beyond it, and its larger
    # principal strain is along u.
    np.testing.assert_allclose(look_up(0.25, 1 / 60, 0.0), 2 * CAMEL.stretching[1], rtol=1e-12)


def test_full_strain_along_v_gives_the_row_of_ninety_degrees_doubled() -> None:
    # The angle weight is capped a millionth below the last row, as in the reference.
    np.testing.assert_allclose(look_up(1 / 60, 0.25, 0.0), 2 * CAMEL.stretching[5], rtol=1e-5)


def test_equal_strain_with_shear_gives_the_row_of_forty_five_degrees() -> None:
    # G00 = G11 = 1/4 and G01 = 1/3: the eigenvector is the diagonal, fully strained.
    np.testing.assert_allclose(look_up(0.25, 0.25, 1 / 3), 2 * CAMEL.stretching[3], rtol=1e-12)


def test_negative_entries_are_cut_to_zero_before_use() -> None:
    # Row 0 has k1 = −12.8, row 2 (22.5°) k3 = −14.66; ArcSim sets both to 0.
    assert CAMEL.stretching[0, 1] < 0
    samples = sample_stretching(CAMEL.stretching, Evaluation.ARCSIM)
    assert samples.min() == 0.0
    assert (samples[0, 0, 0] == [2 * 31.146198, 0.0, 2 * 44.028667, 2 * 31.896357]).all()


def test_zero_strain_is_a_mixture_of_the_neighbouring_nodes() -> None:
    # ArcSim's nodes lie at ±1/60 around zero. By hand for k0, G = 0: of the four neighbours one is
    # compressed both ways (row 0), one stretched along u, one along v and one both ways (direction
    # 0°, since c00 ≥ c11 on the tie).
    weight = 6 * (np.sqrt(1 + 2 / 60) - 1)
    k0 = CAMEL.stretching[:, 0]
    along_u = k0[0] * (1 - weight) + k0[1] * weight
    along_v = k0[0] * (1 - weight) + k0[5] * weight
    expected = 2 * (k0[0] + along_u + along_v + along_u) / 4
    assert look_up(0, 0, 0)[0] == pytest.approx(expected, rel=1e-6)


def test_corrected_evaluation_gives_row_zero_at_zero_strain_and_keeps_the_coupling_positive_definite() -> (
    None
):
    k0, k1, k2, k3 = look_up(0, 0, 0, Evaluation.CORRECTED)
    np.testing.assert_allclose([k0, k1, k2, k3], 2 * CAMEL.stretching[0], rtol=1e-12)
    for name in ("camel-ponte-roma", "paper", "white-swim-solid", "ivory-rib-knit"):
        samples = sample_stretching(named_material(name).stretching, Evaluation.CORRECTED)
        assert (samples[..., 0] * samples[..., 2] - samples[..., 1] ** 2).min() > 0


def test_beyond_the_grid_the_edge_values_hold() -> None:
    np.testing.assert_array_equal(look_up(-0.25, -0.25, 0.0), look_up(-2.0, -0.9, 0.0))
    end = GRIDS[Evaluation.ARCSIM].origin + 29 / 30
    np.testing.assert_allclose(look_up(end, 0.1, 0.2), look_up(7.0, 0.1, 0.2), rtol=1e-12)


def test_sign_of_shear_does_not_matter() -> None:
    np.testing.assert_array_equal(look_up(0.03, -0.01, 0.07), look_up(0.03, -0.01, -0.07))


def bend(curvature: float, degrees: float, evaluation: Evaluation = Evaluation.ARCSIM) -> float:
    """Curvature in 1/m."""
    segments = torch.tensor(bending_segments([CAMEL]))
    rows = torch.tensor(direction_rows(np.radians([degrees])))
    column = torch.tensor([[curvature / 5]], dtype=torch.float64)
    return float(bending_stiffness(column, segments, rows, evaluation))


def test_bending_at_the_nodes_is_the_table() -> None:
    found = [[bend(5.0 * column, 45.0 * row) for column in range(5)] for row in range(3)]
    np.testing.assert_allclose(found, CAMEL.bending, rtol=1e-12)


def test_bending_between_nodes_is_linear_in_curvature_and_direction() -> None:
    assert bend(7.5, 0) == pytest.approx((CAMEL.bending[0, 1] + CAMEL.bending[0, 2]) / 2)
    assert bend(10, 22.5) == pytest.approx((CAMEL.bending[0, 2] + CAMEL.bending[1, 2]) / 2)
    assert bend(10, 67.5) == pytest.approx((CAMEL.bending[1, 2] + CAMEL.bending[2, 2]) / 2)


def test_bending_saturates_above_twenty_per_metre() -> None:
    assert bend(500, 0) == bend(20, 0)


def test_negative_folds_continue_the_first_segment_and_stop_at_zero() -> None:
    first, second = CAMEL.bending[0, :2]
    assert bend(-5, 0) == pytest.approx(2 * first - second)
    assert bend(-500, 0) == 0.0


def test_corrected_bending_does_not_depend_on_the_side() -> None:
    for curvature in (2.0, 9.0, 31.0):
        assert bend(-curvature, 30, Evaluation.CORRECTED) == bend(
            curvature, 30, Evaluation.CORRECTED
        )
        assert bend(curvature, 30, Evaluation.CORRECTED) == bend(curvature, 30)
