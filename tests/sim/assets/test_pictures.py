"""Procedural pictures and folders of photographs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flagdata.core.rng import stream
from flagdata.errors import InputError, UnknownNameError
from sim.assets import BACKGROUNDS, TEXTURES, Assets
from sim.assets.smooth_fields import fractal
from tests.refusals import unrefused

SEEDED = [kind for kind in TEXTURES if kind != "flag"]


@pytest.mark.parametrize("kind", [*SEEDED, *BACKGROUNDS])
def test_a_seed_is_one_picture_and_another_seed_another(kind) -> None:
    get = Assets().background if kind in BACKGROUNDS else Assets().texture
    first, again, other = get(f"{kind}/5"), get(f"{kind}/5"), get(f"{kind}/6")
    assert first.dtype == np.uint8
    assert first.shape[2] == 3
    assert np.array_equal(first, again)
    assert np.abs(first.astype(int) - other).mean() > 5


def test_backgrounds_vary_in_brightness_colour_and_detail() -> None:
    rng = stream(1, "variety")
    drawn = [
        Assets().background(Assets().draw_background(list(BACKGROUNDS), rng)).astype(float)
        for _ in range(16)
    ]
    mean = np.array([picture.mean(axis=(0, 1)) for picture in drawn])
    detail = np.array([np.abs(np.diff(picture, axis=1)).mean() for picture in drawn])
    assert (
        mean.mean(axis=1).std() > 20
    )  # bytes; a photograph's mean differs from the next one's by 30 or so
    assert (mean[:, 0] - mean[:, 2]).std() > 10
    assert detail.max() / detail.min() > 5


def test_clouds_are_broken_bright_and_gray_before_a_sky_that_is_blue() -> None:
    pictures = [Assets().background(f"clouds/{seed}").astype(float) / 255 for seed in range(24)]
    coloured = np.array([(np.ptp(picture, axis=2) > 0.15).mean() for picture in pictures])
    assert ((coloured > 0.02) & (coloured < 0.98)).mean() > 0.8  # sky is seen between clouds
    assert np.ptp(coloured) > 0.4
    gray = np.array([np.quantile(picture.mean(axis=2), [0.02, 0.98]) for picture in pictures])
    assert (gray[:, 1] > 0.9).mean() > 0.3  # as bright as a white flag
    assert np.ptp(gray, axis=1).mean() > 0.3


def test_a_fractal_field_has_the_spectrum_it_is_asked_for() -> None:
    field = np.mean(
        [np.abs(np.fft.fft2(fractal(stream(s, "f"), 256, 256, slope=1.5))) ** 2 for s in range(8)],
        axis=0,
    )
    f = np.hypot(*np.meshgrid(np.fft.fftfreq(256), np.fft.fftfreq(256)))
    band = (f > 0.02) & (f < 0.4)
    slope = np.polyfit(np.log(f[band]), np.log(field[band]), 1)[0]
    assert slope == pytest.approx(-3.0, abs=0.1)  # power falls as the square of the amplitude


def test_draws_take_each_kind_equally_often() -> None:
    rng = stream(2, "kinds")
    kinds = [
        Assets().draw_texture(["flag", "weave", "print"], rng).split("/")[0] for _ in range(600)
    ]
    for kind in ("flag", "weave", "print"):
        assert kinds.count(kind) == pytest.approx(
            200, abs=60
        )  # five standard deviations of a binomial


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "beach").mkdir()
    Image.new("RGB", (40, 30), (200, 10, 10)).save(tmp_path / "beach" / "b.png")
    Image.new("RGB", (3000, 1000), (10, 200, 10)).save(tmp_path / "a.JPG")
    turned = Image.new("RGB", (40, 30), (10, 10, 200))
    exif = turned.getexif()
    exif[0x0112] = 6  # to be turned by a quarter to be upright
    turned.save(tmp_path / "c.jpg", exif=exif)
    (tmp_path / "notes.txt").write_text("no photograph")
    return tmp_path


def test_photographs_take_the_place_of_procedural_backgrounds(folder) -> None:
    assets = Assets(photos=folder)
    names = {assets.draw_background(["sky"], stream(s, "photo")) for s in range(60)}
    assert names == {"photo/a.JPG", "photo/beach/b.png", "photo/c.jpg"}
    assert assets.background("photo/beach/b.png")[0, 0].tolist() == [200, 10, 10]
    assert assets.background("photo/a.JPG").shape == (341, 1024, 3)
    assert assets.background("photo/c.jpg").shape == (40, 30, 3)


def test_a_folder_or_file_that_does_not_serve_is_refused(folder, tmp_path_factory) -> None:
    with pytest.raises(InputError, match="no such folder"):
        Assets(photos=folder / "nowhere")
    with pytest.raises(InputError, match="no photographs"):
        Assets(photos=tmp_path_factory.mktemp("empty"))
    with pytest.raises(UnknownNameError, match=r"did you mean 'beach/b\.png'"):
        Assets(photos=folder).background("photo/beach/d.png")
    with pytest.raises(InputError, match="no folder of photographs"):
        Assets().background("photo/a.JPG")
    (folder / "c.jpg").write_bytes(b"\xff\xd8 cut off")
    with pytest.raises(InputError, match="cannot be read"):
        Assets(photos=folder).background("photo/c.jpg")


def test_a_texture_that_is_not_there_is_named() -> None:
    cases = [
        ("flag/jappan", UnknownNameError, "did you mean 'japan'"),
        ("flags/japan", UnknownNameError, "did you mean 'flag'"),
        ("flag", InputError, "kind/member"),
        ("weave/x", InputError, "no seed"),
    ]
    assert not unrefused(lambda name: Assets().texture(name), cases)
