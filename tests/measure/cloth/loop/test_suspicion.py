"""An effect that is suspected before recordings are looked at."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from flagdata.errors import UnknownNameError, UsageError
from measure.cloth import Flag, close_loop, solve, verdict_of, weighable
from measure.cloth.films_statement import words
from measure.cloth.verdict_page import answer_of_films
from measure.forecasting import Suspicion
from measure.verdict import Conclusion
from tests.measure.cloth.loop.conftest import options, recording

FLAG = Flag(length=1.5, height=1.0)


@pytest.mark.parametrize(
    ("text", "name", "sign", "said"),
    [
        ("lift", "lift.coefficient", 1, "lift+"),
        ("lift+", "lift.coefficient", 1, "lift+"),
        ("vertical-wind-", "vertical-wind.inclination", -1, "vertical-wind-"),
        ("tilted-pole.lean+", "tilted-pole.lean", 1, "tilted-pole.lean+"),
        ("hem-mass.line_density", "hem-mass.line_density", 1, "hem-mass.line_density+"),
    ],
)
def test_a_suspicion_is_an_effect_and_a_sign(text: str, name: str, sign: int, said: str) -> None:
    assert Suspicion.parse(text, weighable(FLAG)) == Suspicion(name=name, sign=sign, words=said)


@pytest.mark.parametrize(
    ("text", "kind", "fix"),
    [
        ("lifft", UnknownNameError, "did you mean 'lift'"),
        ("", UnknownNameError, "known: "),
        ("direction-change", UnknownNameError, ""),
        ("tilted-pole+", UsageError, "tilted-pole.lean or tilted-pole.sway"),
        ("vertical-wind", UsageError, "vertical-wind+ or vertical-wind-"),
        ("hem-mass-", UsageError, "give hem-mass without the sign"),
    ],
)
def test_what_is_no_such_effect_is_refused_with_what_is(
    text: str, kind: type[UsageError], fix: str
) -> None:
    with pytest.raises(kind) as refused:
        Suspicion.parse(text, weighable(FLAG))
    assert refused.value.where == "--suspect"
    assert fix in (refused.value.fix or "")


def test_an_effect_that_a_flag_cannot_have_is_no_suspicion() -> None:
    assert Suspicion.parse("full-hoist", weighable(FLAG)).sign == 1
    with pytest.raises(UnknownNameError):
        Suspicion.parse("full-hoist", weighable(replace(FLAG, attachment="hoist")))


def test_it_is_tested_alone_and_the_page_and_the_words_say_that_it_was_stated_before(
    cheap: list[int], tmp_path: Path
) -> None:
    recordings = [
        recording(mean=mean, seed=6, effects={"lift.coefficient": 4.0}) for mean in (4.0, 6.5)
    ]
    found = {}
    for text in ("lift", "tangential-linear-drag"):
        outcome = solve(
            recordings,
            replace(options(), suspected=Suspicion.parse(text, weighable(FLAG))),
            folder=tmp_path,
        )
        found[text] = verdict_of(outcome)
        for said in (
            " ".join(words(found[text]).split()),
            answer_of_films(found[text], outcome).page,
        ):
            assert f"along {text}+ alone, suspected before the recordings were looked at" in said
        assert "stated beforehand" in answer_of_films(found[text], outcome).page
        assert found[text].provenance["options"]["suspected"] == f"{text}+"
    assert found["lift"].named == ("lift",)
    assert found["lift"].test.p_value.point <= 0.05
    assert found["tangential-linear-drag"].conclusion in (
        Conclusion.SUFFICIENT,
        Conclusion.UNDECIDED,
    )
    either = close_loop(recordings, options(), folder=tmp_path)
    assert either.test.suspected == ""
    assert either.test.statistic >= found["lift"].test.statistic
