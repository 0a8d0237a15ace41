"""The independent calculation itself: against published numbers, and its own convergence."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from tests.verification.flutter.beam import eigenvalues, leading, pipe, pipe_onset


def test_without_fluid_the_frequencies_are_those_of_a_cantilever() -> None:
    # Roots of cos λ cosh λ = −1: λ² = 3.51602, 22.0345, 61.6972 (any textbook on vibration).
    frequencies = eigenvalues(pipe(beta=0.0))[:3].imag
    assert frequencies == pytest.approx([3.51602, 22.0345, 61.6972], rel=1e-5)


def test_a_very_light_fast_fluid_is_the_follower_load_of_becks_column() -> None:
    # Beck (1952): two frequencies merge at P L²/B = 20.05, at ω = 11.02 (Bolotin, Nonconservative
    # Problems of the Theory of Elastic Stability). Below they are apart and nothing grows; above
    # one grows.
    def at(load: float) -> tuple[complex, complex]:
        light = pipe(beta=0.0)
        first, second = eigenvalues(replace(light, speed=float(np.sqrt(load / light.air_mass))))[:2]
        return complex(first), complex(second)

    below, above = at(20.04), at(20.06)
    # What is left of the Coriolis force of the light fluid, √β = 1e-6, stays below 1e-3 so near to
    # the merging.
    assert abs(below[0].real) < 1e-3
    assert below[1].imag - below[0].imag > 0.1
    assert max(rate.real for rate in above) > 0.1
    assert above[0].imag == pytest.approx(11.02, abs=0.01)


@pytest.mark.parametrize(
    ("beta", "gravity", "speed", "frequency"),
    [(0.23e-3, 61.1, 6.15, 21.3), (2.03e-3, 42.4, 5.62, 19.5)],
)
def test_hanging_pipes_flutter_where_paidoussis_finds_it(
    beta: float, gravity: float, speed: float, frequency: float
) -> None:
    # Païdoussis, Fluid–Structure Interactions: Slender Structures and Axial Flow, vol. 1 (1998),
    # table 3.4, undamped theory; three digits are given.
    found = pipe_onset(beta=beta, gravity=gravity)
    assert found.speed == pytest.approx(speed, abs=0.006)
    assert found.frequency == pytest.approx(frequency, abs=0.06)


def test_internal_damping_shifts_the_onset_as_in_paidoussis() -> None:
    # The same table, second pipe, with hysteretic damping B (1 + 0.02 i): u = 5.79, ω = 18.1. At
    # the onset the motion is harmonic, so that Kelvin and Voigt's d = 0.02/ω is the same.
    found = pipe_onset(beta=2.03e-3, gravity=42.4)
    for _ in range(5):
        found = pipe_onset(beta=2.03e-3, gravity=42.4, damping=0.02 / found.frequency)
    assert found.speed == pytest.approx(5.79, abs=0.006)
    assert found.frequency == pytest.approx(18.1, abs=0.06)


def test_the_onset_jumps_at_the_mass_ratios_of_the_literature() -> None:
    # Païdoussis (1998), section 3.5: jumps at β = 0.30, 0.69 and 0.92; at 0.69 from u = 11 to 12.8.
    for beta in (0.30, 0.69, 0.92):
        assert pipe_onset(beta=beta + 0.02).frequency > 1.3 * pipe_onset(beta=beta - 0.02).frequency
    assert pipe_onset(beta=0.69).speed == pytest.approx(11, abs=0.1)
    assert pipe_onset(beta=0.70).speed == pytest.approx(12.8, abs=0.05)


def test_eigenvalues_converge_faster_than_any_power_of_the_number_of_terms() -> None:
    strip = replace(pipe(beta=0.5), speed=9.3 / np.sqrt(0.5))
    exact = leading(strip, terms=20)
    errors = [abs(leading(strip, terms=terms) - exact) / abs(exact) for terms in (6, 8, 10, 12)]
    assert all(after < before / 20 for before, after in itertools.pairwise(errors))
    assert errors[-1] < 1e-5
