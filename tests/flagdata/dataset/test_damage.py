"""A bit that was flipped in a stored record reaches no batch."""

from __future__ import annotations

from pathlib import Path

import pytest

import flagdata
from flagdata.dataset.cache import DecodedCache
from flagdata.errors import CorruptError
from flagdata.lake import Lake
from flagdata.record.container import open_file, read_messages, read_summary
from flagdata.rng import stream
from flagdata.schema import TOPIC_IMAGE

FLIPS = 60


@pytest.mark.parametrize("cached", [False, True])
def test_the_loader_refuses_every_flipped_bit_of_a_frame_and_names_object_and_place(
    tmp_path: Path, made, add_recording, cached: bool
) -> None:
    lake = Lake.create(tmp_path / "lake")
    recording = lake.artifact(add_recording(lake, made(number=1, frames=30)))
    path = lake.object_path(str(recording.object))
    file = open_file(path)
    table = read_messages(file, read_summary(file, where=""), TOPIC_IMAGE, where="")
    sound = path.read_bytes()
    path.chmod(0o644)
    rng = stream(9, "flips")
    source = flagdata.open(lake.path)
    cache = DecodedCache(tmp_path / "cache", limit=1 << 24) if cached else None
    for trial in range(FLIPS):
        frame = int(rng.integers(0, len(table)))
        place = int(table.offset[frame]) + int(rng.integers(0, table.length[frame]))
        damaged = bytearray(sound)
        damaged[place] ^= 1 << int(rng.integers(0, 8))
        path.write_bytes(damaged)
        with pytest.raises(CorruptError) as refused:
            list(source.pairs(cache=cache).loader(1))
        assert refused.value.where == f"{path}, byte {table.offset[frame]}", f"trial {trial}, byte {place}"
    path.write_bytes(sound)
    assert len(list(source.pairs(cache=cache).loader(1))) == 1
