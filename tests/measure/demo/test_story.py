"""The demonstration's steps where a command refuses: what a person would do then is done, and
said."""

from __future__ import annotations

import json
import math
import shlex
import subprocess
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from flagdata.answer import Figure, Quantity, Tone
from flagdata.errors import FlagdataError
from measure.demo import Transcript, story
from measure.demo.demo_cards import Card, Judgement, Truth, demonstration_answer
from measure.demo.demo_recording import Acting
from measure.demo.recording_page import Recovered


@pytest.fixture
def codes(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """Exit codes of commands by a word of them, 0 for all others; each prints what was typed."""
    wanted: dict[str, int] = {}

    def run(arguments: list[str], **others: Any) -> subprocess.CompletedProcess[str]:
        typed = " ".join(arguments[3:])
        code = next((code for word, code in wanted.items() if word in typed), 0)
        printed = (
            '{"artifacts": [{"kind": "camera", "artifact": "c1"}, {"kind": "wind", "artifact": '
            '"w1"}]}'
        )
        return subprocess.CompletedProcess(
            arguments, code, stdout=printed if "--json" in typed else f"{typed}\n"
        )

    monkeypatch.setattr(subprocess, "run", run)
    return wanted


def test_a_refusal_is_no_failure(codes: dict[str, int], tmp_path: Path) -> None:
    shell = Transcript(folder=tmp_path)
    assert shell.attempt("align", "a", "b") == "align a b\n"
    codes["align"] = 3
    assert shell.attempt("align", "a", "b") is None
    assert [typed for typed, _ in shell.entries] == ["flagdata align a b"] * 2
    codes["align"] = 1
    with pytest.raises(FlagdataError, match="ended with 1"):
        shell.attempt("align", "a", "b")
    with pytest.raises(FlagdataError, match="ended with 1"):
        shell.run("align", "a", "b")


@pytest.mark.parametrize(
    ("argument", "typed"),
    [
        ("plain", "plain"),
        ("kind = 'clip' and wind > 4", "\"kind = 'clip' and wind > 4\""),
        ("it's $5", "'it'\"'\"'s $5'"),
    ],
)
def test_a_command_is_shown_as_a_person_types_it(
    codes: dict[str, int], tmp_path: Path, argument: str, typed: str
) -> None:
    shell = Transcript(folder=tmp_path)
    shell.run("query", argument)
    assert shell.entries[-1][0] == f"flagdata query {typed}"
    assert shlex.split(typed) == [argument]


def test_the_cloth_is_weighed_with_what_a_person_noted_and_the_truth_stands_beside(
    codes: dict[str, int], tmp_path: Path
) -> None:
    """90 ± 3° from the wind, 20 ± 2° upwards, 8.2 m away."""
    acting = Acting(effect="tangential-linear-drag", parameter="coefficient", strength=0.2)
    noted = SimpleNamespace(azimuth=math.pi / 2, elevation=math.radians(20.2), distance=8.24)
    made = cast(Any, SimpleNamespace(noted=noted, area_weight=0.1754, acting=acting))
    shell = Transcript(folder=tmp_path)
    story.weighing_step(shell, made)
    (command,) = shell.cards[-1].commands
    for words in ("--azimuth 90±3", "--elevation 20±2", "--distance 8.2", "--flag-size 1.5x1.0"):
        assert words in command.replace("'", "")
    assert [truth.true for truth in shell.cards[-1].truths] == ["0.175 kg/m²"]


def test_the_loop_is_closed_with_the_scales_weight_and_its_finding_is_judged_by_the_truth(
    codes: dict[str, int], tmp_path: Path
) -> None:
    """On the same part of the film as the cloth was weighed on, which is not given what the scale
    showed."""
    acting = Acting(effect="hem-mass", parameter="line_density", strength=0.06)
    noted = SimpleNamespace(
        azimuth=math.pi / 2, elevation=math.radians(20.2), distance=8.24, area_weight=0.1731
    )
    made = cast(Any, SimpleNamespace(noted=noted, area_weight=0.1754, acting=acting))
    (tmp_path / "loop").mkdir()
    for conclusion, named, judgement, found in (
        ("effect", ["hem-mass"], Judgement.RIGHT, "close-loop flag"),
        (
            "effect",
            ["wet-mass", "hem-mass"],
            Judgement.RIGHT,
            "one of 2 effects; it is number 2 of them",
        ),
        ("effect", ["lift", "shear"], Judgement.MISSED, "close-loop flag"),
        ("no effect needed", [], Judgement.MISSED, "close-loop flag"),
        ("not decided", [], Judgement.UNDECIDED, "close-loop flag"),
    ):
        (tmp_path / "loop" / "verdict.json").write_text(
            json.dumps({"conclusion": conclusion, "named": named})
        )
        shell = Transcript(folder=tmp_path)
        story.weighing_step(shell, made)
        story.loop_step(shell, made)
        weighed, closed = (card.commands[0].replace("'", "").split() for card in shell.cards)
        assert closed[2:-4] == [*weighed[2:-2], "--area-weight", "0.173±0.003"]
        (truth,) = shell.cards[-1].truths
        assert (truth.judgement, truth.true) == (judgement, "hem-mass, line_density 0.06 kg/m")
        assert truth.found.startswith(found)


@pytest.mark.parametrize(
    ("found", "true", "judgement"),
    [
        ("wind 3.5 m/s [2.3, 5.0] 90 %; bending [9, 10]", 2.4, Judgement.RIGHT),
        ("wind 3.5 m/s [2.3, 5.0] 90 %", 5.1, Judgement.MISSED),
        ("Refused: no flag", 3.0, Judgement.REFUSED),
        ("area weight at most 0.056 kg/m², 95 %", 0.05, Judgement.RIGHT),
        ("area weight at least 0.41 kg/m²", 0.4, Judgement.MISSED),
    ],
)
def test_a_finding_is_right_if_its_interval_contains_the_truth(
    found: str, true: float, judgement: Judgement
) -> None:
    assert story._judgement(found, true) is judgement


def test_a_cloth_that_cannot_be_weighed_is_no_failure_of_the_demonstration(
    codes: dict[str, int], tmp_path: Path
) -> None:
    codes["calibrate"] = 3
    noted = SimpleNamespace(azimuth=1.5, elevation=0.3, distance=8.0)
    shell = Transcript(folder=tmp_path)
    story.weighing_step(
        shell, cast(Any, SimpleNamespace(noted=noted, area_weight=0.15, acting=None))
    )
    (card,) = shell.cards
    assert (card.found.startswith("Refused"), card.page) == (True, "")
    assert (card.truths[0].found.startswith("Refused"), card.truths[0].judgement) == (
        True,
        Judgement.REFUSED,
    )


@pytest.fixture
def aligned(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, codes: dict[str, int]
) -> Callable[[], Card]:
    """Puts the clocks on one: the lake then has a recording whose offset is 0.3 s off a true one of
    −12.0 s."""

    def step() -> Card:
        shell = Transcript(folder=tmp_path)
        (shell.folder / "alignment.png").write_bytes(b"png")
        clock = Recovered(
            offset=Quantity.of(-12.3, -13.1, -11.5, unit="s"), confidence=1.0, truth=-12.0
        )
        monkeypatch.setattr(story, "compare_clock", lambda *_: clock)
        lake = SimpleNamespace(rows=lambda *_, **__: SimpleNamespace(to_pylist=lambda: [{}]))
        monkeypatch.setattr(story.Lake, "open", lambda _: lake)
        made = cast(Any, SimpleNamespace(noted=SimpleNamespace(clock=-12.34), clock_offset=-12.0))
        story._align_step(shell, made)
        return shell.cards[-1]

    return step


def test_where_no_offset_is_found_the_noted_one_is_given_and_the_card_says_so(
    codes: dict[str, int], aligned: Callable[[], Card]
) -> None:
    codes["--search"] = 3
    card = aligned()
    assert "refused" in card.found
    assert "--by given --clock-offset -12.3 --offset-sigma 0.5" in card.found
    assert [truth.judgement for truth in card.truths] == [Judgement.GIVEN]


def test_where_the_offset_is_found_none_is_given(aligned: Callable[[], Card]) -> None:
    card = aligned()
    assert "refused" not in card.found
    assert "--by given" not in card.found
    (truth,) = card.truths
    assert (truth.true, truth.found) == ("-12.00 s", "-12.30 s [-13.10, -11.50] 90 %")
    assert truth.judgement is Judgement.RIGHT


def test_the_first_page_says_how_much_of_what_no_file_states_was_found() -> None:
    def card(title: str, *judgements: Judgement) -> Card:
        truths = tuple(
            Truth(what=f"{title} {one}", true="1", found="1 <b>", judgement=one)
            for one in judgements
        )
        return Card(
            title=title,
            done=f"{title} was done.",
            found="found <i>",
            figure=Figure(title=f"picture of {title}", content="data:image/png;base64,AAAA"),
            page="",
            commands=("flagdata ls",),
            seconds=3.0,
            truths=truths,
        )

    cards = [
        card("film", Judgement.RIGHT),
        card("log", Judgement.MISSED),
        card("wind", Judgement.RIGHT),
    ]
    answer = demonstration_answer(cards, seconds=125)
    assert answer.sentence == "Of 3 things that no file states 2 were found."
    assert (answer.tone, list(answer.head.limits)) == (
        Tone.MISSED,
        ["Log missed: what was found does not hold the truth."],
    )
    assert answer.head.facts["took"] == "2 min 5 s"
    page = answer.page
    assert [page.count(f'alt="picture of {title}"') for title in ("film", "log", "wind")] == [1] * 3
    assert "<b>" not in page.split("<h2>", 1)[1]
    assert "<i>" not in page
    assert demonstration_answer(cards[:1], seconds=1).tone is Tone.SETTLED
