"""Grades of the sheet of hanging cloth's weight, on answers whose grade is plain."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.studies.validation.hanging_weight import FILMS, Film, grade, page

_PLAIN = Film(
    weight=0.2,
    wind=3.0,
    refused=False,
    constrained=False,
    low=0.1,
    high=0.4,
    width=0.98,
    width_wind_known=0.95,
    covered_wind_known=True,
    wind_error=0.6,
    wind_error_stated=0.6,
    wind_covered=True,
    wind_covered_stated=True,
)
"""A film that does not tell the weight, and whose answer says so."""


def films(*others: Film) -> list[Film]:
    """Forty films, all plain but these."""
    return [*others, *[_PLAIN] * (FILMS - len(others))]


def test_films_that_constrain_nothing_meet_what_can_be_met() -> None:
    sheet = grade(films(*[replace(_PLAIN, low=0.3, wind_covered_stated=False)] * 4), seed=1)
    assert sheet["covered"] == sheet["wind_covered_weight_stated"] == 36
    assert sheet["criteria"] == {
        "refused": True,
        "weight covered": True,
        "constrains the weight": False,
        "says so": True,
        "wind covered, weight stated": True,
        "a stated weight lowers the wind's error": False,
    }


@pytest.mark.parametrize("missed", [0, 9])
def test_intervals_that_contain_too_often_or_too_rarely_fail(missed: int) -> None:
    sheet = grade(films(*[replace(_PLAIN, low=0.3)] * missed), seed=1)
    assert not sheet["criteria"]["weight covered"]


def test_a_weight_given_though_films_constrain_none_is_counted() -> None:
    sheet = grade(films(*[replace(_PLAIN, constrained=True)] * 5), seed=1)
    assert sheet["claimed"] == 5
    assert not sheet["criteria"]["says so"]


def test_narrow_intervals_constrain_and_must_be_given() -> None:
    narrow = [replace(_PLAIN, width=0.5)] * FILMS
    assert grade(narrow, seed=1)["criteria"]["constrains the weight"]
    assert not grade(narrow, seed=1)["criteria"]["says so"]
    assert grade([replace(film, constrained=True) for film in narrow], seed=1)["criteria"][
        "says so"
    ]


def test_a_stated_weight_that_helps_on_every_film_is_seen() -> None:
    sheet = grade([replace(_PLAIN, wind_error_stated=0.3)] * FILMS, seed=1)
    assert sheet["wind_rmse_change"] == pytest.approx([-0.3, -0.3])
    assert sheet["criteria"]["a stated weight lowers the wind's error"]


def test_refused_films_count_in_the_first_criterion_alone() -> None:
    sheet = grade(films(*[replace(_PLAIN, refused=True, low=0.3, wind_error=9.0)] * 5), seed=1)
    assert not sheet["criteria"]["refused"]
    assert (sheet["covered"], sheet["wind_rmse"]) == (35, pytest.approx(0.6))
    assert "the gate refused 5" in page({**sheet, "model": "wave-cloth"})
