"""The same (tag, seed) gives the same batches, whatever the workers, and a saved cursor takes them
up bit for bit."""

from __future__ import annotations

import json
import multiprocessing
import threading
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
import torch

import flagdata
from flagdata.core.rng import stream
from flagdata.core.schema import TOPIC_IMAGE
from flagdata.dataset import DecodedCache, collate
from flagdata.errors import CorruptError, RefusedError, UsageError
from flagdata.lake import Lake
from flagdata.record import open_bytes, read_messages, read_summary
from tests.flagdata.dataset.conftest import add_recording


@pytest.fixture(scope="module")
def pairs(field_lake):
    return flagdata.open(field_lake.path).pairs(at="v1", seed=11)


@pytest.fixture
def lake_to_damage(tmp_path, made):
    """A lake of one recording, and the file that holds it."""
    lake = Lake.create(tmp_path / "lake")
    identity = add_recording(lake, made(number=1))
    return lake, lake.object_path(lake.artifact(identity).object)


def contents(batch):
    """All of a batch in comparable form: bytes of tensors, tuples as they are."""
    out = {}
    for field in fields(batch):
        value = getattr(batch, field.name)
        if isinstance(value, torch.Tensor):
            out[field.name] = (value.dtype, tuple(value.shape), value.numpy().tobytes())
        elif field.name == "parameters":
            out[field.name] = {name: column.numpy().tobytes() for name, column in value.items()}
        else:
            out[field.name] = value
    return out


def epoch(loader):
    return [contents(batch) for batch in loader]


@pytest.fixture(scope="module")
def expected(pairs):
    """Two epochs read in this process."""
    loader = pairs.loader(7)
    return [epoch(loader), epoch(loader)]


@pytest.mark.parametrize(("workers", "run_in"), [(1, "threads"), (5, "threads"), (2, "fork")])
def test_batches_are_identical_with_any_number_of_workers(pairs, expected, workers, run_in):
    loader = pairs.loader(7, workers=workers, run_in=run_in)
    assert epoch(loader) == expected[0]
    assert epoch(loader) == expected[1]


@pytest.mark.parametrize("run_in", ["fork", "spawn", "forkserver"])
def test_worker_processes_need_nothing_of_the_catalog(field_lake, expected, run_in):
    # The catalog was used in this process just now: what the workers inherit must not need it.
    fresh = flagdata.open(field_lake.path).pairs(at="v1", seed=11)
    assert epoch(fresh.loader(7, workers=1, run_in=run_in)) == expected[0]


def test_an_epoch_holds_every_pair_once_in_another_order_than_the_last(pairs, expected):
    seen = [[artifact for batch in one for artifact in batch["artifact"]] for one in expected]
    assert sorted(seen[0]) == sorted(seen[1]) == sorted(pairs.table.artifact.tolist())
    assert seen[0] != seen[1]
    assert len(expected[0]) == 7  # 48 pairs in batches of 7
    assert len(expected[0][-1]["artifact"]) == 6


def test_another_seed_is_another_order_of_the_same_pairs(field_lake, expected):
    other = flagdata.open(field_lake.path).pairs(at="v1", seed=12)
    assert epoch(other.loader(7)) != expected[0]


def test_stored_order_is_by_recording_and_frame(pairs):
    seen = [artifact for batch in pairs.loader(5, order="stored") for artifact in batch.artifact]
    assert seen == pairs.table.artifact.tolist()


def test_the_last_batch_may_be_dropped(pairs):
    loader = pairs.loader(7, last="drop")
    assert len(loader) == 6
    assert [len(batch) for batch in loader] == [7] * 6


WAYS = [{}, {"workers": 2}, {"workers": 2, "run_in": "fork"}]


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("stop", [1, 6, 7, 9])
def test_a_saved_cursor_continues_bit_for_bit_in_another_process(field_lake, expected, way, stop):
    flat = expected[0] + expected[1]
    pairs = flagdata.open(field_lake.path).pairs(at="v1", seed=11)
    loader = pairs.loader(7, **way)
    done = 0
    while done < stop:
        for _ in loader:
            done += 1
            if done == stop:
                break
    state = json.loads(json.dumps(loader.state_dict()))  # a state survives as text
    again = flagdata.open(field_lake.path).pairs(at="v1", seed=11).loader(7)
    again.load_state_dict(state)
    rest = epoch(again)
    if again.epoch < 2:
        rest += epoch(again)
    assert rest == flat[stop:]


@pytest.mark.parametrize("way", WAYS)
def test_an_iteration_left_early_is_taken_up_where_it_stopped(pairs, expected, way):
    loader = pairs.loader(7, **way)
    first = [contents(batch) for batch, _ in zip(loader, range(3), strict=False)]
    # zip asks for a fourth batch before it stops: that one was handed out too.
    assert first == expected[0][:3]
    assert (loader.epoch, loader.cursor) == (0, 4)
    assert epoch(loader) == expected[0][4:]


@pytest.mark.parametrize("way", WAYS)
def test_a_loader_in_use_can_be_set_back(pairs, expected, way):
    loader = pairs.loader(7, **way)
    begin = loader.state_dict()
    for _, _ in zip(loader, range(3), strict=False):
        pass
    loader.load_state_dict(begin)
    assert epoch(loader) == expected[0]


def test_shares_of_processes_that_train_together_are_equal_and_disjoint(pairs, expected):
    shares = [epoch(pairs.loader(7, share=(index, 3), workers=2)) for index in range(3)]
    assert [len(share) for share in shares] == [2, 2, 2]  # of 7 batches; the seventh is in no share
    assert [batch for turn in zip(*shares, strict=True) for batch in turn] == expected[0][:6]


_WAYS = [(0, "threads"), (1, "fork"), (4, "fork"), (2, "spawn"), (1, "forkserver")]


@pytest.mark.filterwarnings("ignore:This DataLoader will create")
@pytest.mark.parametrize("shares", [(1, 2), (2, 1), (2, 3)])
def test_another_number_of_shares_and_workers_takes_up_exactly_what_an_epoch_has_left(
    pairs, expected, shares
):
    before, after = shares
    handed, states = [], []
    for index in range(before):
        loader = pairs.loader(7, share=(index, before))
        handed.append([contents(batch) for _, batch in zip(range(2), loader, strict=False)])
        states.append(loader.state_dict())
    handed = [batch for turn in zip(*handed, strict=True) for batch in turn]
    assert handed == expected[0][: 2 * before]
    later = []
    for index in range(after):
        workers, run_in = _WAYS[(before + 2 * after + index) % 3]
        loader = pairs.loader(7, share=(index, after), workers=workers, run_in=run_in)
        loader.load_state_dict(states[index % before])
        later.append(epoch(loader))
        assert (loader.epoch, loader.cursor) == (1, 0)
        assert loader.order_hash(0) == pairs.loader(7).order_hash(0)
    left = (len(expected[0]) - 2 * before) // after * after
    assert [batch for turn in zip(*later, strict=True) for batch in turn] == expected[0][
        2 * before :
    ][:left]


@pytest.mark.filterwarnings("ignore:This DataLoader will create")
@pytest.mark.parametrize(("workers", "run_in"), _WAYS[3:])
def test_processes_started_anew_take_up_a_state_of_two_shares(pairs, expected, workers, run_in):
    loader = pairs.loader(7, share=(1, 2))
    next(iter(loader))
    alone = pairs.loader(7, workers=workers, run_in=run_in)
    alone.load_state_dict(json.loads(json.dumps(loader.state_dict())))
    assert epoch(alone) == expected[0][2:]


def test_a_state_in_the_middle_of_shares_taken_up_anew_goes_on_with_as_many(pairs, expected):
    two = [pairs.loader(7, share=(index, 2)) for index in range(2)]
    one = pairs.loader(7)
    next(iter(one))
    for loader in two:
        loader.load_state_dict(one.state_dict())
    second = pairs.loader(7, share=(1, 2))
    next(iter(two[1]))
    second.load_state_dict(two[1].state_dict())
    assert epoch(second) == [expected[0][4], expected[0][6]]
    old = {name: value for name, value in pairs.loader(7).state_dict().items() if name != "before"}
    one.load_state_dict(old)
    assert (one.epoch, one.cursor) == (0, 0)


def test_the_hash_of_an_order_is_of_the_data_the_seed_and_the_epoch(field_lake, pairs):
    loader, other = (
        pairs.loader(7),
        flagdata.open(field_lake.path).pairs(at="v1", seed=12).loader(7),
    )
    hashes = {
        loader.order_hash(0),
        loader.order_hash(1),
        other.order_hash(0),
        pairs.loader(8).order_hash(0),
    }
    assert len(hashes) == 4
    assert pairs.loader(7, share=(1, 2), workers=3).order_hash(1) == loader.order_hash(1)


@pytest.mark.skipif(torch.accelerator.is_available(), reason="there is an accelerator")
def test_pinned_memory_without_an_accelerator_is_an_error(pairs):
    with pytest.raises(UsageError, match="without an accelerator"):
        pairs.loader(7, memory="pinned")


@pytest.mark.skipif(not torch.accelerator.is_available(), reason="there is no accelerator")
@pytest.mark.parametrize("way", WAYS)
def test_pinned_batches_are_the_same_and_pinned(pairs, expected, way):
    batches = list(pairs.loader(7, memory="pinned", **way))
    assert all(batch.clip.is_pinned() and batch.wind.is_pinned() for batch in batches)
    assert [contents(batch) for batch in batches] == expected[0]


def test_a_state_of_other_data_or_options_is_refused_by_name(field_lake, pairs):
    state = pairs.loader(7).state_dict()
    with pytest.raises(RefusedError, match="batch_size was 7, is 8"):
        pairs.loader(8).load_state_dict(state)
    part = flagdata.open(field_lake.path).pairs("wind < 6", at="v1", seed=11)
    with pytest.raises(RefusedError, match="fingerprint was"):
        part.loader(7).load_state_dict(state)
    other = flagdata.open(field_lake.path).pairs(at="v1", seed=12)
    with pytest.raises(RefusedError, match="seed was 11, is 12"):
        other.loader(7).load_state_dict(state)
    with pytest.raises(UsageError):
        pairs.loader(7).load_state_dict({"epoch": 0})
    with pytest.raises(UsageError, match="no batch 99"):
        pairs.loader(7).load_state_dict({**state, "cursor": 99})


def test_two_iterations_of_one_loader_do_not_mix_silently(pairs):
    loader = pairs.loader(7)
    first = iter(loader)
    next(first)
    second = iter(loader)
    next(second)
    with pytest.raises(UsageError, match="another iteration"):
        next(first)


def test_loading_draws_nothing_from_the_global_random_stream(pairs):
    torch.manual_seed(5)
    expected = torch.rand(3)
    torch.manual_seed(5)
    next(iter(pairs.loader(7, workers=1, run_in="fork")))
    assert torch.equal(torch.rand(3), expected)


@pytest.mark.parametrize("run_in", ["threads", "fork"])
def test_batches_from_the_decoded_cache_are_the_same(field_lake, expected, tmp_path, run_in):
    cache = DecodedCache(tmp_path / "cache", limit=10**8)
    cached = flagdata.open(field_lake.path).pairs(at="v1", seed=11, cache=cache)
    loader = cached.loader(7, workers=2, run_in=run_in)
    assert epoch(loader) == expected[0]  # filled by two workers at once
    assert epoch(loader) == expected[1]  # read back
    assert cache.size() > 48 * 30 * 32 * 32


def test_threads_end_with_the_iteration(pairs):
    loader = pairs.loader(3, workers=3)
    iteration = iter(loader)
    next(iteration)
    assert sum(thread.name.startswith("pairs") for thread in threading.enumerate()) > 0
    del iteration
    assert not any(thread.name.startswith("pairs") for thread in threading.enumerate())


def test_an_error_in_a_thread_reaches_the_caller_at_its_batch(lake_to_damage):
    lake, path = lake_to_damage
    pairs = flagdata.open(lake.path).pairs()
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(CorruptError, match="cut off"):
        list(pairs.loader(2, workers=2))


def test_worker_processes_end_with_their_loader(pairs, monkeypatch):
    # Workers that got no signal to end are terminated after this time, 5 s as torch has it.
    monkeypatch.setattr("torch.utils.data._utils.MP_STATUS_CHECK_INTERVAL", 60.0)
    others = multiprocessing.active_children()
    loader = pairs.loader(7, workers=2, run_in="fork")
    next(iter(loader))
    children = [child for child in multiprocessing.active_children() if child not in others]
    assert len(children) == 2
    del loader
    assert [child.exitcode for child in children] == [0, 0]


def test_options_that_cannot_be_are_usage_errors(pairs):
    for options in (
        {"batch_size": 0},
        {"batch_size": 1, "workers": -1},
        {"batch_size": 1, "order": "random"},
        {"batch_size": 1, "last": "pad"},
        {"batch_size": 1, "memory": "fast"},
        {"batch_size": 1, "run_in": "fibres"},
        {"batch_size": 49, "last": "drop"},
        {"batch_size": 30, "share": (0, 3)},
        {"batch_size": 1, "share": (2, 2)},
    ):
        with pytest.raises(UsageError):
            pairs.loader(**options)


def read_in_child(pairs, connection):
    connection.send(np.asarray(pairs[5].clip))
    connection.close()


def test_a_record_that_is_open_may_be_read_after_a_fork(pairs):
    mine = pairs[5].clip.numpy()  # opens the record here
    receive, send = multiprocessing.Pipe(duplex=False)
    child = multiprocessing.get_context("fork").Process(target=read_in_child, args=(pairs, send))
    child.start()
    theirs = receive.recv()
    child.join()
    assert child.exitcode == 0
    assert np.array_equal(mine, theirs)


@pytest.mark.parametrize("workers", [0, 2])
def test_torchs_own_loader_works_too(pairs, workers):
    loader = torch.utils.data.DataLoader(pairs, batch_size=16, num_workers=workers)
    assert [a for batch in loader for a in batch.artifact] == pairs.table.artifact.tolist()
    first, direct = next(iter(loader)), collate([pairs[index] for index in range(16)])
    assert torch.equal(first.clip, direct.clip)
    assert torch.equal(first.wind, direct.wind)


FLIPS = 20


@pytest.mark.parametrize("cached", [False, True])
def test_the_loader_refuses_every_flipped_bit_of_a_frame_and_names_object_and_place(
    tmp_path: Path, made, cached: bool
) -> None:
    lake = Lake.create(tmp_path / "lake")
    recording = lake.artifact(add_recording(lake, made(number=1, frames=30)))
    path = lake.object_path(str(recording.object))
    file = open_bytes(path)
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
        assert refused.value.where == f"{path}, byte {table.offset[frame]}", (
            f"trial {trial}, byte {place}"
        )
    path.write_bytes(sound)
    assert len(list(source.pairs(cache=cache).loader(1))) == 1
