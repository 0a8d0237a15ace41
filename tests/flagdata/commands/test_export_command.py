"""`flagdata export` as it is run; the formats' contents are tested beside the formats."""

from __future__ import annotations

import json
from pathlib import Path

import polars as pl
import pytest

from flagdata.cli import main
from flagdata.lake import Artifact, Lake
from flagdata.schema import Kind


@pytest.fixture
def lake(tmp_path: Path) -> Lake:
    made = Lake.create(tmp_path / "lake")
    with made.transaction("two models") as tx:
        for number in range(2):
            tx.add(Artifact(kind=Kind.MODEL, name=f"model {number}", seed=number))
    return made


def run(lake: Lake, *arguments: str) -> int:
    with pytest.raises(SystemExit) as stopped:
        main(["export", "--lake", str(lake.path), *arguments])
    return int(stopped.value.code or 0)


def test_the_folder_is_the_result_and_the_summary_is_said(
    lake: Lake, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "out"
    assert run(lake, "parquet", "--where", "seed = 1", "--to", str(target)) == 0
    out, err = capsys.readouterr()
    assert out.strip() == str(target)
    assert "1 artifact of" in err
    assert pl.read_parquet(target / "rows" / "*.parquet")["name"].to_list() == ["model 1"]


def test_json_gives_the_manifest(lake: Lake, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(lake, "parquet", "--to", str(tmp_path / "out"), "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["schema"] == "flagdata.export-result/1"
    assert found["manifest"] == json.loads((tmp_path / "out" / "manifest.json").read_text())


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["parket", "--to", "{out}"], 2, "did you mean 'parquet'"),
        (["parquet", "--to", "{out}", "--crf", "20"], 2, "takes no option 'crf'"),
        (["parquet", "--to", "{out}", "--where", "sed = 1"], 2, "did you mean 'seed'"),
        (["mp4", "--to", "{out}"], 2, "2 of kind model"),
        (["parquet", "--to", "{lake}"], 1, "exists"),
        (["parquet", "--to", "{out}", "--at", "nowhere"], 1, "nowhere"),
        (["parquet"], 2, "--to"),
        (["parquet", "--to", "{lake}/lake.json/out"], 1, "this is no folder"),
        (["parquet", "--to", "{out}", "--salt", "x"], 2, "--salt without --split"),
    ],
)
def test_mistakes_end_in_a_sentence_and_write_nothing(
    arguments: list[str], code: int, said: str, lake: Lake, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = [argument.format(out=tmp_path / "out", lake=lake.path) for argument in arguments]
    assert run(lake, *given) == code
    assert said in capsys.readouterr().err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["lake"]
