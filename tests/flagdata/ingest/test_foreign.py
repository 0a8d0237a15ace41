"""Data sets of other programs are examined before they come in: order, rates, gaps, and what would
be lost."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from flagdata.cli import root
from flagdata.core.findings import Severity
from flagdata.errors import CorruptError, InputError
from flagdata.export import Export, export
from flagdata.ingest import CameraOptions, examine, open_camera
from flagdata.ingest.mcap import topics
from tests.flagdata.export.conftest import known as known
from tests.flagdata.ingest.mcap.conftest import NOON
from tests.flagdata.ingest.mcap.conftest import write_json as write_json


def at(seconds: float) -> dict[str, int]:
    instant = NOON + round(seconds * 10**9)
    return {"sec": instant // 10**9, "nsec": instant % 10**9}


def test_order_rate_gaps_and_losses_of_topics_are_reported(write_json: Callable[..., Path]) -> None:
    path = write_json(
        {
            "/even": [{"timestamp": at(k / 10), "x": 1.0} for k in range(20)],
            "/gap": [{"timestamp": at(k / 10 + (2 if k > 9 else 0)), "x": 1.0} for k in range(20)],
            "/back": [{"timestamp": at((k if k != 5 else 3) / 10), "x": 1.0} for k in range(20)],
            "/since-start": [{"timestamp": {"sec": k + 1, "nsec": 0}, "x": 1.0} for k in range(20)],
            "/text": [{"timestamp": at(k / 10), "says": "hello"} for k in range(20)],
        }
    )
    found = examine(path)
    streams = {one.name: one for one in found.streams}
    assert streams["/even"].rate == pytest.approx(10)
    assert (streams["/even"].gaps, streams["/even"].backward) == (0, 0)
    assert streams["/gap"].longest == pytest.approx(2.1)
    reported = {(finding.kind, finding.where, finding.severity) for finding in found.findings}
    assert ("gaps", "/gap", Severity.WARNING) in reported
    assert ("stamps-disordered", "/back", Severity.ERROR) in reported
    assert ("not-a-date", "/since-start", Severity.WARNING) in reported
    assert ("clocks-apart", "/since-start", Severity.WARNING) in reported
    assert not [where for _, where, _ in reported if where in ("/even", "/text")]
    lost = [finding.what for finding in found.findings if finding.kind == "lost-topics"]
    assert lost == ["not kept by ingest: topics that hold neither pictures nor numbers: /text"]


@pytest.mark.parametrize("instant", [{"sec": 10**30, "nsec": 0}, {"sec": -(10**12), "nsec": 0}])
def test_an_instant_that_64_bits_do_not_hold_is_damage_of_its_topic(
    write_json: Callable[..., Path], instant: dict[str, int]
) -> None:
    path = write_json(
        {"/far": [{"timestamp": instant, "x": 1.0}], "/even": [{"timestamp": at(0), "x": 1.0}]}
    )
    found = examine(path)
    assert [one.name for one in found.streams] == ["/even"]
    assert [(one.kind, one.where) for one in found.findings if one.severity is Severity.ERROR] == [
        ("topic-unread", "/far")
    ]


def test_messages_that_are_stated_and_not_there_are_damage_of_their_topic(
    write_json: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_json({"/empty": [{"timestamp": at(0), "x": 1.0}]})
    monkeypatch.setattr(topics, "messages", lambda *_, **__: iter(()))
    found = examine(path)
    assert found.streams == ()
    assert [one.kind for one in found.findings if one.severity is Severity.ERROR] == [
        "topic-unread"
    ]


def test_a_message_whose_channel_is_not_in_the_summary_is_damage(
    write_json: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_json({"/odd": [{"x": 1.0}]})
    monkeypatch.setattr(
        topics, "_from_json", lambda data: {}[data]
    )  # KeyError, as the mcap library raises it
    with pytest.raises(CorruptError, match="damaged or cut off"):
        list(topics.messages(path, "/odd"))


def test_a_lerobot_data_set_is_examined_by_its_episodes(known: Any, tmp_path: Path) -> None:
    folder = tmp_path / "set"
    export(
        known.lake,
        Export(format="lerobot", where="kind = 'clip'", options={"frames": "png"}),
        folder,
    )
    found = examine(folder)
    assert [one.name for one in found.streams] == ["episode 0", "episode 1", "episode 2"]
    assert {finding.kind for finding in found.findings} == {"lost-colour", "lost-features"}
    where = folder / "meta" / "info.json"
    info = json.loads(where.read_text())
    del info["features"]["flagdata.time"]
    where.write_text(json.dumps(info | {"total_episodes": 4, "fps": 25}))
    (folder / "meta" / "stats.json").unlink()
    kinds = {finding.kind for finding in examine(folder).findings}
    assert {"lost-instants", "timing-uneven", "episodes-missing", "files-missing"} <= kinds


def test_what_an_operating_system_puts_beside_tables_is_no_table_of_a_data_set(
    known: Any, tmp_path: Path
) -> None:
    folder = tmp_path / "set"
    export(
        known.lake,
        Export(format="lerobot", where="kind = 'clip'", options={"frames": "png"}),
        folder,
    )
    whole = examine(folder)
    for path in list(folder.rglob("*.parquet")):
        path.with_name(f"._{path.name}").write_bytes(b"\0\5\x16\7 beside")
    assert examine(folder) == whole
    with open_camera(folder, CameraOptions(episode=0, rate="native", size=64)) as stream:
        assert len(list(stream)) > 0


def test_the_command_exits_with_3_where_there_is_something_to_act_on(
    write_json: Callable[..., Path],
) -> None:
    even = write_json(
        {"/even": [{"timestamp": at(k / 10), "x": 1.0} for k in range(20)]}, name="even.mcap"
    )
    back = write_json(
        {"/back": [{"timestamp": at(-k / 10), "x": 1.0} for k in range(20)]}, name="back.mcap"
    )
    run = CliRunner()
    sound = run.invoke(root, ["doctor", str(even)])
    assert sound.exit_code == 0
    assert "10" in sound.stdout
    done = run.invoke(root, ["doctor", str(back), "--json"])
    assert done.exit_code == 3
    assert json.loads(done.stdout)["streams"][0]["backward"] == 19


def test_what_is_no_such_data_set_is_refused(video: Path) -> None:
    with pytest.raises(InputError, match="neither"):
        examine(video)
