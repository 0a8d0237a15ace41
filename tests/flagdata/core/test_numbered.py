"""Numbers of names: of any size, in any script, and never a length."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.core.numbered import Ordinal, by_numbers, gap, read_bounded


def test_a_bounded_number_is_at_most_its_bound() -> None:
    assert [
        read_bounded(digits, most=120) for digits in ("0", "007", "120", "121", "9" * 5000)
    ] == [
        0,
        7,
        120,
        None,
        None,
    ]
    assert [read_bounded(text, most=120) for text in ("", "-1", "1.5", "1e3", "²", " 1")] == [
        None
    ] * 6
    assert read_bounded("٣", most=120) == 3


@pytest.mark.parametrize(
    "of_length",
    [range, np.arange, np.zeros, lambda n: [0] * n],
    ids=["range", "arange", "zeros", "list"],
)
def test_an_ordinal_is_no_length(of_length) -> None:
    with pytest.raises((TypeError, ValueError)):
        of_length(Ordinal.read("3"))


def test_a_gap_is_the_difference_of_neighbours() -> None:
    numbers = [Ordinal.read(digits) for digits in ("1", "0", str(10**30), "1", "5")]
    missing = gap(numbers)
    assert missing is not None
    assert (missing.count, f"{missing.after:04d}") == (3 + 10**30 - 6, "0001")
    assert gap([Ordinal.read("7"), Ordinal.read("8")]) is None
    assert gap([]) is None


def test_an_ordinal_is_read_within_a_bound_or_not_at_all() -> None:
    assert (Ordinal.read("12").up_to(12), Ordinal.read("13").up_to(12)) == (12, None)
    for text in ("", "-1", "²", "9" * 5000):
        with pytest.raises(ValueError, match="no number"):
            Ordinal.read(text)


def test_names_sort_by_their_numbers() -> None:
    names = ["b1", "a10", "a²3", "a9", f"a{10**300}", "a09", "A2", "9", "10"]
    assert sorted(names, key=by_numbers) == [
        "9",
        "10",
        "A2",
        "a09",
        "a9",
        "a10",
        f"a{10**300}",
        "a²3",
        "b1",
    ]
