"""Drafts of recipes for tables nobody has described: completed by a person, they read the file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.errors import FlagdataError, InputError
from flagdata.ingest.anemometer import WindOptions, read_log, sniff
from flagdata.timebase import iso

Write = Callable[..., Path]

TABLES = {
    "german": (
        "Station 7\n\nDatum;Uhrzeit;Windgeschwindigkeit [km/h];Windrichtung [°]\n"
        "13.05.2026;12:00:00;36,0;90\n13.05.2026;12:00:01;18,0;91\n"
    ),
    "american": (
        "Date Time,Gust (mph),Wind Speed (mph),Temp (F)\n"
        "5/13/2026 12:00:00 PM,30,22.3693629,68\n5/13/2026 12:00:01 PM,30,11.18468145,68\n"
    ),
    "unix": "ts\tspeed_ms\n1778673600\t10.0\n1778673601\t5.0\n",
    "iso": "timestamp|ws [kn]\n2026-05-13 12:00:00|19.438444924\n2026-05-13 12:00:01|9.719222462\n",
}


@pytest.mark.parametrize("name", TABLES)
def test_a_draft_reads_the_file_it_was_made_from(tmp_path: Path, log_file: Write, name: str) -> None:
    path = log_file(TABLES[name])
    best = sniff(path)[0]
    assert (best.kind, best.format) == ("anemometer", "delimited")
    assert best.score < 0.5
    assert best.draft is not None
    recipe = tmp_path / "draft.toml"
    recipe.write_text(best.draft)
    log = read_log(path, WindOptions(recipe=str(recipe), zone=None if name == "unix" else "UTC"))
    assert log.series.channels["wind_speed"] == pytest.approx([10.0, 5.0])
    assert [iso(t) for t in log.series.time] == ["2026-05-13T12:00:00Z", "2026-05-13T12:00:01Z"]


def test_a_draft_is_never_taken_without_asking(log_file: Write) -> None:
    with pytest.raises(InputError, match="no recipe of the catalog") as caught:
        read_log(log_file(TABLES["german"]), WindOptions(zone="UTC"))
    assert "--recipe" in caught.value.fix


def test_a_unit_that_the_header_does_not_state_is_left_to_fill_in(tmp_path: Path, log_file: Write) -> None:
    path = log_file("time,wind\n2026-05-13 12:00:00,5\n2026-05-13 12:00:01,6\n".replace("wind", "speed"))
    best = sniff(path)[0]
    assert best.draft is not None
    assert any("does not state" in reason for reason in best.reasons)
    recipe = tmp_path / "draft.toml"
    recipe.write_text(best.draft)
    with pytest.raises(FlagdataError, match="unknown unit"):
        read_log(path, WindOptions(recipe=str(recipe), zone="UTC"))


@pytest.mark.parametrize(
    "text",
    [
        "name,age\nA,3\nB,4\n",
        "time,colour\n2026-05-13 12:00:00,red\n2026-05-13 12:00:01,blue\n",
        "speed,size\n3,4\n5,6\n",
        "2026-05-13 12:00:00,5\n2026-05-13 12:00:01,6\n",
    ],
)
def test_a_table_without_time_and_wind_gives_no_draft(log_file: Write, text: str) -> None:
    assert all(guess.draft is None for guess in sniff(log_file(text)))
