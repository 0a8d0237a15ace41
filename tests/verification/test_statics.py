"""Verification 2 and 3: a hung strip under its own weight, and the heavy elastica."""

from __future__ import annotations

import math

import pytest

from tests.verification.cases import G, drooped_tips, elastica_tip, hung_strip


def test_hung_strip_stretches_by_its_own_weight() -> None:
    # Lumped masses and faces of constant strain are of second order.
    errors = []
    for rows in (8, 16):
        length, expected = hung_strip(rows)
        assert expected > 1.04  # well into the nonlinear range
        errors.append(abs(length - expected))
    assert errors[1] < 1e-4
    # Observed 1.76: the uneven lumped masses along a row add a term of their own.
    assert 1.6 < math.log2(errors[0] / errors[1]) < 2.2


def test_clamped_strip_droops_as_the_heavy_elastica() -> None:
    # The cantilever test by which fabrics are measured.
    length, area_weight = 0.15, 0.2
    tables = [4e-4, 1e-3, 4e-3, 1.5e-2]
    tips = drooped_tips(tables, columns=24, length=length, area_weight=area_weight)
    for k, tip in zip(tables, tips, strict=True):
        assert tip == pytest.approx(
            elastica_tip(k / 5, area_weight * G, length), abs=0.01 * length
        ), f"k = {k}"
    # The range covers limp (tip hanging below) to stiff (barely bent).
    assert elastica_tip(tables[0] / 5, area_weight * G, length)[0] < 0.4 * length
    assert elastica_tip(tables[-1] / 5, area_weight * G, length)[1] < 0.3 * length
