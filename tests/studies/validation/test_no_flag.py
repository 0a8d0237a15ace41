"""The films of `no-flag`, and the arithmetic of its sheet."""

from __future__ import annotations

from itertools import islice

import numpy as np

from tests.studies.validation.no_flag import COUNT, HEIGHT, WIDTH, counts, films, page


def test_films_follow_from_the_seed_and_half_of_a_kind_have_a_post() -> None:
    (kind, post, film), (_, beside, _) = islice(films(3), 2)
    assert (kind, post, beside) == ("leaves", False, True)
    assert film.shape == (COUNT, HEIGHT, WIDTH)
    np.testing.assert_array_equal(next(films(3))[2], film)
    assert not np.array_equal(next(films(4))[2], film)


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
