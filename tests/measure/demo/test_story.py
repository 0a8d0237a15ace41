"""The demonstration's steps where a command refuses: what a person would do then is done, and said."""

from __future__ import annotations

import json
import math
import shlex
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from flagdata.errors import FlagdataError
from measure.demo import story
from measure.demo.cards import Truth
from measure.demo.recording import Acting
from measure.demo.transcript import Transcript


@pytest.fixture
def codes(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """Exit codes of commands by a word of them, 0 for all others; each prints what was typed."""
    wanted: dict[str, int] = {}

    def run(arguments: list[str], **others: Any) -> subprocess.CompletedProcess[str]:
        typed = " ".join(arguments[3:])
        code = next((code for word, code in wanted.items() if word in typed), 0)
        printed = '{"artifacts": [{"kind": "camera", "artifact": "c1"}, {"kind": "wind", "artifact": "w1"}]}'
        return subprocess.CompletedProcess(arguments, code, stdout=printed if "--json" in typed else f"{typed}\n")

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
    shell, truths = Transcript(folder=tmp_path), list[Truth]()
    story.weighing_step(shell, made, truths)
    (command,) = shell.cards[-1].commands
    for words in ("--azimuth 90±3", "--elevation 20±2", "--distance 8.2", "--flag-size 1.5x1.0"):
        assert words in command.replace("'", "")
    assert [truth.true for truth in truths] == ["0.175 kg/m²"]


def test_the_loop_is_closed_with_the_scales_weight_and_its_finding_is_judged_by_the_truth(
    codes: dict[str, int], tmp_path: Path
) -> None:
    """On the same part of the film as the cloth was weighed on, which is not given what the scale showed."""
    acting = Acting(effect="hem-mass", parameter="line_density", strength=0.06)
    noted = SimpleNamespace(azimuth=math.pi / 2, elevation=math.radians(20.2), distance=8.24, area_weight=0.1731)
    made = cast(Any, SimpleNamespace(noted=noted, area_weight=0.1754, acting=acting))
    (tmp_path / "loop").mkdir()
    for named, right, found in (
        (["hem-mass"], True, "close-loop flag"),
        (["wet-mass", "hem-mass", "lift"], True, "one of 3 effects; it is number 2 of them"),
        (["lift", "shear"], False, "close-loop flag"),
        ([], False, "close-loop flag"),
    ):
        (tmp_path / "loop" / "verdict.json").write_text(json.dumps({"named": named}))
        shell, truths = Transcript(folder=tmp_path), list[Truth]()
        story.weighing_step(shell, made, [])
        story.loop_step(shell, made, truths)
        weighed, closed = (card.commands[0].replace("'", "").split() for card in shell.cards)
        assert closed[2:-4] == [*weighed[2:-2], "--area-weight", "0.173±0.003"]
        (truth,) = truths
        assert (truth.right, truth.true) == (right, "hem-mass, line_density 0.06 kg/m")
        assert truth.found.startswith(found)


@pytest.mark.parametrize(("found", "true", "right"), [
    ("wind 3.5 m/s [2.3, 5.0] 90 %; bending [9, 10]", 2.4, True), ("wind 3.5 m/s [2.3, 5.0] 90 %", 5.1, False),
    ("Refused: no flag", 3.0, None), ("area weight at most 0.056 kg/m², 95 %", 0.05, True),
    ("area weight at least 0.41 kg/m²", 0.4, False),
])  # fmt: skip
def test_a_finding_is_right_if_its_interval_contains_the_truth(found: str, true: float, right: bool | None) -> None:
    assert story._contained(found, true) is right


def test_a_cloth_that_cannot_be_weighed_is_no_failure_of_the_demonstration(
    codes: dict[str, int], tmp_path: Path
) -> None:
    codes["calibrate"] = 3
    noted = SimpleNamespace(azimuth=1.5, elevation=0.3, distance=8.0)
    shell, truths = Transcript(folder=tmp_path), list[Truth]()
    story.weighing_step(shell, cast(Any, SimpleNamespace(noted=noted, area_weight=0.15, acting=None)), truths)
    assert shell.cards[-1].found.startswith("Refused")
    assert shell.cards[-1].page == ""
    assert truths[0].found.startswith("Refused")


def aligned(shell: Transcript) -> str:
    (shell.folder / "alignment.png").write_bytes(b"png")
    made = cast(Any, SimpleNamespace(noted=SimpleNamespace(clock=-12.34)))
    story._aligned(shell, made)
    return shell.cards[-1].found


def test_where_no_offset_is_found_the_noted_one_is_given_and_the_card_says_so(
    codes: dict[str, int], tmp_path: Path
) -> None:
    codes["--search"] = 3
    found = aligned(Transcript(folder=tmp_path))
    assert "refused" in found
    assert "--by given --offset -12.3 --offset-sigma 0.5" in found


def test_where_the_offset_is_found_none_is_given(codes: dict[str, int], tmp_path: Path) -> None:
    found = aligned(Transcript(folder=tmp_path))
    assert "refused" not in found
    assert "--by given" not in found
