"""A film that is made fit while it is read: once or twice decoded, in a part, within a crop,
against a given size."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.core.arrays import UInt8Array
from flagdata.errors import UsageError
from flagdata.ingest import CropBox
from flagdata.ingest.films.film_array import Frames
from measure.estimate import steps
from measure.film import ConditionedFilm, conditioned_film
from tests.measure.estimate.conftest import RATE
from tests.models.conditioning.test_conditioning import TIMES, Drawn, swaying

TWO = Drawn(flags=((20, 40, 80, 60), (160, 60, 48, 36)))


def film(drawn: Drawn) -> Frames:
    return Frames(time=TIMES, images=drawn.frames())


def read(made: ConditionedFilm, first: float = 0.0, last: float = 10.0) -> UInt8Array:
    return np.stack([picture for _, picture in made.frames(first, last)])


def kinds(made: ConditionedFilm) -> set[str]:
    return {finding.kind for finding in made.findings()}


def test_a_film_too_large_to_be_held_is_read_twice_and_shows_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    source = film(Drawn())
    held = read(ConditionedFilm(source))
    monkeypatch.setattr(conditioned_film, "_HELD", 3 * source.images[0].nbytes)
    np.testing.assert_array_equal(read(ConditionedFilm(source)), held)


def test_every_frame_of_the_search_advances_it_before_the_first_one_is_shown() -> None:
    made, advanced = ConditionedFilm(film(Drawn())), []
    made.searched = lambda total, count: advanced.append((total, count))
    next(iter(made.frames(0.4, 0.8)))
    assert advanced == [(10, 1)] * 11


def test_a_part_of_a_film_has_its_own_instants(monkeypatch: pytest.MonkeyPatch) -> None:
    made = ConditionedFilm(film(Drawn()))
    times = [time for time, _ in made.frames(0.4, 0.8)]
    np.testing.assert_allclose(times, np.arange(10, 21) / RATE)


def test_a_crop_confines_the_search_for_the_flag_and_does_not_cut_it() -> None:
    made = ConditionedFilm(film(TWO), crop=CropBox(x=140, y=40, width=80, height=70))
    read(made)
    found = made.figures
    assert found is not None
    (flag,) = found["flags"]
    assert 150 < flag["box"][0] < 170
    assert "several-flags-found" not in kinds(made)
    with pytest.raises(UsageError, match="beyond the picture of 240 × 180 px"):
        ConditionedFilm(film(TWO), crop=CropBox(x=200, y=0, width=80, height=70))


def test_the_second_of_two_flags_is_measured_where_it_is_chosen() -> None:
    made = ConditionedFilm(film(TWO), flag=2)
    assert "several-flags-found" not in kinds(made)  # nothing was read yet
    read(made)
    found = made.figures
    assert found is not None
    assert (len(found["flags"]), found["chosen"]) == (2, 2)
    assert found["square"][0] + found["square"][2] / 2 > 150
    assert "several-flags-found" not in kinds(made)  # the choice is made
    picture = steps(made)
    assert picture is not None
    assert picture.startswith("data:image/jpeg")


def test_what_the_camera_did_is_stated_with_its_figures() -> None:
    still, moving = ConditionedFilm(film(Drawn())), ConditionedFilm(film(Drawn(shift=swaying(2.0))))
    read(still)
    read(moving)
    assert "camera-still" in kinds(still)
    (found,) = [finding for finding in moving.findings() if finding.kind == "camera-moves"]
    shake = float(np.sqrt(np.square(np.diff(swaying(2.0), axis=0)).sum(axis=1).mean()))
    document = moving.figures
    assert document is not None
    assert document["camera"]["shake"] == pytest.approx(shake, rel=0.03)
    assert f"shakes {document['camera']['shake']:.2f} px" in found.what
    assert moving.sentences[0] == found.what


def test_a_flag_that_is_longer_than_the_size_that_was_given_contradicts_it() -> None:
    # The drawn flag is 80 px long and 56 px high at its hoist: 1.4, a little less with its flutter.
    fitting, wrong = (
        ConditionedFilm(film(Drawn()), aspect=1.5),
        ConditionedFilm(film(Drawn()), aspect=1.0),
    )
    read(fitting)
    read(wrong)
    assert "flag-size-contradicted" not in kinds(fitting)
    (found,) = [finding for finding in wrong.findings() if finding.kind == "flag-size-contradicted"]
    assert found.value == pytest.approx(1.4, abs=0.15)


def test_a_film_of_two_frames_is_shown_as_it_is() -> None:
    images = Drawn().frames()[:2]
    made = ConditionedFilm(Frames(time=TIMES[:2], images=images))
    np.testing.assert_array_equal(read(made), images)
    assert made.figures is None
    assert steps(made) is None
    assert made.sentences == ()
