"""The films of `no-flag`, and the arithmetic of its sheet."""

from __future__ import annotations

from itertools import islice

import numpy as np

from tests.studies.validation.no_flag import COUNT, HEIGHT, OF_EACH, WIDTH, counts, films, page


def test_films_follow_from_the_seed_and_half_of_a_kind_have_a_post() -> None:
    first = list(islice(films(3), OF_EACH))
    again = next(films(3))
    other = next(films(4))
    assert [(kind, post) for kind, post, _ in first] == [("leaves", bool(k % 2)) for k in range(OF_EACH)]
    assert all(film.shape == (COUNT, HEIGHT, WIDTH) for _, _, film in first)
    np.testing.assert_array_equal(again[2], first[0][2])
    assert not np.array_equal(other[2], first[0][2])


def test_the_sheet_counts_what_is_refused_and_the_reasons_that_come_first() -> None:
    rows = [
        {"film": "fire", "kinds": ["no-pole", "no-hoist"], "wind": None},
        {"film": "fire", "kinds": [], "wind": 4.0},
        {"film": "birds", "kinds": ["no-hoist"], "wind": None},
    ]
    assert counts(rows) == {
        "fire": {"films": 2, "refused": 1, "first": {"no-pole": 1}},
        "birds": {"films": 1, "refused": 1, "first": {"no-hoist": 1}},
    }
    text = page({"seed": 3, "fixed_on": "2", "counts": counts(rows), "films": rows})
    assert "1 of 3 films of seed 3 are answered" in text
    assert "| fire | 2 | 1 | `no-pole` 1 |" in text
