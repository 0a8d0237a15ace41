"""How flags are read, fitted and judged, on what is known beforehand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.studies.validation.paper_flag.recipe import Group
from tests.studies.validation.real_flags import paper
from tests.studies.validation.real_flags.published import FLAGS, PUBLISHED, Role, code_drag
from tests.studies.validation.real_flags.runs import READINGS, Flag, read
from tests.studies.validation.real_flags.study import (
    Predictions,
    fitted,
    judged,
    misfits,
    numerical_error,
    with_errors,
)
from tests.studies.validation.real_flags.waves import waves

ALONG = np.linspace(0, 1, 19)
TIMES = np.arange(300) / 50


def test_a_travelling_wave_has_its_frequency_and_length_whatever_its_envelope() -> None:
    phase = 2 * np.pi * (3.3 * TIMES[:, None] - ALONG / 1.6)
    found = waves(ALONG**1.5 * np.cos(phase) + 0.4 * ALONG, ALONG, 50.0)
    assert found.frequency == pytest.approx(3.3, rel=0.01)
    assert found.length == pytest.approx(1.6, rel=0.03)


def test_a_wave_towards_the_hoist_has_no_length() -> None:
    phase = 2 * np.pi * (3.3 * TIMES[:, None] + ALONG / 1.6)
    assert math.isnan(waves(ALONG * np.cos(phase), ALONG, 50.0).length)


def test_readings_have_the_units_that_they_state() -> None:
    flag = Flag(area_weight=0.2, speed=5.0)
    across = 0.1 * ALONG * np.cos(2 * np.pi * (2 * TIMES[:, None] - ALONG / 1.5))
    course = np.stack(
        [np.tile(1.5 * ALONG, (300, 1)), across, np.tile(-0.75 * ALONG, (300, 1))], axis=2
    )
    force = np.tile([2.25, 0.0, 0.0], (300, 1))
    found = dict(zip(READINGS, read(course, force, ALONG, flag, 50.0), strict=True))
    # ½ 1.2 25 1.5 = 22.5 N; half as far down as along; 2 Hz · 1.5 m / 5 m/s; 0.1 m / √2 over 1.5 m.
    expected = {
        "drag": 0.1,
        "droop": math.atan(0.5),
        "frequency": 0.6,
        "wavelength": 1.5,
        "speed": 0.9,
        "amplitude": 0.1 / math.sqrt(2) / 1.5,
    }
    assert found == pytest.approx(expected, rel=0.03)


def test_the_codes_drag_is_that_of_a_worked_example() -> None:
    """0.284/1.2 = 0.2367; 1.5^−1.25 = 0.6024; 0.7 of their product is 0.0998."""
    assert code_drag(Flag(area_weight=0.284, speed=6.0), constant=0.02) == pytest.approx(
        0.1198, abs=1e-4
    )


def test_at_least_ten_numbers_are_comparable_and_none_both_fits_and_judges() -> None:
    comparable = [one for one in PUBLISHED if one.predicted is not None]
    values = np.ones((len(FLAGS), len(READINGS)))
    assert len(comparable) >= 10
    assert len({one.name for one in PUBLISHED}) == len(PUBLISHED)
    assert {one.name for one in PUBLISHED if one.role is Role.FIT} == {"drag-as", "wavelength"}
    for one in comparable:
        assert one.predicted is not None
        assert len(one.predicted(values)) == len(one.bands)


def test_the_strength_of_a_fit_is_the_one_whose_predictions_are_the_published_ones() -> None:
    """Readings that are linear in the strength, right at 0.3 for every flag."""
    right = np.ones((len(FLAGS), len(READINGS)))
    right[:, READINGS.index("wavelength")] = 1.87
    right[:, READINGS.index("drag")] = [code_drag(flag, constant=0.05) for flag in FLAGS]
    grid = np.array([0.0, 0.2, 0.5])
    found = fitted(
        "finite-span-loading", grid, np.array([right * (1 + 0.5 * (s - 0.3)) for s in grid])
    )
    assert found.strength == pytest.approx(0.3, abs=0.003)
    assert found.interval == pytest.approx((0.3, 0.3), abs=0.003)
    np.testing.assert_allclose(misfits(found.readings, Role.FIT), 0, atol=0.02)


def test_numerics_count_only_beyond_what_starts_alone_would_change() -> None:
    generator = np.random.default_rng(3)
    plain = 1 + 0.05 * generator.normal(size=(2, 400, 6))
    assert numerical_error([plain, 1 + 0.05 * generator.normal(size=plain.shape)]).max() < 0.01
    np.testing.assert_allclose(numerical_error([plain, 1.2 * plain]), 0.2, atol=0.01)


@pytest.mark.parametrize(
    ("prediction", "error", "word"),
    [
        (1.1, 0.01, "held"),
        (1.2, 0.01, "not held"),
        (1.2, 0.03, "within the error"),
        (math.nan, 0.1, "not comparable"),
    ],
)
def test_a_prediction_outside_its_band_is_not_held_from_three_errors_on(
    prediction: float, error: float, word: str
) -> None:
    assert judged(prediction, error, (0.9, 1.15)) == word


def test_the_error_of_a_derived_number_is_that_of_its_readings() -> None:
    """n = 2 + ln(C(10)/C(6))/ln(10/6) with 3 % on each of the two."""
    one = next(one for one in PUBLISHED if one.name == "drag-exponent")
    values = np.full((len(FLAGS), len(READINGS)), 0.5)
    (first, error), _ = with_errors(one, Predictions(mean=values, error=0.03 * values, changes={}))
    assert first == pytest.approx(2)
    assert error == pytest.approx(0.03 * math.sqrt(2) / math.log(10 / 6), rel=0.03)


def test_the_paper_flags_share_and_factor_are_those_of_made_frequencies(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Frequencies of 2 (1 + share) Hz for each m/s at the sheet, measured at a factor of 0.55 with
    a share of 0.5."""
    clips = {
        f"clip-{u}": (u, 3.0 * 0.55 * u, "fit" if u < 10 else "held-out")
        for u in (7.0, 8.0, 9.0, 11.0, 12.0)
    }
    monkeypatch.setattr(paper, "measured", lambda: clips)
    rows = np.array([[2 * (1 + share) * speed for speed in paper.SPEEDS] for share in paper.SHARES])
    known = paper.fitted(rows, [0.5])
    assert known.factor == pytest.approx(0.55, abs=0.002)
    assert known.within(Group.HELD_OUT, 0.01) == (2, 2)
    assert paper.predicted(rows, 0.0, 0.55).errors["clip-12.0"][0] == pytest.approx(
        -1 / 3, abs=1e-6
    )


def test_a_paper_flag_that_does_not_flutter_has_no_factor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(paper, "measured", lambda: {"clip": (8.0, 12.0, "fit")})
    still = paper.fitted(np.full((len(paper.SHARES), len(paper.SPEEDS)), np.nan), [0.3])
    assert math.isnan(still.factor)
    assert still.within(Group.FIT, 0.07) == (0, 1)


@pytest.mark.parametrize(
    ("fluttering", "share"),
    [
        ([0, 0, 0, 1, 1, 1, 1, 1], 0.75),
        ([0, 1, 0, 0, 1, 1, 1, 1], 0.85),
        ([1] * 8, math.nan),
        ([0] * 8, math.nan),
    ],
)
def test_flutter_stops_midway_below_the_least_speed_from_which_on_all_flutter(
    fluttering: list[int], share: float
) -> None:
    found = paper.stop(np.where(np.array(fluttering) == 1, 12.0, np.nan))
    assert found == pytest.approx(share, nan_ok=True)
