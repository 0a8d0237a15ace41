"""The decoded cache gives back what was decoded, within its size, even if other programs use or
damage it."""

from __future__ import annotations

import multiprocessing
import os

import numpy as np
import pytest

from flagdata.dataset import DecodedCache
from flagdata.errors import FlagdataError, UsageError

FRAMES = 30 * 16 * 16  # B, a clip of these tests


def clip(number: int) -> np.ndarray:
    return np.random.default_rng(number).integers(0, 256, size=(30, 16, 16), dtype=np.uint8)


class Decoder:
    """Decodes clip `number`, counting how often."""

    def __init__(self, number: int) -> None:
        self.number = number
        self.calls = 0

    def __call__(self) -> np.ndarray:
        self.calls += 1
        return clip(self.number)


def get(cache, number, decoder=None):
    return cache.frames("mcap/" + "0" * 64, 30 * number, 30, decode=decoder or Decoder(number))


def files(cache):
    return sorted(cache.path.glob("*.clip"))


def test_a_clip_is_decoded_once(tmp_path):
    cache, decoder = DecodedCache(tmp_path, limit=10**6), Decoder(1)
    for _ in range(3):
        assert np.array_equal(get(cache, 1, decoder), clip(1))
    assert decoder.calls == 1
    assert get(cache, 1).dtype == np.uint8


def test_clips_of_other_objects_or_frames_are_kept_apart(tmp_path):
    cache = DecodedCache(tmp_path, limit=10**6)
    places = [("mcap/" + "a" * 64, 0), ("mcap/" + "b" * 64, 0), ("mcap/" + "a" * 64, 30)]
    for number, (name, first) in enumerate(places):
        cache.frames(name, first, 30, decode=Decoder(number))
    for number, (name, first) in enumerate(places):
        assert np.array_equal(cache.frames(name, first, 30, decode=Decoder(99)), clip(number))


def test_the_folder_never_outgrows_its_limit_and_the_least_recently_read_go_first(tmp_path):
    cache = DecodedCache(tmp_path, limit=5 * (FRAMES + 300))
    for number in range(5):
        get(cache, number)
    assert len(files(cache)) == 5
    kept = Decoder(2)
    for number in range(5, 12):
        get(cache, 2, kept)  # reading makes it the most recent
        get(cache, number)
        assert cache.size() <= cache.limit
    get(cache, 2, kept)
    assert kept.calls == 0
    gone = Decoder(0)
    get(cache, 0, gone)
    assert gone.calls == 1


def test_a_clip_larger_than_the_limit_is_decoded_and_not_kept(tmp_path):
    cache = DecodedCache(tmp_path, limit=FRAMES // 2)
    assert np.array_equal(get(cache, 1), clip(1))
    assert files(cache) == []


@pytest.mark.parametrize("damage", ["flip", "cut", "empty", "foreign", "header", "renamed"])
def test_a_damaged_clip_is_decoded_anew(tmp_path, damage):
    get(DecodedCache(tmp_path, limit=10**6), 1)
    path = files(DecodedCache(tmp_path, limit=10**6))[0]
    data = bytearray(path.read_bytes())
    if damage == "flip":
        data[-100] ^= 1
    elif damage == "cut":
        data = data[:-1]
    elif damage == "empty":
        data = bytearray()
    elif damage == "foreign":
        data = bytearray(os.urandom(5000))
    elif damage == "header":
        data = data.replace(b'"shape": [30', b'"shape": [31')
    elif damage == "renamed":
        get(DecodedCache(tmp_path, limit=10**6), 2)
        other = next(p for p in files(DecodedCache(tmp_path, limit=10**6)) if p != path)
        data = bytearray(other.read_bytes())
    path.write_bytes(data)
    cache, decoder = DecodedCache(tmp_path, limit=10**6), Decoder(1)
    assert np.array_equal(get(cache, 1, decoder), clip(1))
    assert decoder.calls == 1
    assert np.array_equal(get(cache, 1, decoder), clip(1))
    assert decoder.calls == 1


def test_what_a_killed_writer_left_behind_is_in_nobodys_way(tmp_path):
    cache = DecodedCache(tmp_path, limit=10**6)
    (tmp_path / "writing.part").write_bytes(b"half a clip")
    (tmp_path / "tally").write_bytes(b"garbage")
    assert np.array_equal(get(cache, 1), clip(1))
    assert len(files(cache)) == 1
    assert int((tmp_path / "tally").read_text()) == cache.size()


def work(path, limit, seed, failures):
    cache = DecodedCache(path, limit=limit)
    for number in np.random.default_rng(seed).integers(0, 20, size=120).tolist():
        if not np.array_equal(get(cache, number), clip(number)):
            failures.put(number)


def test_several_processes_share_a_cache_that_is_too_small_for_all(tmp_path):
    limit = 8 * (FRAMES + 300)
    context = multiprocessing.get_context("fork")
    failures = context.Queue()
    processes = [
        context.Process(target=work, args=(tmp_path, limit, seed, failures)) for seed in range(4)
    ]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
    assert [process.exitcode for process in processes] == [0, 0, 0, 0]
    assert failures.empty()
    assert 0 < DecodedCache(tmp_path, limit=limit).size() <= limit


@pytest.mark.parametrize("theirs", ["notes.txt", "film.clip"])
def test_a_cache_has_a_folder_of_its_own(theirs, tmp_path):
    """Clips are evicted, and two files besides them are written over: none of them may be a
    user's."""
    DecodedCache(tmp_path, limit=10**6)
    (tmp_path / theirs).write_text("mine")
    with pytest.raises(UsageError, match="among other files"):
        DecodedCache(tmp_path, limit=10**6)


def test_a_cache_has_a_limit_and_lies_outside_the_lake(tmp_path, field_lake):
    with pytest.raises(UsageError, match="limit above zero"):
        DecodedCache(tmp_path, limit=0)
    with pytest.raises(UsageError, match="inside a lake"):
        DecodedCache(field_lake.path / "mcap" / "cache", limit=10**6)


def test_a_disk_that_refuses_is_a_clear_error(tmp_path):
    cache = DecodedCache(tmp_path / "cache", limit=10**6)
    (tmp_path / "cache" / "tally").mkdir()
    with pytest.raises(FlagdataError, match="writing the decoded cache failed"):
        get(cache, 1)
