"""Drafts of recipes: what they leave to fill in, and tables that give none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, read_log, sniff

Write = Callable[..., Path]


def test_a_unit_that_the_header_does_not_state_is_left_to_fill_in(tmp_path: Path, log_file: Write) -> None:
    best = sniff(log_file("time,speed\n2026-05-13 12:00:00,5\n2026-05-13 12:00:01,6\n"))[0]
    assert best.draft is not None
    assert best.score < 0.5
    assert any("not stated" in doubt for doubt in best.doubts)
    recipe = tmp_path / "draft.toml"
    recipe.write_text(best.draft)
    with pytest.raises(FlagdataError, match="unknown unit"):
        read_log(log_file("time,speed\n2026-05-13 12:00:00,5\n"), WindOptions(recipe=str(recipe), zone="UTC"))


def test_a_catalog_recipe_without_units_in_its_headings_is_not_taken_by_itself(log_file: Write) -> None:
    path = log_file("time,wind_speed\n2026-05-13T12:00:00Z,5\n2026-05-13T12:00:01Z,6\n")
    with pytest.raises(FlagdataError, match="unit of column 'wind_speed'"):
        read_log(path)
    assert read_log(path, WindOptions(recipe="generic-csv")).series.channels["wind_speed"].tolist() == [5.0, 6.0]


def test_what_a_recipe_says_the_user_does_not_say_again(log_file: Write) -> None:
    path = log_file("time,wind_speed\n2026-05-13T12:00:00Z,5\n2026-05-13T12:00:01Z,6\n")
    with pytest.raises(FlagdataError, match="the recipe says for itself: unit"):
        read_log(path, WindOptions(recipe="generic-csv", unit="km/h"))


@pytest.mark.parametrize(
    "text",
    [
        "name,age\nA,3\nB,4\n",
        "time,colour\n2026-05-13 12:00:00,red\n2026-05-13 12:00:01,blue\n",
        "3,4\n5,6\n",
        "the wind blew, and then\nit blew again, and more\n",
    ],
)
def test_a_table_without_time_and_wind_is_never_taken(log_file: Write, text: str) -> None:
    path = log_file(text)
    assert all(guess.score < 0.5 for guess in sniff(path))
    with pytest.raises(FlagdataError) as caught:
        read_log(path, WindOptions(zone="UTC"))
    assert caught.value.fix
