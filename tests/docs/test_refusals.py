"""Refusals: each reason is on the page, states no cause as a fact, and no two of one command lead
in a circle."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

import pytest

from docs.generate_cli import commands
from docs.generate_refusal_pictures import FAULTS, FOLDER, MOST_BYTES, caption, found, looked_at
from measure.gate import REASONS
from tests.contract.imports import ROOT, modules, tree
from tests.docs.pages import DOCS

WINDOWS = {"unlike-training", "size-needed"}
CALIBRATED = {"another-picture", "another-place", "another-framing", "another-wind", "another-flag"}
VERBS = {
    "measure": (
        "measure/estimate",
        "measure/film",
        "measure/commands/measure",
        "measure/gate",
        "measure/anemometer",
        "measure/measuring_model",
        "measure/refine",
    ),
    "observe": ("measure/observables", "measure/film", "measure/commands/observe"),
    "calibrate": (
        "measure/cloth",
        "measure/commands/calibrate",
        "measure/anemometer",
        "measure/measuring_model",
        "measure/observables",
        "measure/film",
        "measure/estimate",
    ),
    "align": ("flagdata/align", "flagdata/commands/align.py"),
    "ingest": (
        "flagdata/ingest",
        "flagdata/commands/ingest_options.py",
        "flagdata/commands/confirm_recipe.py",
    ),
    "close-loop": (
        "measure/closing",
        "measure/commands/close_loop",
        "measure/trajectories",
        "measure/cloth",
    ),
}
"""Where the refusals of each command are."""
CONDITIONAL = {
    "measure": {"--refine"},  # asked for beside --cache, which may be left out as well
    "align": {
        "--by"
    },  # a film that cannot be estimated; refused of two logs, which are always compared
    "ingest": {
        "--azimuth",  # components without a heading; refused where the log has a direction already
        "--date",  # stamps without a day; refused where stamps have one
        "--episode",
        "--topic",
        "--stream",  # where a file has several; refused of files that have none
        "--sequence-fps",  # pictures without times; refused of a film that has stamps
        "--join",  # never asked for: the fix names ingesting without it
        "--unit",  # a heading without a unit; refused where the format states it
    },
}
"""Options that a refusal of one kind of source asks for, and one of another kind refuses: walked
through by hand."""
_ASKED = re.compile(
    r"(?:give|add|state|name|choose|use|by)\b[^;.]*?(?<!leave )(?<!leave out )(--[a-z][a-z-]+)"
)
_REFUSED = re.compile(r"leave (?:out )?(--[a-z][a-z-]+)(?! or)")


def fixes(*places: str) -> Iterator[str]:
    """The text of every `fix` under the folders or files, an expression in it as {}."""
    for path in modules(*{place.split("/")[0] for place in places}):
        if any(str(path.relative_to(ROOT)).startswith(place) for place in places):
            for node in ast.walk(tree(path)):
                if isinstance(node, ast.keyword) and node.arg == "fix":
                    parts = [n.value for n in ast.walk(node.value) if isinstance(n, ast.Constant)]
                    yield " ".join(part for part in parts if isinstance(part, str))


def test_every_reason_of_the_gate_is_on_the_page_and_no_other() -> None:
    page = (DOCS / "refusals.md").read_text(encoding="utf-8")
    shown = re.findall(r"^### `([a-z-]+)`$", page, flags=re.MULTILINE)
    assert shown[: len(REASONS)] == list(REASONS)
    assert set(shown) == {*REASONS, *WINDOWS, *CALIBRATED}
    for kind in CALIBRATED:
        assert f'"{kind}"' in (ROOT / "measure" / "measuring_model" / "novelty.py").read_text(
            encoding="utf-8"
        ), kind


def test_every_reason_that_a_picture_can_show_has_one_and_all_are_small() -> None:
    page = (DOCS / "refusals.md").read_text(encoding="utf-8")
    assert set(FAULTS) == set(REASONS) - {"too-few-frames", "few-windows"}
    assert {path.stem for path in FOLDER.iterdir()} == set(FAULTS)
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < MOST_BYTES
    for reason in FAULTS:
        assert re.search(
            rf"^### `{reason}`\n\n!\[[^]]+\]\(pictures/refusals/{reason}\.webp\)",
            page,
            flags=re.MULTILINE,
        )


@pytest.mark.parametrize("reason", FAULTS)
def test_the_film_of_a_picture_is_refused_for_that_reason_as_the_page_says(reason: str) -> None:
    kind, sentence = found(looked_at(reason))
    assert kind.removesuffix("-found") == reason
    shown = caption(reason).search((DOCS / "refusals.md").read_text(encoding="utf-8"))
    assert shown is not None
    assert shown[2] == sentence


def test_what_a_reason_advises_can_be_done() -> None:
    options = {
        o for name, c in commands() if name == "flagdata measure" for p in c.params for o in p.opts
    }
    for kind, reason in REASONS.items():
        assert set(re.findall(r"--[a-z-]+", reason.fix)) <= options, kind


@pytest.mark.parametrize(
    "kind",
    [
        *("scene-cut", "repeated-frames", "too-dark", "moving-camera", "cut-off", "unlike-cloth"),
        *("upside-down", "on-its-side", "second-pole"),
        *("no-pole", "hangs-from-above", "no-background", "another-shape"),
    ],
)
def test_a_reason_states_what_was_found_and_what_it_may_mean(kind: str) -> None:
    assert re.search(r"\b(may|as in|as of|as where)\b", REASONS[kind].sentence)


@pytest.mark.parametrize("verb", VERBS)
def test_no_refusal_asks_for_what_another_one_of_the_command_refuses(verb: str) -> None:
    texts = list(fixes(*VERBS[verb]))
    assert len(texts) > 10
    own = {
        o for name, c in commands() if name == f"flagdata {verb}" for p in c.params for o in p.opts
    }
    asked = {option for text in texts for option in _ASKED.findall(text)} & own
    refused = {option for text in texts for option in _REFUSED.findall(text)} & own
    assert asked & refused == CONDITIONAL.get(verb, set())
