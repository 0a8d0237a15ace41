"""A challenge whose sets are films with a cup's log."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import av
import numpy as np
import pytest

from flagdata.errors import CorruptError, InputError, RefusedError, UnknownNameError
from flagdata.ingest.films.film import CameraFilm
from measure.cloth import AZIMUTH, ELEVATION, Flag, Part
from measure.film import FlagSize
from measure.verdict import Conclusion
from tests.studies.challenge.cases import TINY, acting, filing, key, verdict
from tests.studies.challenge.design import draw
from tests.studies.challenge.filming import logged
from tests.studies.challenge.films import Filmed, read_films
from tests.studies.challenge.make import make
from tests.studies.challenge.outcome import Outcome
from tests.studies.challenge.recipe import ChallengeRecipe, Kind, load, parse
from tests.studies.challenge.score import graded

FILMED = (
    TINY.replace("rates = [25, 60]\nnoises = [0.0, 0.001]\n", "").replace(
        "duration = 0.2", "duration = 4.2"
    )
    + '[films]\nwidth = 96\npixels-high = 72\nsamples = 1\nbackgrounds = ["sky"]\n'
)


@pytest.fixture(scope="module")
def recipe() -> ChallengeRecipe:
    return parse(FILMED, where="filmed")


def test_sets_are_films_with_what_is_stated_beside_them(
    recipe: ChallengeRecipe, tmp_path: Path
) -> None:
    made = make(tmp_path / "films", recipe, seed=3, count=1)
    assert made.filmed
    given = made.films("set-001")
    assert list(given.recordings) == ["a", "b"]
    assert (given.flag.length, given.flag.height, given.distance) == (1.5, 1.0, 8.0)
    low, high = given.azimuth.at(np.array([0.16, 0.84])).tolist()
    assert math.degrees((low + high) / 2) == pytest.approx(80.0)
    assert math.degrees(high - low) / 2 == pytest.approx(5.0, rel=0.02)
    # Weighed on a scale of 3 %, the density is that of the key within 12 %.
    (sealed,) = draw(recipe, seed=3, count=1)
    assert given.area_weight is not None
    from tests.studies.challenge.simulation import material_of

    assert given.area_weight.middle == pytest.approx(material_of(sealed).area_weight, rel=0.12)
    for path, log in given.recordings.values():
        with av.open(str(path)) as film:
            shown = list(film.decode(video=0))
        assert len(shown) == 105
        assert (shown[0].width, shown[0].height) == (96, 72)
        assert len(log.times) == len(log.speed)
    (tmp_path / "films" / "sets" / "set-001" / "b.mp4").write_bytes(b"another film")
    with pytest.raises(CorruptError, match="not those that were published"):
        made.films("set-001")


def test_a_film_that_shows_no_flag_is_left_out_as_the_program_leaves_it_out(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def read(source: str, size: FlagSize) -> str:
        if source == "b":
            raise RefusedError("no flag", where="b", fix="another film")
        return source

    monkeypatch.setattr(CameraFilm, "__init__", lambda *_: None)
    monkeypatch.setattr(Part, "of", lambda *_, source: SimpleNamespace(read=partial(read, source)))
    given = Filmed(
        flag=Flag(length=1.5, height=1.0),
        azimuth=AZIMUTH,
        elevation=ELEVATION,
        distance=8.0,
        area_weight=None,
        recordings={name: (tmp_path / f"{name}.mp4", None) for name in "abc"},  # type: ignore[misc]
    )
    shown, left_out = given.observed()
    assert shown == ("a", "c")
    assert [one.what for one in left_out] == ["b is left out: no flag"]


def test_all_sets_have_one_experiments_winds(recipe: ChallengeRecipe) -> None:
    keys = draw(recipe, seed=3, count=8)
    assert len({(one.speeds, one.intensity, one.toward) for one in keys}) == 1
    assert len({(one.density, one.bending) for one in keys}) == 8
    assert {one.kind for one in keys} == set(Kind)
    assert draw(recipe, seed=4, count=1)[0].speeds != keys[0].speeds


def test_a_cup_logs_the_mean_of_each_second_of_a_steady_wind(recipe: ChallengeRecipe) -> None:
    times, speed = logged(recipe, np.tile([3.0, 4.0, 1.0], (41, 1)))
    np.testing.assert_allclose(times, [0.45, 1.45, 2.45, 3.45])
    np.testing.assert_allclose(speed, 5.0)


def test_what_films_have_no_use_for_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="rates"):
        parse(FILMED.replace("count = 2", "count = 2\nrates = [25]"), where="filmed")
    with pytest.raises(UnknownNameError, match="height_of_pole"):
        parse(FILMED + "height_of_pole = 3\n", where="filmed")
    with pytest.raises(InputError, match="width"):
        parse(FILMED.replace("width = 96", "width = 10"), where="filmed")


def test_a_set_that_is_no_set_of_films_is_refused(tmp_path: Path) -> None:
    (tmp_path / "set.json").write_text(
        '{"schema": "flagdata.challenge-films/1", "flag": {"length": 1.5}}'
    )
    with pytest.raises(InputError, match="not a set of films"):
        read_films(tmp_path)


def test_the_recipe_of_the_catalog_has_the_sets_that_are_asked_for() -> None:
    keys = draw(load("films"), seed=1, count=40)
    kinds = [one.kind for one in keys]
    assert [kinds.count(kind) for kind in (Kind.NULL, Kind.ONE, Kind.OUTSIDE)] == [14, 16, 10]
    alone = [
        (one.effects[0].effect, abs(one.effects[0].value)) for one in keys if one.kind is Kind.ONE
    ]
    assert len(set(alone)) == 16  # each effect at both of its strengths


@pytest.mark.parametrize(("name", "nulls", "ones"), [("films-3", 14, 16), ("films-long", 4, 12)])
def test_sheets_that_are_to_come_have_what_films_show(name: str, nulls: int, ones: int) -> None:
    keys = draw(load(name), seed=1, count=nulls + ones)
    kinds = [one.kind for one in keys]
    assert [kinds.count(kind) for kind in (Kind.NULL, Kind.ONE)] == [nulls, ones]
    acting = [
        (one.effects[0].effect, abs(one.effects[0].value)) for one in keys if one.kind is Kind.ONE
    ]
    assert len(set(acting)) == 11  # of six effects, added mass at its strong one alone
    assert not {"full-hoist", "shear"} & {effect for effect, _ in acting}
    assert ("added-mass", 0.15) not in acting


@pytest.mark.parametrize(
    ("said", "among", "wrong"),
    [
        (verdict(Conclusion.EFFECT, "lift"), True, False),
        (verdict(Conclusion.ONE_OF, "shear", "lift"), True, False),
        (verdict(Conclusion.EFFECT, "shear"), False, True),
        (verdict(Conclusion.ONE_OF, "shear", "added-mass"), False, False),
        (verdict(Conclusion.OUTSIDE), False, False),
    ],
)
def test_one_of_several_counts_as_right_and_only_a_name_given_alone_as_wrong(
    said, among: bool, wrong: bool
) -> None:
    outcome = Outcome.of(key("o", Kind.ONE, acting("lift")), filing("o", said))
    assert (outcome.class_among_named, outcome.wrong_alone) == (among, wrong)


def test_films_have_gates_of_their_own() -> None:
    sets = [
        (key("n", Kind.NULL), verdict(Conclusion.SUFFICIENT)),
        (key("o", Kind.ONE, acting("lift")), verdict(Conclusion.ONE_OF, "lift", "shear")),
        (key("x", Kind.OUTSIDE, acting("tether")), verdict(Conclusion.PARTLY, "lift")),
        (key("y", Kind.OUTSIDE, acting("tether")), verdict(Conclusion.SUFFICIENT)),
    ]
    sheet = replace(
        graded("films", [Outcome.of(k, filing(k.name, said)) for k, said in sets]), filmed=True
    )
    assert [(gate.value, gate.met) for gate in sheet.gates[:4]] == [
        (0.0, True),
        (1.0, True),
        (0.0, True),
        (1.0, True),
    ]


def test_a_set_that_names_a_film_outside_its_folder_is_refused(
    recipe: ChallengeRecipe, tmp_path: Path
) -> None:
    folder = make(tmp_path / "films", recipe, seed=3, count=1).data("set-001")
    (tmp_path / "mine.mp4").write_bytes(b"not of the set")
    stated = folder / "set.json"
    stated.write_text(stated.read_text().replace('"name":"a"', '"name":"../../../mine"'))
    with pytest.raises(InputError, match="not a set of films"):
        read_films(folder)
