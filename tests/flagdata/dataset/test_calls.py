"""The calls of `flagdata` on a lake: their arrays are those of its catalog and records."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

import flagdata
from flagdata.errors import NotFoundError, UnknownNameError
from flagdata.lake import Lake

NS = 1_000_000_000


def test_rows_of_a_query_are_arrays_with_their_gaps(field_lake: Lake) -> None:
    rows = flagdata.query(
        field_lake, "session = 'site0'", columns=["kind", "wind"], order="kind, start, artifact"
    )
    assert rows.columns == ("kind", "wind")
    assert Counter(rows["kind"].tolist()) == {"clip": 6, "recording": 2}
    clips = rows["kind"] == "clip"
    np.testing.assert_allclose(
        rows["wind"][clips], [3.0] * 3 + [4.0] * 3, atol=0.5
    )  # gusts of 0.5 m/s about the mean
    assert np.isnan(rows["wind"][~clips]).all()
    assert next(iter(rows)) == {"kind": "clip", "wind": rows["wind"][0]}
    assert repr(rows).splitlines()[:2] == ["Rows(8 of 2 columns)", "kind       wind"]
    assert "<td>recording</td>" in rows._repr_html_()


def test_a_lake_says_what_it_holds_and_gives_pairs(field_lake: Lake) -> None:
    lake = flagdata.open(field_lake.path)
    assert repr(lake).endswith(": 8 camera, 48 clip, 16 recording)")
    assert (
        flagdata.pairs(lake, "wind > 5", at="v1").fingerprint
        == lake.pairs("wind > 5", at="v1").fingerprint
    )
    assert "<th" in lake.pairs(at="v1")._repr_html_()


def test_wind_and_frames_of_a_recording_are_those_of_its_record(field_lake: Lake) -> None:
    (name,) = {
        row["name"]
        for row in flagdata.query(field_lake, "kind = 'recording' and session = 'site0'")
    } & {"recording 0"}
    wind = flagdata.wind(name, lake=field_lake)
    seconds = np.arange(len(wind.time))
    np.testing.assert_allclose(wind.time, seconds)
    np.testing.assert_allclose(wind.speed, 3.0 + 0.5 * np.sin(2 * np.pi * seconds / 12))
    assert np.isnan(wind.direction).all()
    assert "cup" in repr(wind)
    film = flagdata.frames(name, lake=field_lake, start=1.0, end=2.0)
    np.testing.assert_allclose(film.time, np.arange(26) / 25)
    assert film.images.shape == (26, 32, 32)
    whole = flagdata.frames(name, lake=field_lake)
    assert film.start == (whole.start or 0) + NS
    np.testing.assert_array_equal(film.images, whole.images[25:51])
    moved = flagdata.motion(name, lake=field_lake)
    np.testing.assert_array_equal(moved.energy, flagdata.motion(whole).energy)
    np.testing.assert_allclose(moved.time, (np.arange(94) + 0.5) / 25)
    assert "94 pairs of frames" in repr(moved)


def test_what_is_no_film_log_or_mesh_is_refused_with_the_way_out(field_lake: Lake) -> None:
    with pytest.raises(NotFoundError, match="no lake was named"):
        flagdata.frames("no-such.mp4")
    with pytest.raises(NotFoundError, match="give lake="):
        flagdata.wind("no-such.csv")
    with pytest.raises(UnknownNameError, match="unknown mesh sequence of the lake 'recording 0'"):
        flagdata.meshes("recording 0", lake=field_lake)
