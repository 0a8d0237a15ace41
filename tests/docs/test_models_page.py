"""Who has read no code builds, exports, trains, is interrupted, resumes, and judges beside the
shipped network by the page about networks, on the films that it builds."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Any

import pytest

from flagdata.lake import Lake
from models.training import checkpoint
from tests.docs.pages import Shell, commands, files
from tests.program import Ended, invoke

PAGE = "models.md"


def typed(start: str) -> list[str]:
    """The page's commands that begin so."""
    return [command for command in commands(PAGE) if command.startswith(f"flagdata {start}")]


def run(command: str) -> Ended:
    return invoke(*shlex.split(command)[1:])


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the page's files, and its commands done up to the first training."""
    folder = tmp_path_factory.mktemp("networks")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for name, text in files(PAGE).items():
            (folder / name).write_text(text, encoding="utf-8")
        before = commands(PAGE)[: commands(PAGE).index(typed("train")[0])]
        assert [command.split()[1] for command in before] == ["init", "build", "tag", "export"]
        for command in before:
            Shell(patch=patch).run(command)
    return folder


def test_the_page_leads_from_a_recipe_to_a_table_beside_the_shipped_network(
    built: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(built)
    (first, second), (judge,) = typed("train"), typed("evaluate")
    assert json.loads((built / "shards" / "manifest.json").read_text())["files"]
    with monkeypatch.context() as patch:
        patch.setattr(checkpoint, "save", interrupted_after(checkpoint.save))
        stopped = run(first)
    assert (stopped.code, "flagdata: interrupted" in stopped.err) == (1, True)
    assert not Lake.open(built / "lake").rows("kind = 'network'").num_rows
    resumed = run(first)
    assert resumed.code == 0, resumed.err
    assert "the training goes on from its checkpoint: from epoch 2 of 3" in resumed.err
    assert "training for up to 2 more epochs" in resumed.err
    for command in (second, *typed("ls"), judge):
        ended = run(command)
        assert ended.code == 0, f"{command}\n{ended.err}"
    (page,) = (built / "evaluation").glob("*.json")
    rows = {
        row["label"]: row for row in json.loads(page.read_text())["models"] if row["run"] is None
    }
    assert set(rows) == {"my-wave", "flow-outdoor, as shipped"}
    assert rows["my-wave"]["runs"] == 2
    assert rows["my-wave"]["note"].startswith("12×24×24 of clips of 30 frames, wave-maps")
    assert (
        "not judged by log_aspect, which not all clips state"
        in rows["flow-outdoor, as shipped"]["note"]
    )
    assert all(row["scores"]["rmse"]["clips"] == 4 for row in rows.values())


def interrupted_after(save: Any) -> Any:
    """Who presses Ctrl-C once the first epoch is kept."""

    def stopped(*arguments: Any, **options: Any) -> None:
        save(*arguments, **options)
        raise KeyboardInterrupt

    return stopped
