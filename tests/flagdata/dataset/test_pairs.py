"""A query at a version gives typed pairs; what is outside the tolerance is refused with the
reason."""

from __future__ import annotations

import math
import pickle
import re

import numpy as np
import pytest
import torch

import flagdata
from flagdata.dataset import ExplicitSplit, HashedSplit, Sample, Tolerance
from flagdata.errors import NotFoundError, RefusedError, UnknownNameError, UsageError
from flagdata.lake import Lake
from tests.flagdata.dataset.conftest import add_recording, write_record
from tests.refusals import unrefused

NS = 1_000_000_000
NOON = 1_777_636_800 * NS
DAY = 86_400 * NS
PERIOD = NS // 25


@pytest.fixture(scope="module")
def source(field_lake):
    return flagdata.open(field_lake.path)


def test_real_and_simulated_clips_are_samples_of_one_type(source):
    pairs = source.pairs(at="v1")
    assert len(pairs) == 48
    assert pairs.refused == ()
    real = next(sample for sample in pairs if sample.seed is None)
    simulated = next(sample for sample in pairs if sample.seed == 3)
    for sample in (real, simulated):
        assert isinstance(sample, Sample)
        assert sample.clip.shape == (1, 30, 32, 32)
        assert sample.clip.dtype == torch.uint8
        assert sample.end - sample.start == 29 * PERIOD
    assert real.parameters == {}
    assert real.day.startswith("2026-05-")
    assert real.wind_sigma >= 0.2
    assert simulated.parameters == {"wind_speed": 5.0, "bending": 4e-5}
    assert (simulated.wind, simulated.wind_sigma, simulated.clock_sigma, simulated.day) == (
        5.0,
        0.0,
        0.0,
        "",
    )


def test_the_clip_holds_the_frames_of_its_place_in_the_recording(
    source, field_lake, tmp_path, made
):
    pairs = source.pairs("seed is null and wind < 3.5", at="v1")  # the first recording: mean 3 m/s
    reference = write_record(tmp_path / "a.mcap", made(number=0, session="site0", mean=3.0))
    assert len(pairs) == 3
    for k, sample in enumerate(pairs):
        assert np.array_equal(sample.clip[0].numpy(), reference.frames(30 * k, 30))
        assert sample.wind == pytest.approx(3.0, abs=1e-12)


def test_a_tag_gives_the_same_pairs_after_later_commits(lake, made):
    add_recording(lake, made(number=1))
    lake.tag("v1")
    before = flagdata.open(lake.path).pairs(at="v1")
    add_recording(lake, made(number=2, start=NOON + DAY))
    after = flagdata.open(lake.path).pairs(at="v1")
    assert before.fingerprint == after.fingerprint
    assert len(flagdata.open(lake.path).pairs()) == len(before) + 3


def test_the_fingerprint_is_of_the_pairs_and_not_of_the_query(source):
    filtered = source.pairs("session = 'site0'", at="v1")
    split_by = ExplicitSplit(where={"train": "session = 'site0'", "test": "session <> 'site0'"})
    side = source.pairs(at="v1", split="train", split_by=split_by)
    assert len(filtered) == 6
    assert filtered.fingerprint == side.fingerprint
    assert side.table.objects.tolist() == filtered.table.objects.tolist()
    assert side.table.names.tolist() == []
    assert source.pairs("session = 'site1'", at="v1").fingerprint != filtered.fingerprint


def test_order_does_not_depend_on_the_order_of_commits(tmp_path, made):
    fingerprints = []
    for numbers in ((1, 2, 3), (3, 1, 2)):
        lake = Lake.create(tmp_path / f"lake{numbers[0]}")
        for number in numbers:
            add_recording(lake, made(number=number, start=NOON + number * DAY))
        fingerprints.append(flagdata.open(lake.path).pairs().fingerprint)
    assert fingerprints[0] == fingerprints[1]


def test_pairs_outside_the_tolerance_are_refused_with_every_reason(lake, made):
    add_recording(lake, made(number=1, start=NOON))
    # The log pauses from 40 s to 89 s after its start. The first clip ends at 91.16 s, so its
    # minute holds the samples 32 to 39 and 89 to 91, of which the first speaks for 0.84 s: 10.84 s
    # of 60.
    add_recording(lake, made(number=2, start=NOON + DAY, missing=(40, 89), clock_sigma=3.0))
    pairs = flagdata.open(lake.path).pairs()
    assert len(pairs) == 3
    assert len(pairs.refused) == 3
    first = pairs.refused[0]
    assert len(first.reasons) == 2
    assert first.reasons[0].startswith("wind samples cover 0.18 ")
    assert first.reasons[1] == "the camera's clock is known to ±3 s, above 1 s"
    loose = flagdata.open(lake.path).pairs(tolerance=Tolerance(clock_sigma=5.0, coverage=0.0))
    assert len(loose) == 6


def test_a_stale_log_is_refused(lake, made):
    add_recording(lake, made(number=1, missing=(80, 200)))
    with pytest.raises(RefusedError, match=r"the newest wind sample is 12\.2 s old, above 5 s"):
        flagdata.open(lake.path).pairs(tolerance=Tolerance(coverage=0.1))


def test_a_clip_without_any_wind_never_becomes_a_pair(lake, made):
    add_recording(lake, made(number=1, truth={"bending": 1e-5}, seed=1))
    everything = Tolerance(clock_sigma=math.inf, staleness=math.inf, coverage=0.0)
    with pytest.raises(RefusedError, match="no usable wind sample"):
        flagdata.open(lake.path).pairs(tolerance=everything)


def test_another_window_is_computed_anew_from_the_wind(lake, made):
    add_recording(lake, made(number=1, mean=5.0))
    minute = flagdata.open(lake.path).pairs()
    short = flagdata.open(lake.path).pairs(window=3.0)
    assert minute[0].wind == pytest.approx(5.0, abs=1e-12)
    # The clip ends 91.16 s after the log began: samples 89, 90, 91 of 5 + 0.5 sin(2π k / 12).
    expected = 5 + 0.5 * np.mean(np.sin(2 * np.pi * np.array([89, 90, 91]) / 12))
    assert short[0].wind == pytest.approx(expected, rel=1e-12)
    assert minute.fingerprint != short.fingerprint
    assert flagdata.open(lake.path).pairs(window=60.0).fingerprint == minute.fingerprint


def test_a_simulated_wind_is_the_same_over_any_window(source):
    wind = source.pairs("seed is not null", at="v1").table.wind
    assert np.array_equal(source.pairs("seed is not null", at="v1", window=5.0).table.wind, wind)


def test_sides_of_the_split_are_disjoint_and_complete(source):
    sides = {}
    for side in ("train", "validation", "test"):
        try:
            sides[side] = source.pairs(at="v1", split=side).table
        except RefusedError:
            continue
    assert sum(len(table) for table in sides.values()) == 48
    for name in ("artifact", "recording", "session", "day"):
        held = [set(getattr(table, name).tolist()) - {""} for table in sides.values()]
        assert sum(map(len, held)) == len(set.union(*held))
    seeds = [set(table.seed[table.seeded].tolist()) for table in sides.values()]
    assert sum(map(len, seeds)) == 8


def test_a_filter_does_not_move_a_clip_to_another_side(source):
    whole = source.pairs(at="v1", split="train").table
    weak = source.pairs("wind < 6", at="v1", split="train").table
    assert set(weak.artifact.tolist()) == set(whole.artifact[whole.wind < 6].tolist())


def test_an_explicit_split_is_used_as_given(source):
    split_by = ExplicitSplit(where={"train": "day < '2026-05-05'", "test": "day >= '2026-05-05'"})
    train, test = (
        source.pairs(at="v1", split=side, split_by=split_by) for side in ("train", "test")
    )
    assert (len(train), len(test)) == (12, 12)
    assert max(train.table.day) < min(test.table.day)


def test_an_explicit_split_through_a_session_is_refused_whichever_side_is_asked_for(source):
    split_by = ExplicitSplit(where={"train": "day <= '2026-05-01'", "test": "day > '2026-05-01'"})
    for side in ("train", "test"):
        with pytest.raises(RefusedError, match="session site0 is in train and in test"):
            source.pairs(at="v1", split=side, split_by=split_by)


def test_two_recordings_of_one_camera_file_are_never_on_two_sides(lake, made):
    add_recording(lake, made(number=1))
    add_recording(lake, made(number=1, start=NOON + DAY))
    split_by = ExplicitSplit(where={"train": "day = '2026-05-01'", "test": "day = '2026-05-02'"})
    with pytest.raises(RefusedError, match=r"camera 0+1 is in train and in test"):
        flagdata.open(lake.path).pairs(split="train", split_by=split_by)


def test_a_recording_that_was_aligned_anew_gives_its_clips_once(lake, made):
    old = add_recording(lake, made(number=1))
    lake.tag("before")
    new = add_recording(lake, made(number=1, start=NOON + NS))
    pairs = flagdata.open(lake.path).pairs()
    assert set(pairs.table.recording.tolist()) == {new}
    assert [(r.recording, r.reasons) for r in pairs.refused] == [
        (old, (f"recording {new} aligned the same camera and wind later",))
    ] * 3
    assert set(flagdata.open(lake.path).pairs(at="before").table.recording.tolist()) == {old}
    assert set(flagdata.open(lake.path).pairs(f"recording = '{old}'").table.recording.tolist()) == {
        old
    }


def test_a_single_session_says_that_it_is_on_one_side(lake, made, caplog):
    for number in range(2):
        add_recording(lake, made(number=number, session="pier"))
    source = flagdata.open(lake.path)
    full = max(source.sides().items(), key=lambda entry: entry[1].clips)[0]
    said = f"all 6 clips belong together (session pier), and are on the side '{full}'"
    assert len(source.pairs(split=full)) == 6
    assert [record.getMessage() for record in caplog.records] == [
        f"warning: {said}: the others are empty"
    ]
    empty = next(side for side, size in source.sides().items() if not size.clips)
    with pytest.raises(
        RefusedError, match=re.escape(f"split '{empty}' holds none of the clips; {said}")
    ):
        source.pairs(split=empty)


def test_what_is_missing_is_an_error(source):
    with pytest.raises(NotFoundError, match="no clips match"):
        source.pairs("wind > 100")
    with pytest.raises(
        RefusedError,
        match="split 'none' holds none of the clips; the catalog has 12 independent groups",
    ):
        source.pairs(
            at="v1", split="none", split_by=HashedSplit(fractions={"all": 1.0, "none": 0.0})
        )
    with pytest.raises(UnknownNameError):
        source.pairs(split="trian")
    with pytest.raises(NotFoundError):
        source.pairs(at="no-such-tag")
    with pytest.raises(UsageError):
        source.pairs("wind >")
    with pytest.raises(UsageError):
        source.pairs(window=-1.0)
    with pytest.raises(UsageError):
        Tolerance(coverage=1.5)
    with pytest.raises(NotFoundError, match="flagdata init"):
        flagdata.open("/nonexistent/lake")
    with pytest.raises(IndexError):
        source.pairs(at="v1")[48]


def test_a_filter_cannot_reach_beyond_the_clips(source):
    cases = ["wind > 4) or (1=1", "1=1) --", ""]
    assert not unrefused(lambda where: source.pairs(where), zip(cases), UsageError)


def test_a_seed_is_a_whole_number(source):
    with pytest.raises(UsageError, match="seed"):
        source.pairs(seed=1.5)


def test_a_filter_may_end_in_a_comment_and_hold_an_or(source):
    assert len(source.pairs("wind < 3.5 or wind > 9.5 -- both ends", at="v1")) == 12


def test_a_dataset_travels_by_pickle_without_its_open_files(source):
    pairs = source.pairs(at="v1")
    first = pairs[0]
    copy = pickle.loads(pickle.dumps(pairs))
    assert copy.fingerprint == pairs.fingerprint
    assert torch.equal(copy[0].clip, first.clip)
