"""Verification 8: onset and frequency of flutter, against the linear stability of the same
equations."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray
from tests.verification.flutter.beam import Onset, Strip, eigenvalues, leading, onset
from tests.verification.flutter.strip import crossing, growth, sweep

# β = M/(m + M) of 0.2, 0.5 and 0.5; the last under tension by the friction of the stream, which delays it by 5 %.
BARE = Strip(length=0.15, mass=0.1, rigidity=5e-5, damping=1e-4)
CASES = {
    "light air": replace(BARE, air_mass=0.025),
    "heavy air": replace(BARE, air_mass=0.1),
    "heavy air with friction": replace(BARE, air_mass=0.1, friction=0.1),
}
SHARES = np.array([0.92, 0.98, 1.03, 1.09])  # of the calculated onset
COLUMNS = 24


@dataclass(frozen=True, kw_only=True)
class Sweep:
    """One case: the speeds and rates simulated, and the calculation."""

    strip: Strip
    theory: Onset
    speeds: FloatArray
    rates: NDArray[np.complex128]


def simulated(columns: int, cases: dict[str, Strip]) -> dict[str, Sweep]:
    """All speeds of all cases in one batch."""
    theory = {name: onset(strip, lowest=0.1, highest=5.0) for name, strip in cases.items()}
    members = [
        member
        for name, strip in cases.items()
        for member in sweep(strip, SHARES * theory[name].speed)
    ]
    rates = growth(members, columns=columns, duration=2.0).reshape(len(cases), -1)
    return {
        name: Sweep(
            strip=strip, theory=theory[name], speeds=SHARES * theory[name].speed, rates=rates[index]
        )
        for index, (name, strip) in enumerate(cases.items())
    }


@pytest.fixture(scope="module")
def sweeps() -> dict[str, Sweep]:
    return simulated(COLUMNS, CASES)


@pytest.mark.parametrize("name", CASES)
def test_flutter_begins_at_the_speed_and_frequency_of_the_linear_calculation(
    name: str, sweeps: dict[str, Sweep]
) -> None:
    # 24 columns put the onset 1–2 % too high and the frequency 1.5–3 %; both fall with the cell
    # (last test; finer meshes in the validation). The project's bound is 10 %.
    case = sweeps[name]
    found = crossing(case.speeds, case.rates)
    assert found.speed == pytest.approx(case.theory.speed, rel=0.03)
    assert found.frequency == pytest.approx(case.theory.frequency, rel=0.04)


@pytest.mark.parametrize("name", CASES)
def test_around_the_onset_growth_rates_follow_the_calculation(
    name: str, sweeps: dict[str, Sweep]
) -> None:
    # An onset that is shifted by 2 % shifts a rate by 2 % of what it changes over a relative change
    # of speed of 1.
    case = sweeps[name]
    expected = np.array([leading(member) for member in sweep(case.strip, case.speeds)])
    slope = abs(np.gradient(expected.real, SHARES))
    assert (abs(case.rates.real - expected.real) < 0.03 * slope + 0.05 * abs(expected.real)).all()
    assert (abs(case.rates.imag / expected.imag - 1) < 0.1).all()


def test_friction_delays_flutter_by_its_tension(sweeps: dict[str, Sweep]) -> None:
    free, pulled = (sweeps[name] for name in ("heavy air", "heavy air with friction"))
    delay = crossing(pulled.speeds, pulled.rates).speed / crossing(free.speeds, free.rates).speed
    assert delay == pytest.approx(pulled.theory.speed / free.theory.speed, rel=0.005)
    assert delay > 1.03


def test_without_the_reactive_loading_a_flat_sheet_does_not_flutter() -> None:
    # The simulator's own drag is quadratic in the deflection: to first order the stream does
    # nothing, whatever its speed, and the strip swings as in a vacuum, at ω₁ with the decay d
    # ω₁²/2. Mesh: 1 % in frequency at 24 columns.
    usual = onset(CASES["heavy air"], lowest=0.1, highest=5.0).speed
    rates = growth(sweep(BARE, usual * np.array([0.5, 1.5, 4.0])), columns=COLUMNS, duration=2.5)
    vacuum = eigenvalues(BARE)[0]
    assert (rates.real < 0).all()
    assert rates.imag == pytest.approx(vacuum.imag, rel=0.02)


def test_the_error_of_the_onset_falls_with_the_cell(sweeps: dict[str, Sweep]) -> None:
    # Between first and second order: the free end's normals and slopes are one-sided. Observed:
    # 1.6.
    name = "heavy air"
    coarse = simulated(COLUMNS // 2, {name: CASES[name]})[name]
    errors = [
        abs(crossing(case.speeds, case.rates).speed / case.theory.speed - 1)
        for case in (coarse, sweeps[name])
    ]
    assert 1.3 < np.log2(errors[0] / errors[1]) < 2.2


def test_a_sheet_of_the_shape_of_a_flag_flutters_as_the_strip_does() -> None:
    # The load is local and the cloth has no Poisson effect: of all modes of the 3:2 sheet, those
    # that are the same along the hoist go first. 18 × 12 cells are coarser than the strips': 5 % in
    # the onset, 7 % in the frequency.
    strip = CASES["heavy air"]
    theory = onset(strip, lowest=0.1, highest=5.0)
    speeds = np.array([0.97, 1.03, 1.07]) * theory.speed
    found = crossing(speeds, growth(sweep(strip, speeds), columns=18, rows=12, duration=1.2))
    assert found.speed == pytest.approx(theory.speed, rel=0.07)
    assert found.frequency == pytest.approx(theory.frequency, rel=0.1)
