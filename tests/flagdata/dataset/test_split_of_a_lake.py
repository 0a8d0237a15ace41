"""Whatever a lake holds, what `pairs` gives for two sides shares no clip, recording, session, day,
seed or camera."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import flagdata
from flagdata.core.schema import Kind
from flagdata.dataset import HashedSplit
from flagdata.errors import RefusedError
from flagdata.lake import Artifact, Lake
from tests.flagdata.dataset.conftest import write_record

NS = 1_000_000_000
NOON = 1_777_636_800 * NS
SIDES = ("train", "validation", "test")


@pytest.fixture(scope="module")
def tangled(tmp_path_factory, made):
    """A lake of 80 recordings, and each one's film. They are tangled by sessions over several days,
    days over several sessions, films that were ingested twice, and seeds rendered twice; each has a
    record of two frames."""
    lake = Lake.create(tmp_path_factory.mktemp("tangled") / "lake")
    generator = np.random.default_rng(7)
    films = {}
    with lake.transaction("tangle") as transaction:
        for number in range(80):
            path = transaction.staging(".mcap")
            write_record(path, made(number=number, frames=2))
            stored = transaction.put(path)
            simulated = number % 3 == 0
            film, day = int(generator.integers(0, 45)), int(generator.integers(0, 40))
            camera = Artifact(
                kind=Kind.CAMERA,
                name=f"film {film}",
                source_hash=f"{film:064x}",
                recipe={"crop": number % 2},
            )
            if not simulated:
                transaction.add(camera)
            recording = Artifact(
                kind=Kind.RECORDING,
                name=f"recording {number}",
                object=stored,
                parents=() if simulated else (camera.id,),
                recipe={"number": number},
                session=None
                if simulated or number % 5 == 0
                else f"site {int(generator.integers(0, 25))}",
                seed=int(generator.integers(0, 18)) if simulated else None,
            )
            transaction.add(recording)
            films[recording.id] = None if simulated else film
            for clip in range(3):
                own = Artifact(
                    kind=Kind.CLIP,
                    name=recording.name,
                    object=stored,
                    parents=(recording.id,),
                    recording=recording.id,
                    recipe={"frames": 30, "window": 60.0},
                    session=recording.session,
                    seed=recording.seed,
                    day=None if simulated else f"2026-{day // 28 + 1:02d}-{day % 28 + 1:02d}",
                    start=NOON + clip,
                    end=NOON + clip + 1,
                    frame_first=30 * clip,
                    frame_count=30,
                    wind=float(generator.uniform(1, 10)),
                    wind_sigma=0.1,
                    wind_coverage=1.0,
                    wind_staleness=0.0,
                    clock_sigma=0.1,
                )
                transaction.add(own)
    return lake, films


@pytest.mark.parametrize("salt", [str(k) for k in range(4)])
def test_no_two_sides_share_anything_that_connects(tangled, salt):
    lake, films = tangled
    source = flagdata.open(lake.path)
    split_by = HashedSplit(fractions={"train": 0.4, "validation": 0.3, "test": 0.3}, salt=salt)
    held: dict[str, list[set]] = {}
    for side, where in zip(SIDES, ("wind < 8", None, "wind > 2"), strict=True):
        try:
            table = source.pairs(where, split=side, split_by=split_by).table
        except RefusedError:
            continue
        held[side] = [
            set(table.artifact.tolist()),
            set(table.recording.tolist()),
            set(table.session.tolist()) - {""},
            set(table.day.tolist()) - {""},
            set(table.seed[table.seeded].tolist()),
            {films[recording] for recording in table.recording.tolist()} - {None},
        ]
    assert len(held) >= 2
    for one, other in itertools.combinations(held.values(), 2):
        for mine, theirs in zip(one, other, strict=True):
            assert not mine & theirs


def test_every_clip_is_on_exactly_one_side(tangled):
    lake, _ = tangled
    source = flagdata.open(lake.path)
    split_by = HashedSplit(fractions={"train": 0.4, "validation": 0.3, "test": 0.3})
    everything = source.pairs()
    assert len(everything) + len(everything.refused) == 240
    sides = [source.pairs(split=side, split_by=split_by).table.artifact.tolist() for side in SIDES]
    refused = {
        r.artifact for side in SIDES for r in source.pairs(split=side, split_by=split_by).refused
    }
    together = list(itertools.chain(*sides))
    assert len(together) == len(set(together))
    assert len(set(together) | refused) == 240


def test_sizes_of_the_sides_are_those_of_their_pairs(tangled):
    lake, _ = tangled
    source = flagdata.open(lake.path)
    split_by = HashedSplit(fractions={"train": 0.4, "validation": 0.3, "test": 0.3})
    for where in (None, "seed is not null"):
        sizes = source.sides(where, split_by=split_by)
        assert list(sizes) == list(SIDES)
        assert sum(size.clips for size in sizes.values()) == (240 if where is None else 81)
        for side, size in sizes.items():
            if size.clips:
                pairs = source.pairs(where, split=side, split_by=split_by)
                assert len(pairs) + len(pairs.refused) == size.clips
            assert size.groups <= size.recordings <= size.clips
    # A seed is rendered by several recordings, and those are one group: as many groups as seeds.
    seeds = set(source.pairs("seed is not null").table.seed.tolist())
    assert sum(
        size.groups for size in source.sides("seed is not null", split_by=split_by).values()
    ) == len(seeds)
