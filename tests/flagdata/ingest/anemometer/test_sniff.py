"""What a file seems to be, and why."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.errors import FlagdataError, InputError, NotFoundError
from flagdata.ingest.anemometer import WindOptions, read_log, sniff

Write = Callable[..., Path]


@pytest.mark.parametrize(
    ("content", "format_name", "recipe"),
    [
        ("time,wind_speed [m/s]\n2026-05-01T12:00:00Z,3\n", "delimited", None),
        ('"TOA5","s","CR1000"\n"TIMESTAMP","RECORD","WS"\n', "toa5", None),
        ("$WIMWV,214.8,R,0.1,K,A*28\n", "nmea", None),
        ("Device Name;K\nDevice Model;5500\nTime;Wind Speed;Temp;Dir\nx;m/s;C;d\n", "kestrel", None),
        ("Date;Time;m/s;°C\n01.05.2026;12:00:00;3,2;20\n", "delimited", "testo-csv"),
        ("laptop_time,raw_line\n2026-05-01T12:00:00,3.1\n", "host-stamped", "serial-speed"),
        (
            'laptop_time,raw_line\n2026-05-01T12:00:00,"1777636800.0,1.0,4.0,2.0,3.0,9,0.9"\n',
            "host-stamped",
            "tracked-flag",
        ),
    ],
)
def test_a_log_is_told_by_its_first_lines(log_file: Write, content: str, format_name: str, recipe: str | None) -> None:
    best = sniff(log_file(content))[0]
    assert (best.kind, best.format, best.recipe) == ("anemometer", format_name, recipe)
    assert best.score >= 0.5
    assert any("line" in reason for reason in best.reasons)


@pytest.mark.parametrize(
    ("content", "format_name", "kind"),
    [
        (b"\x00\x00\x00\x18ftypmp42" + bytes(20), "video", "camera"),
        (b"RIFF\x00\x00\x00\x00AVI LIST", "video", "camera"),
        (b"\x1f\x8b\x08" + bytes(20), "gzip-compressed and damaged", "other"),
        (b"\x89MCAP0\r\n", "an MCAP record", "record"),
        (b"The wind blew.\n", "unknown", "other"),
        (bytes(range(256)) * 20, "unknown", "other"),
    ],
)
def test_a_file_that_is_no_log_is_told_with_what_to_do(
    log_file: Write, content: bytes, format_name: str, kind: str
) -> None:
    best = sniff(log_file(content))[0]
    assert (best.format, best.kind) == (format_name, kind)
    assert best.reasons
    assert best.fix


def test_folders_are_told_by_what_is_in_them(tmp_path: Path) -> None:
    for folder, names in {"m": ["0000_00.obj", "0001_00.obj", "conf.json"], "p": ["a.png", "b.png"], "e": []}.items():
        (tmp_path / folder).mkdir()
        for name in names:
            (tmp_path / folder / name).touch()
    assert [sniff(tmp_path / f)[0].format for f in ("m", "p", "e")] == ["mesh folder", "image sequence", "folder"]
    assert "ArcSim" in sniff(tmp_path / "m")[0].reasons[0]


def test_two_columns_without_a_word_on_units_are_not_taken_for_sure(log_file: Write) -> None:
    best = sniff(log_file("2026-05-01T12:00:00,3.1\n2026-05-01T12:00:01,3.2\n"))[0]
    assert best.score < 0.5


def test_what_is_not_there_or_empty_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError):
        sniff(tmp_path / "none.csv")
    (tmp_path / "empty.csv").touch()
    with pytest.raises(InputError, match="empty"):
        sniff(tmp_path / "empty.csv")


def test_the_first_guess_is_the_one_that_is_tried(log_file: Write) -> None:
    path = log_file("".join(f"2026-05-01T12:00:{at:02d}.5,{at % 3}.25\n" for at in range(30)))
    first = sniff(path)[0]
    with pytest.raises(FlagdataError) as caught:
        read_log(path, WindOptions())
    assert first.doubts
    assert caught.value.what in first.doubts[0]
