"""Linear stability against published numbers, by hand, and against an independent calculation in
another basis."""

from __future__ import annotations

import math

import numpy as np
import pytest

from flagdata.errors import InputError
from tests.studies.validation.paper_flag.sheet import Sheet, leading, onset, rates
from tests.verification.flutter.beam import Strip
from tests.verification.flutter.beam import leading as beam_leading
from tests.verification.flutter.beam import onset as beam_onset

BARE = Sheet(length=1.0, mass=1.0, rigidity=1.0)


def test_without_air_the_frequencies_are_those_of_a_cantilever() -> None:
    # Roots of cos λ cosh λ = −1: λ² = 3.51602, 22.0345, 61.6972, 120.902 (any textbook on
    # vibration).
    found = np.sort(rates(BARE, 0.0).imag)
    assert found[found > 0][:4] == pytest.approx([3.51602, 22.0345, 61.6972, 120.902], rel=1e-5)


def test_the_base_model_and_internal_damping_never_flutter() -> None:
    for sheet in (BARE, Sheet(length=1.0, mass=1.0, rigidity=1.0, damping=1e-3, still_mass=0.5)):
        assert math.isnan(onset(sheet, highest=50.0))


@pytest.mark.parametrize("beta", [0.1, 0.3, 0.5])
def test_the_reactive_onset_agrees_with_an_independent_calculation(beta: float) -> None:
    sheet = Sheet(length=1.0, mass=1 - beta, rigidity=1.0, reactive_mass=beta)
    other = beam_onset(Strip(mass=1 - beta, rigidity=1.0, air_mass=beta), highest=40.0)
    found = onset(sheet, highest=40.0)
    assert found == pytest.approx(
        other.speed, rel=2e-3
    )  # ten modes of a vacuum against fourteen polynomials
    assert leading(sheet, found).frequency == pytest.approx(
        other.frequency / (2 * math.pi), rel=5e-3
    )


def test_damping_and_friction_act_as_in_the_independent_calculation() -> None:
    sheet = Sheet(length=1.2, mass=0.7, rigidity=0.9, reactive_mass=0.3, damping=2e-3, friction=0.4)
    strip = Strip(
        length=1.2, mass=0.7, rigidity=0.9, air_mass=0.3, damping=2e-3, friction=0.4, speed=9.0
    )
    other = beam_leading(strip)
    found = leading(sheet, 9.0)
    assert found.growth == pytest.approx(other.real, rel=0.02)
    assert 2 * math.pi * found.frequency == pytest.approx(other.imag, rel=0.01)


def test_a_little_lift_damps_and_stiffens_as_perturbation_theory_says() -> None:
    # m r² φ + B φ'''' + ℓ U r φ + ℓ U² φ' = 0, projected on a mode with ∫φ² = L and so ∫φ φ' = φ(L)²/2 = 2:
    # δr = −ℓ U/(2 m) + i ℓ U²/(ω m L).
    lift, speed = 1e-4, 2.0
    before = rates(BARE, 0.0)
    after = rates(Sheet(length=1.0, mass=1.0, rigidity=1.0, lift=lift), speed)
    first = before[np.argmin(np.abs(before - 3.51602j))]
    shift = after[np.argmin(np.abs(after - first))] - first
    assert shift.real == pytest.approx(-lift * speed / 2, rel=1e-3)
    assert shift.imag == pytest.approx(lift * speed**2 / 3.51602, rel=1e-3)


def test_a_sheet_without_rigidity_is_refused() -> None:
    with pytest.raises(InputError, match="without"):
        Sheet(length=1.0, mass=1.0, rigidity=0.0)
