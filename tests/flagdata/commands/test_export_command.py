"""`flagdata export` as it is run; the formats' contents are tested beside the formats."""

from __future__ import annotations

import json
from pathlib import Path

import polars as pl
import pytest

from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Lake
from tests.program import Run, invoke


@pytest.fixture
def lake(tmp_path: Path) -> Lake:
    made = Lake.create(tmp_path / "lake")
    with made.transaction("two models") as tx:
        for number in range(2):
            tx.add(Artifact(kind=Kind.MODEL, name=f"model {number}", seed=number))
    return made


@pytest.fixture
def run(lake: Lake) -> Run:
    return lambda *arguments: invoke("export", "--lake", lake.path, *arguments)


def test_the_folder_is_the_result_and_the_summary_is_printed(run: Run, tmp_path: Path) -> None:
    target = tmp_path / "out"
    code, out, err = run("parquet", "--where", "seed = 1", "--to", target)
    assert code == 0
    assert out.strip() == str(target)
    assert "1 artifact of" in err
    assert pl.read_parquet(target / "rows" / "*.parquet")["name"].to_list() == ["model 1"]


def test_json_gives_the_manifest(run: Run, tmp_path: Path) -> None:
    ended = run("parquet", "--to", tmp_path / "out", "--json")
    found = ended.document
    assert ended.code == 0
    assert found["schema"] == "flagdata.export-result/1"
    assert found["manifest"] == json.loads((tmp_path / "out" / "manifest.json").read_text())


MISTAKES: list[tuple[list[str], int, str]] = [
    (["parket", "--to", "{out}"], 2, "did you mean 'parquet'"),
    (["parquet", "--to", "{out}", "--crf", "20"], 2, "takes no option 'crf'"),
    (["parquet", "--to", "{out}", "--where", "sed = 1"], 2, "did you mean 'seed'"),
    (["mp4", "--to", "{out}"], 2, "2 of kind model"),
    (["parquet", "--to", "{lake}"], 1, "exists"),
    (["parquet", "--to", "{out}", "--at", "nowhere"], 1, "nowhere"),
    (["parquet"], 2, "--to"),
    (["parquet", "--to", "{lake}/lake.json/out"], 1, "this is no folder"),
    (["parquet", "--to", "{out}", "--salt", "x"], 2, "--salt needs --split"),
]


def test_mistakes_end_in_a_sentence_and_write_nothing(run: Run, lake: Lake, tmp_path: Path) -> None:
    offenders = []
    for arguments, code, said in MISTAKES:
        ended = run(
            *(argument.format(out=tmp_path / "out", lake=lake.path) for argument in arguments)
        )
        there = sorted(path.name for path in tmp_path.iterdir())
        if ended.code != code or said not in ended.err or there != ["lake"]:
            offenders.append((arguments, ended, there))
    assert offenders == []
