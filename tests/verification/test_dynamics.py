"""Verification 4 and 5: pendulum modes of a hanging sheet, and the terminal velocity of a falling
one."""

from __future__ import annotations

import math

import pytest

from tests.verification.cases import fall, swing, terminal_velocity


@pytest.mark.parametrize("mode", [1, 2, 3])
def test_hanging_sheet_swings_at_the_bessel_frequencies(mode: int) -> None:
    measured, omega = swing(mode, rows=30)
    # Second order: the error grows with the square of the mode's wavenumber.
    assert measured == pytest.approx(omega, rel=0.0025 * mode**2)


def test_falling_sheet_reaches_terminal_velocity() -> None:
    coarse, fine = fall(0.3, steps=400)[-1], fall(0.3, steps=800)[-1]
    assert fine[1:3] == pytest.approx(fine[3:], abs=1e-3)
    # First order in the step.
    assert 0.9 < math.log2(abs(coarse[2] - coarse[4]) / abs(fine[2] - fine[4])) < 1.1
    assert fine[3] > 0.98 * terminal_velocity()
