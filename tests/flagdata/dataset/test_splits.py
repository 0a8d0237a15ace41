"""No recording, session, day, seed, camera file or mesh sequence is on two sides of a split."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flagdata.dataset import ExplicitSplit, HashedSplit
from flagdata.dataset.splits import Origin, groups, refuse_leaks
from flagdata.errors import RefusedError, UsageError

real = st.builds(
    Origin,
    recording=st.integers(0, 10**6).map(lambda n: f"real{n}"),
    session=st.one_of(st.none(), st.sampled_from([f"site{k}" for k in range(12)])),
    days=st.lists(
        st.integers(1, 28).map(lambda d: f"2026-05-{d:02d}"), min_size=1, max_size=2, unique=True
    ).map(tuple),
    sources=st.lists(st.integers(0, 40).map(lambda n: f"camera {n}"), max_size=2, unique=True).map(
        tuple
    ),
)
simulated = st.builds(
    Origin,
    recording=st.integers(0, 10**6).map(lambda n: f"sim{n}"),
    session=st.none(),
    days=st.just(("1970-01-01",)),
    seed=st.integers(0, 30),
)
origins = st.lists(
    st.one_of(real, simulated), min_size=1, max_size=40, unique_by=lambda origin: origin.recording
)


@given(origins, st.text(max_size=5))
def test_nothing_that_connects_recordings_is_on_two_sides(recordings, salt):
    sides = HashedSplit(salt=salt).assign(recordings)
    for (a, side_a), (b, side_b) in itertools.combinations(zip(recordings, sides, strict=True), 2):
        if side_a != side_b:
            assert a.session is None or a.session != b.session
            assert not set(a.sources) & set(b.sources)
            assert a.seed is None or a.seed != b.seed
            assert a.seed is not None or b.seed is not None or not set(a.days) & set(b.days)
    by_side = {
        side: [o for o, s in zip(recordings, sides, strict=True) if s == side]
        for side in set(sides)
    }
    refuse_leaks(by_side)


@given(origins, st.randoms(use_true_random=False))
def test_a_split_does_not_depend_on_the_order_of_recordings(recordings, random):
    shuffled = list(recordings)
    random.shuffle(shuffled)
    split = HashedSplit()
    before = dict(zip([o.recording for o in recordings], split.assign(recordings), strict=True))
    after = dict(zip([o.recording for o in shuffled], split.assign(shuffled), strict=True))
    assert before == after


@given(st.lists(real, min_size=1, max_size=20, unique_by=lambda o: o.recording), st.integers(1, 20))
def test_recordings_of_new_days_and_sessions_move_nothing(recordings, count):
    added = [
        Origin(recording=f"new{k}", session=f"new site {k}", days=(f"2027-01-{k + 1:02d}",))
        for k in range(count)
    ]
    split = HashedSplit()
    assert split.assign([*recordings, *added])[: len(recordings)] == split.assign(recordings)


def test_a_later_recording_of_a_known_session_joins_its_side_and_moves_nothing():
    split = HashedSplit()
    for site in range(30):
        first = Origin(
            recording=f"a{site}", session=f"site{site}", days=(f"2026-05-{site + 1:02d}",)
        )
        later = Origin(recording=f"b{site}", session=f"site{site}", days=("2026-07-01",))
        assert split.assign([first, later]) == split.assign([first]) * 2


def test_a_chain_of_shared_sessions_and_days_is_one_group():
    chain = [
        Origin(recording="a", session="north", days=("2026-05-01",)),
        Origin(recording="b", session="south", days=("2026-05-01",)),
        Origin(recording="c", session="south", days=("2026-05-09",)),
        Origin(recording="d", session="west", days=("2026-05-10",)),
        Origin(recording="e", session="west", days=("2026-05-11",), sources=("camera 1",)),
        Origin(recording="f", session="east", days=("2026-05-12",), sources=("camera 1",)),
    ]
    assert groups(chain).tolist() == [0, 0, 0, 1, 1, 1]


def test_a_recording_across_midnight_joins_both_days():
    night = Origin(recording="n", days=("2026-05-01", "2026-05-02"))
    days = [
        Origin(recording="a", days=("2026-05-01",)),
        Origin(recording="b", days=("2026-05-02",)),
    ]
    assert len(set(groups([*days, night]).tolist())) == 1
    assert len(set(groups(days).tolist())) == 2


def test_simulations_are_not_tied_together_by_their_conventional_day():
    simulations = [Origin(recording=f"s{k}", days=("1970-01-01",), seed=k) for k in range(2000)]
    sides = HashedSplit().assign(simulations)
    shares = {side: sides.count(side) / 2000 for side in ("train", "validation", "test")}
    # Binomial, n = 2000: three standard deviations are 3.1 % at 0.7 and 2.4 % at 0.15.
    assert shares["train"] == pytest.approx(0.70, abs=0.031)
    assert shares["validation"] == pytest.approx(0.15, abs=0.024)
    assert shares["test"] == pytest.approx(0.15, abs=0.024)


def test_another_salt_is_another_split():
    simulations = [Origin(recording=f"s{k}", seed=k) for k in range(100)]
    assert HashedSplit(salt="a").assign(simulations) != HashedSplit(salt="b").assign(simulations)


def test_a_side_without_a_share_gets_nothing():
    split = HashedSplit(fractions={"train": 0.5, "test": 0.5, "never": 0.0})
    assert set(split.assign([Origin(recording=f"s{k}", seed=k) for k in range(200)])) == {
        "train",
        "test",
    }


def test_an_explicit_split_that_leaks_is_refused_and_the_leak_is_named():
    for shared, named in (
        ({"session": "field"}, "session field"),
        ({"days": ("2026-05-01",)}, "day 2026-05-01"),
        ({"seed": 7}, "seed 7"),
        ({"sources": ("camera abc",)}, "camera abc"),
    ):
        with pytest.raises(RefusedError, match=f"{named} is in train and in test"):
            refuse_leaks(
                {
                    "train": [Origin(recording="a", **shared)],
                    "test": [Origin(recording="b", **shared)],
                }
            )
    with pytest.raises(
        RefusedError, match="recording a is in train and in test"
    ):  # whatever else is unknown
        refuse_leaks({"train": [Origin(recording="a")], "test": [Origin(recording="a")]})


def test_sides_that_share_nothing_are_let_through():
    refuse_leaks(
        {
            "train": [
                Origin(recording="a", session="north", days=("2026-05-01",)),
                Origin(recording="s", seed=1),
            ],
            "test": [
                Origin(recording="b", session="south", days=("2026-05-02",)),
                Origin(recording="t", seed=2),
            ],
        }
    )


def test_fractions_that_do_not_add_up_and_unknown_sides_are_refused():
    for fractions in ({}, {"train": 0.5}, {"train": 1.5, "test": -0.5}, {"train": float("nan")}):
        with pytest.raises(UsageError):
            HashedSplit(fractions=fractions)
    with pytest.raises(UsageError):
        ExplicitSplit(where={})
