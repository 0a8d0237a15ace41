"""What a name on the command line means."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Lake, meant
from tests.flagdata.lake.conftest import put_text
from tests.program import Run, invoke


@pytest.fixture
def run(lake: Lake, monkeypatch: pytest.MonkeyPatch) -> Run:
    monkeypatch.setenv("FLAGDATA_LAKE", str(lake.path))
    return lambda *arguments: invoke(*arguments)


def row(
    artifact: str,
    kind: Kind,
    name: str,
    *,
    parents: tuple[str, ...] = (),
    source: str | None = None,
) -> Any:
    return {
        "artifact": artifact,
        "kind": kind,
        "name": name,
        "parents": list(parents),
        "source_name": source,
    }


ROWS = [
    row("ca11", Kind.CAMERA, "flag", source="flag.mp4"),
    row("3e0a", Kind.WIND, "cup", source="cup.csv"),
    row("3e0b", Kind.RECORDING, "flag", parents=("ca11", "3e0a")),
    row("5c10", Kind.CLIP, "flag", parents=("3e0b",)),
    row("5c11", Kind.CLIP, "flag", parents=("3e0b",)),
    row("91aa", Kind.NETWORK, "3e0"),
    row("92aa", Kind.MODEL, "twin"),
    row("92ab", Kind.MODEL, "twin"),
]


@pytest.mark.parametrize(
    ("wanted", "kinds", "found"),
    [
        ("flag", (), ["3e0b"]),  # not the film that it was aligned from, nor its clips
        ("flag", (Kind.CAMERA,), ["ca11"]),
        ("flag.mp4", (), ["ca11"]),
        ("day-1/flag.mp4", (), ["ca11"]),
        ("flag.mov", (), []),
        ("3e0b", (), ["3e0b"]),
        ("3e0", (), ["91aa"]),  # a name before the beginning of ids
        ("ca", (), ["ca11"]),
        ("3e", (), ["3e0a", "3e0b"]),
        ("twin", (), ["92ab", "92aa"]),
        ("", (), []),
    ],
)
def test_a_name_means_what_a_person_means_by_it(
    wanted: str, kinds: tuple[Kind, ...], found: list[str]
) -> None:
    assert {one["artifact"] for one in meant(ROWS, wanted, kinds=kinds)} == set(found)


def test_an_artifact_that_is_withdrawn_is_found_at_a_tag(run: Run, lake: Lake) -> None:
    kept = put_text(lake, "cup")
    lake.tag("v1")
    lake.withdraw([kept.id], "replaced")
    assert run("show", "cup").code == 1
    assert run("show", "cup@v1", "--json").document["artifact"]["artifact"] == kept.id
    assert lake.artifact("cup@v1").id == kept.id


def test_a_name_that_is_nearly_right_is_suggested(run: Run, lake: Lake) -> None:
    put_text(lake, "anemometer")
    assert "did you mean 'anemometer'?" in run("show", "anemometre").err


def test_show_says_what_matters_of_a_verdict_and_lists_twenty_of_what_was_made_from_it(
    run: Run, lake: Lake
) -> None:
    words = "Adding lift explains a third of the error."
    with lake.transaction("verdict") as tx:
        verdict = Artifact(
            kind="measurement", name="flag", report=f'{{"words": "{words}"}}', recipe={"secret": 1}
        )
        tx.add(verdict)
    with lake.transaction("models") as tx:
        for number in range(23):
            model = Artifact(
                kind="model",
                name=f"flag-{number}",
                parents=(verdict.id,),
                recipe={"number": number},
            )
            tx.add(replace(model, parameters='{"effects": {"lift": {}}}'))
    shown = run("show", "flag").out
    assert shown.splitlines()[0] == f"says            {words}"
    assert shown.count("made into") == 21
    assert "… and 3 models more (--all lists them)" in shown
    assert "secret" not in shown
    whole = run("show", "flag", "--all").out
    assert whole.count("made into") == 23
    assert '{"secret": 1}' in whole
    assert run("show", "flag-7").out.splitlines()[0] == "adds            lift"
