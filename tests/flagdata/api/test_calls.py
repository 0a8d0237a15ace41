"""The calls of `flagdata` on made data: their arrays are those of the files, artifacts and models
they come from."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest

import flagdata
from flagdata.errors import InputError, LimitError, UnknownNameError, UsageError
from flagdata.ingest.films.film_array import Frames
from flagdata.lake import Lake
from flagdata.packages.verb_package import VerbPackage

NS = 1_000_000_000
SMALL = {"width": 0.9, "height": 0.6, "columns": 6}
SHORT = {"settle": 0.2, "frames": 6}


def test_every_public_name_is_there_and_no_module_hides_it() -> None:
    folder = Path(flagdata.__file__).parent
    modules = {path.stem for path in folder.glob("*.py")} | {
        path.name for path in folder.iterdir() if path.is_dir()
    }
    both = modules & set(flagdata.__all__)
    assert all(isinstance(getattr(flagdata, name), VerbPackage) for name in both), both
    assert all(
        callable(getattr(flagdata, name)) and getattr(flagdata, name).__doc__
        for name in flagdata.__all__
    )
    assert dir(flagdata) == sorted(flagdata.__all__)
    with pytest.raises(AttributeError, match="no_such_name"):
        flagdata.no_such_name  # noqa: B018


def test_a_log_and_a_film_are_read_from_their_files(video: Path, wind_log: Path) -> None:
    wind = flagdata.wind(wind_log)
    assert len(wind) == len(wind.speed) == len(wind.direction)
    with av.open(str(video)) as container:
        count = sum(1 for _ in container.decode(video=0))
    film = flagdata.frames(video)
    assert len(film) == count
    assert (film.height, film.width) == film.images.shape[1:]


def test_more_frames_than_an_array_may_hold_are_refused(
    video: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("flagdata.ingest.films.film_array.LARGEST", 10_000)
    with pytest.raises(LimitError, match="give an end of"):
        flagdata.frames(video)


def test_frames_of_an_array_are_a_film(tmp_path: Path) -> None:
    images = np.zeros((5, 4, 6, 3), dtype=np.uint8)
    images[2] = (255, 0, 0)
    film = Frames(images=images, time=np.arange(5) / 10)
    (found,) = [image for _, image in film.frames(0.15, 0.25)]
    np.testing.assert_array_equal(found, np.full((4, 6), 76))  # 0.299 × 255, Rec. 601
    assert (film.rate, film.duration) == (pytest.approx(10.0), pytest.approx(0.4))
    with pytest.raises(InputError, match="each with its time"):
        Frames(images=images, time=np.zeros(5))


@pytest.fixture(scope="module")
def flags() -> flagdata.answer.simulated.Simulated:
    return flagdata.simulate(
        scene=SMALL, wind={"speed": {"low": 3.0, "high": 7.0}}, time=SHORT, count=3, batch=2, seed=5
    )


def test_a_recipe_by_keywords_is_the_recipe_as_a_dict(flags) -> None:
    recipe = {
        "scene": SMALL,
        "wind": {"speed": {"low": 3.0, "high": 7.0}},
        "material": {"name": "camel-ponte-roma"},
        "time": {"settle": 0.2, "frames": 99},
        "count": 3,
        "batch": 2,
        "seed": 5,
    }
    again = flagdata.simulate(recipe, time={"frames": 6})
    np.testing.assert_array_equal(flags.positions, again.positions)
    assert flags.positions.shape == (3, 6, len(flags.rest), 3)
    np.testing.assert_allclose(flags.time, np.arange(6) / 25)
    winds = flags.parameters["wind_speed"]
    assert len(set(winds.tolist())) == 3
    assert ((winds >= 3.0) & (winds <= 7.0)).all()
    assert "cloths 3" in repr(flags)


def test_members_are_those_that_a_lake_keeps(flags, tmp_path: Path) -> None:
    from sim.run import recipe_of, simulate

    lake = Lake.create(tmp_path / "lake")
    recipe = recipe_of(
        None,
        {
            "scene": SMALL,
            "wind": {"speed": {"low": 3.0, "high": 7.0}},
            "time": SHORT,
            "count": 3,
            "batch": 2,
            "seed": 5,
        },
    )
    simulate(lake, recipe)
    for index, member in enumerate(flags):
        np.testing.assert_array_equal(
            flagdata.meshes(f"simulation-{index:05d}", lake=lake).positions, member.positions
        )


def test_a_key_that_no_recipe_has_is_named() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'toward'"):
        flagdata.simulate(wind={"speed": 3.0, "towards": 0.0})


def test_a_flag_is_rendered_and_its_film_can_be_looked_at(flags) -> None:
    film = flagdata.render(flags[0], width=64, height=48, parameters={"raster_samples": 1}, seed=2)
    assert film.images.shape == (6, 48, 64, 3)
    np.testing.assert_allclose(film.time, np.arange(6) / 25)
    assert (film.images[0] != film.images[-1]).any()  # it moves
    assert film._repr_html_().count("data:image/webp") == 1
    with pytest.raises(UnknownNameError, match="outdoor"):
        flagdata.render(flags[0], look="outdor")
    with pytest.raises(UsageError, match="hanging-cloth"):
        flagdata.render(flags[0], cloth="sail")
    with pytest.raises(UsageError, match=r"one of its members, as in simulated\[0\]"):
        flagdata.render(flags)  # pyright: ignore[reportArgumentType]


def test_rest_and_rate_belong_together() -> None:
    with pytest.raises(UsageError, match="give both"):
        flagdata.close_loop(np.zeros((3, 2, 3)), wind=4.0, rate=25.0)
