"""A command refuses an output whose name is taken before it looks at its inputs, and leaves what is
there as it is."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from tests.program import invoke

CASES: dict[str, tuple[tuple[str, ...], str]] = {
    "query --arrow": (("query", "--lake", "nowhere", "--arrow", "{out}/a.arrow"), "a.arrow"),
    "export --to": (("export", "parquet", "--lake", "nowhere", "--to", "{out}"), "mine"),
    "align --plot": (("align", "a", "b", "--lake", "nowhere", "--plot", "{out}/a.png"), "a.png"),
    "realign --plot": (("realign", "a", "--lake", "nowhere", "--plot", "{out}/a.png"), "a.png"),
    "ingest --crop-picture": (
        ("ingest", "nowhere.mp4", "--crop", "auto", "--crop-picture", "{out}/a.png"),
        "a.png",
    ),
    "measure --report": (("measure", "nowhere.mp4", "--report", "{out}/a.html"), "a.html"),
    "calibrate --report": (
        ("calibrate", "nowhere.csv", "--flag-size", "1.5x1.0", "--report", "{out}/a.html"),
        "a.html",
    ),
    "catalog --report": (
        ("catalog", "effects", "lift", "--report", "{out}/a.html"),
        "a.html",
    ),
    "measure --zarr": (("measure", "nowhere.mp4", "--zarr", "{out}"), "mine"),
    "evaluate --out": (
        ("evaluate", "flow", "--lake", "nowhere", "--out", "{out}"),
        "evaluation.md",
    ),
    "close-loop --out": (
        ("close-loop", "nowhere.csv", "--lake", "nowhere", "--out", "{out}"),
        "model.toml",
    ),
    "propose --out, log": (
        ("propose", "nowhere.toml", "--out", "{out}"),
        "proposal/proposals.json",
    ),
    "propose --out, effect": (
        ("propose", "nowhere.toml", "--out", "{out}"),
        "proposal/pyproject.toml",
    ),
    "build --card": (
        ("build", "flagsim-small", "--lake", "{out}/lake", "--card", "{out}/a.html"),
        "a.html",
    ),
    "demo --out": (("demo", "--out", "{out}"), "mine"),
    "train --run": (("train", "flow", "--lake", "nowhere", "--run", "{out}"), "mine"),
    "blender-setup --folder": (("blender-setup", "--folder", "{out}"), "pyvenv.cfg"),
}


@pytest.mark.parametrize("case", CASES)
def test_a_taken_output_is_refused_first_and_kept(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    arguments, taken = CASES[case]
    out = tmp_path / "out"
    (out / taken).parent.mkdir(parents=True)
    (out / taken).write_text("mine")
    monkeypatch.chdir(tmp_path)
    code, error = refusal([argument.format(out=out) for argument in arguments])
    assert (code, error["kind"]) == (
        1,
        "corrupt" if taken.endswith("proposals.json") else "conflict",
    )
    assert str(out) in f"{error['what']} {error['where']}"
    assert error["fix"]
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == [out / taken]
    assert (out / taken).read_text() == "mine"


def refusal(arguments: Sequence[str]) -> tuple[int, dict[str, str]]:
    """Exit code and error of a command; of one that takes no --json, in words."""
    structured = arguments[0] not in ("demo", "query")
    ended = invoke(*arguments, *(["--json"] if structured else []))
    if structured:
        return ended.code, ended.document
    return ended.code, {
        "kind": "conflict",
        "what": ended.err,
        "where": "",
        "fix": ended.err.partition("fix:")[2],
    }
