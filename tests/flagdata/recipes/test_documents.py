"""Texts of TOML and JSON that are too deep, too long or hold no finite numbers are refused at
once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flagdata.core.arrays import UInt8Array
from flagdata.dataset import DecodedCache
from flagdata.errors import CorruptError
from flagdata.lake import Lake
from flagdata.recipes import documents
from flagdata.recipes.documents import NESTING_LIMIT, LimitsError, from_json, from_toml, read_json

MANY = 200_000


DEEP = [
    "a = " + "[" * MANY + "]" * MANY,
    "a = " + "{a = " * MANY + "1" + "}" * MANY,
    "[" + ".".join(["a"] * MANY) + "]",
    "[[" + " . ".join(["a"] * MANY) + "]]",
    ".".join(["a"] * MANY) + " = 1",
    ".".join(['"a.b"', "'c'"] * MANY) + " = 1",
    "a = {" + ".".join(["a"] * MANY) + " = 1}",
    "a = 1\n" + ".".join(["a"] * (NESTING_LIMIT + 1)) + " = 1",
]
DEEP_JSON = ["[" * MANY + "]" * MANY, '{"a":' * MANY + "1" + "}" * MANY, "[" * 101 + "]" * 101]


def test_tables_and_values_that_are_nested_too_deep_are_refused_before_they_take_time() -> None:
    for read, texts in ((from_toml, DEEP), (from_json, DEEP_JSON)):
        for text in texts:
            with pytest.raises(LimitsError, match=f"more than {NESTING_LIMIT} deep"):
                read(text)


def test_what_is_nested_within_the_limit_is_read() -> None:
    inner = NESTING_LIMIT - 1
    assert from_json("[" * inner + "]" * inner)
    assert from_toml(".".join(["a"] * inner) + " = 1")
    assert from_toml('title = "' + ".".join(["a"] * MANY) + '"')  # dots in a text are no tables


def test_numbers_that_are_not_finite_or_endless_are_refused() -> None:
    for number in ("inf", "-inf", "nan", "1e999", "1" + "0" * 5000):
        with pytest.raises(ValueError):
            from_toml(f"a = [1.0, {number}]")
    for number in ("Infinity", "NaN", "1e999", "1" + "0" * 5000):
        with pytest.raises(ValueError):
            from_json(f'{{"a": [1.0, {number}]}}')


def test_a_text_beyond_the_limit_is_not_parsed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(documents, "SIZE_LIMIT", 10)
    for read in (from_toml, from_json):
        with pytest.raises(LimitsError, match="11 characters, at most 10"):
            read("a = 1234567")


def test_a_file_of_json_that_cannot_be_read_is_named_with_the_fix(tmp_path: Path) -> None:
    path = tmp_path / "note.json"
    for content in ("[" * MANY, "[1]", '{"a": NaN}', "\udcff", ""):
        path.write_bytes(content.encode(errors="surrogateescape"))
        with pytest.raises(CorruptError, match="the note") as caught:
            read_json(path, noun="note")
        assert caught.value.where == str(path)
        assert caught.value.fix == "restore it from a copy"
    path.write_text('{"a": 1}')
    assert read_json(path, noun="note") == {"a": 1}


def test_a_lake_whose_marker_is_nested_without_end_is_refused(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    (lake.path / "refs" / "tags" / "v1.json").write_text(
        '{"view":' + "[" * MANY
    )  # of an earlier version
    with pytest.raises(CorruptError, match="the ref cannot be read"):
        lake.rows(at="v1")
    (lake.path / "lake.json").write_text("[" * MANY)
    with pytest.raises(CorruptError, match="marker"):
        Lake.open(lake.path)


def test_every_bit_of_a_decoded_clip_counts(tmp_path: Path) -> None:
    frames = np.arange(24, dtype=np.uint8).reshape(2, 3, 4)

    def read() -> list[bool]:
        made: list[bool] = []

        def decode() -> UInt8Array:
            made.append(True)
            return frames

        cache = DecodedCache(tmp_path / "cache", limit=1 << 20)  # as a new process opens it
        assert np.array_equal(cache.frames("mcap/x", 0, 2, decode=decode), frames)
        return made

    read()
    (path,) = (tmp_path / "cache").glob("*.clip")
    whole = path.read_bytes()
    assert read() == []
    for place in range(len(whole)):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :])
        read()
        path.write_bytes(whole)
    path.write_bytes(b"[" * 4000 + b"\n")
    assert read() == [True]
