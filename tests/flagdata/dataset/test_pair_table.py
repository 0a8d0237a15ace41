"""The flat arrays that workers get: every value of the catalog's rows in its place."""

from __future__ import annotations

import json
from dataclasses import fields, replace

import numpy as np
import pyarrow as pa
import pytest

from flagdata.core.schema import CATALOG
from flagdata.dataset import COLUMNS, PairTable
from flagdata.errors import CorruptError


def rows(*changes):
    base = {
        "artifact": "a",
        "recording": "r",
        "session": None,
        "day": None,
        "seed": None,
        "object": "mcap/" + "0" * 64,
        "frame_first": 0,
        "frame_count": 30,
        "start": 0,
        "end": 1,
        "wind": 5.0,
        "wind_sigma": 0.1,
        "wind_coverage": 1.0,
        "wind_staleness": 0.5,
        "clock_sigma": 0.2,
        "parameters": None,
        "recipe": "{}",
    }
    schema = pa.schema([(name, CATALOG[name].type) for name in COLUMNS])
    return pa.Table.from_pylist(
        [{**base, "artifact": f"a{k}", **change} for k, change in enumerate(changes)], schema
    )


def test_null_becomes_what_no_tolerance_lets_through():
    names = ("wind", "wind_sigma", "wind_coverage", "wind_staleness", "clock_sigma")
    table = PairTable.of(rows(dict.fromkeys(names)))
    assert np.isnan(table.wind[0])
    assert np.isnan(table.wind_sigma[0])
    assert np.isnan(table.clock_sigma[0])
    assert table.coverage[0] == 0
    assert table.staleness[0] == np.inf
    assert (table.session[0], table.day[0], bool(table.seeded[0])) == ("", "", False)


def test_a_seed_of_zero_is_a_seed():
    table = PairTable.of(rows({"seed": 0}, {"seed": None}, {"seed": 2**62 + 1}))
    assert table.seeded.tolist() == [True, False, True]
    assert table.seed[2] == 2**62 + 1


def test_numbers_among_the_parameters_are_columns_and_the_rest_stays_in_the_catalog():
    first = {
        "wind_speed": 3,
        "cloth": {"bending": 1e-5, "name": "silk"},
        "folded": True,
        "tags": [1, 2],
    }
    table = PairTable.of(
        rows(
            {"parameters": json.dumps(first)}, {"parameters": None}, {"parameters": '{"pole": 2.5}'}
        )
    )
    assert table.names.tolist() == ["cloth.bending", "folded", "pole", "wind_speed"]
    assert table.parameters_of(0) == {"wind_speed": 3.0, "cloth.bending": 1e-5, "folded": 1.0}
    assert table.parameters_of(1) == {}
    assert table.parameters_of(2) == {"pole": 2.5}


def test_pairs_are_in_the_order_of_recording_and_frame():
    table = PairTable.of(
        rows(
            {"recording": "s", "frame_first": 0},
            {"recording": "r", "frame_first": 30},
            {"recording": "r"},
        )
    )
    pairs = list(zip(table.recording.tolist(), table.frame_first.tolist(), strict=True))
    assert pairs == [("r", 0), ("r", 30), ("s", 0)]


def test_taking_pairs_keeps_each_with_its_object_and_parameters():
    objects = ["mcap/" + digit * 64 for digit in "abc"]
    changes = [{"object": name, "parameters": f'{{"p{k}": {k}}}'} for k, name in enumerate(objects)]
    taken = PairTable.of(rows(*changes)).take(np.array([2, 1]))
    assert taken.objects[taken.object].tolist() == [objects[2], objects[1]]
    assert taken.objects.tolist() == objects[1:]
    assert [taken.parameters_of(k) for k in range(2)] == [{"p2": 2.0}, {"p1": 1.0}]
    assert len(taken.take(np.array([], dtype=np.int64))) == 0


def test_the_fingerprint_depends_on_every_value():
    table = PairTable.of(
        rows({"parameters": '{"p": 1}'}, {"parameters": '{"p": 2}', "object": "mcap/" + "1" * 64})
    )
    overlooked = []
    for field in (f.name for f in fields(PairTable) if f.name != "names"):
        values = getattr(table, field).copy()
        at = (0,) * values.ndim
        if values.dtype.kind == "U":
            values[at] = "z" + str(values[at])[1:]
        elif values.dtype.kind == "f":
            values[at] = np.nextafter(values[at], np.inf)
        else:
            values[at] = not values[at]
        overlooked += [field] * (
            replace(table, **{field: values}).fingerprint() == table.fingerprint()
        )
    assert overlooked == []


def test_a_clip_that_is_nowhere_is_an_error_that_names_it():
    for column in ("object", "frame_first", "frame_count", "start", "end"):
        with pytest.raises(CorruptError, match=f"artifact a1: a clip has no {column}"):
            PairTable.of(rows({}, {column: None}))
