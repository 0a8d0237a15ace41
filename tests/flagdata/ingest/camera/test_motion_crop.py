"""A crop proposed from where the motion is."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flagdata.errors import RefusedError
from flagdata.ingest import CameraOptions, CropBox, open_camera, parse_crop, propose_crop
from tests.flagdata.ingest.camera.conftest import PLAIN, write_video

WIDE, HIGH = 384, 216


def scene(
    number: int,
    *,
    flag: tuple[int, int, int] | None,
    flicker: float = 0.0,
    passer_by: bool = False,
    seed: int = 0,
    height: float = 80.0,
) -> np.ndarray:
    """(216, 384) still texture with waves, `height` gray levels high, in the square `flag` (x, y,
    side).

    All of it gets brighter and darker by `flicker`.
    """
    still = np.random.default_rng(seed).integers(60, 180, (HIGH // 8, WIDE // 8)).astype(float)
    image = np.kron(still, np.ones((8, 8)))
    if flag:
        x, y, side = flag
        rows, columns = np.mgrid[:side, :side]
        image[y : y + side, x : x + side] = 120 + height * np.sin(
            columns / 6 - number * 0.9 + rows / 15
        )
    if passer_by and 40 <= number < 80:
        at = 8 * (number - 40)
        image[150:210, at : at + 30] = 255
    image = image * (1 + flicker * np.sin(2.1 * number)) + 20 * flicker * np.cos(1.3 * number)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


@pytest.fixture
def film(tmp_path: Path) -> Callable[..., Path]:
    def write(name: str, picture: Callable[[int], np.ndarray], *, frames: int = 300) -> Path:
        return write_video(
            tmp_path / name,
            range(frames),
            tick=Fraction(1, 25),
            picture=picture,
            encoder={"preset": "ultrafast", "crf": "18", "g": "50", "bf": "0"},
        )

    return write


def covers(box: tuple[int, int, int, int], flag: tuple[int, int, int]) -> bool:
    x, y, width, height = box
    fx, fy, side = flag
    return x <= fx and y <= fy and x + width >= fx + side and y + height >= fy + side


@pytest.mark.parametrize("flag", [(200, 60, 80), (10, 10, 64), (300, 120, 80)])
def test_the_proposal_is_a_square_just_around_the_moving_part(
    flag: tuple[int, int, int], film: Callable[..., Path]
) -> None:
    proposal = propose_crop(film("flag.mp4", lambda n: scene(n, flag=flag), frames=120))
    box = proposal.box
    assert box.width == box.height
    assert covers(box.as_tuple(), flag)
    # 15 % of padding on each side, and a pixel or two of blur: less than 1.6 times the flag.
    assert box.width <= 1.6 * flag[2]
    assert proposal.share > 0.95


def test_flicker_of_the_whole_image_is_no_motion(film: Callable[..., Path]) -> None:
    flag = (200, 60, 80)
    proposal = propose_crop(
        film("flicker.mp4", lambda n: scene(n, flag=flag, flicker=0.25, height=15), frames=120)
    )
    assert covers(proposal.box.as_tuple(), flag)
    assert proposal.box.width <= 1.6 * flag[2]
    with pytest.raises(RefusedError, match="no motion is found"):
        propose_crop(film("still.mp4", lambda n: scene(n, flag=None, flicker=0.02), frames=60))


def test_a_passer_by_is_forgotten(film: Callable[..., Path]) -> None:
    flag = (200, 30, 80)
    proposal = propose_crop(
        film("passer.mp4", lambda n: scene(n, flag=flag, passer_by=True, height=15))
    )
    assert covers(proposal.box.as_tuple(), flag)
    assert proposal.box.y + proposal.box.height <= 150


def test_motion_all_over_the_image_is_refused(film: Callable[..., Path]) -> None:
    places = [
        (10, 10, 40),
        (180, 10, 40),
        (330, 10, 40),
        (10, 150, 40),
        (180, 150, 40),
        (330, 150, 40),
    ]

    def everywhere(number: int) -> np.ndarray:
        image = scene(number, flag=None)
        for place in places:
            x, y, side = place
            image[y : y + side, x : x + side] = scene(number, flag=place)[
                y : y + side, x : x + side
            ]
        return image

    with pytest.raises(RefusedError, match="all over"):
        propose_crop(film("everywhere.mp4", everywhere, frames=100))


def test_the_picture_shows_the_image_the_motion_and_the_box(film: Callable[..., Path]) -> None:
    proposal = propose_crop(film("flag.mp4", lambda n: scene(n, flag=(200, 60, 80)), frames=100))
    picture = np.asarray(Image.open(io.BytesIO(proposal.picture)).convert("RGB")).astype(int)
    # The longer side is 960 px: 2.5 times the source.
    assert picture.shape == (540, 960, 3)
    red = (picture[..., 0] - picture[..., 1] > 60) & (picture[..., 0] - picture[..., 2] > 60)
    rows, columns = np.nonzero(red)
    inside = (columns > 190 * 2.5) & (columns < 290 * 2.5) & (rows > 50 * 2.5) & (rows < 150 * 2.5)
    yellow = (picture[..., 0] > 200) & (picture[..., 1] > 180) & (picture[..., 2] < 60)
    assert inside.mean() > 0.9
    assert yellow.sum() > 500


def test_an_automatic_crop_is_used_and_kept_with_its_picture(film: Callable[..., Path]) -> None:
    path = film("flag.mp4", lambda n: scene(n, flag=(200, 60, 80)), frames=100)
    with open_camera(path, replace(PLAIN, crop="auto")) as stream:
        frames = list(stream)
        assert stream.proposal is not None
        assert (
            stream.info.crop == stream.proposal.box.as_tuple() == propose_crop(path).box.as_tuple()
        )
        assert {f.kind for f in stream.findings} >= {"crop-proposed"}
    assert len(frames) == 100
    with open_camera(path, PLAIN) as stream:
        assert stream.proposal is None


@pytest.mark.parametrize(
    ("crop", "edges"),
    [
        ("150,20,100,160", {"right": 30}),
        ("230,90,150,100", {"left": 30, "top": 30}),
        ("190,50,100,100", {}),
        ("10,10,100,100", {}),
    ],
    ids=["tip", "corner", "whole flag", "elsewhere"],
)
def test_a_crop_that_cuts_through_what_moves_is_reported_with_the_edges(
    crop: str, edges: dict[str, int], film: Callable[..., Path]
) -> None:
    """The flag is from 200 to 280 px across and from 60 to 140 px down; blur and compression widen
    it by a few."""
    path = film("flag.mp4", lambda n: scene(n, flag=(200, 60, 80)), frames=60)
    with open_camera(path, replace(PLAIN, crop=parse_crop(crop))) as stream:
        found = [finding for finding in stream.findings if finding.kind == "crop-cuts-motion"]
        assert len(list(stream)) == 60
    assert len(found) == bool(edges)
    for finding in found:
        reported = {
            edge: int(pixels) for pixels, edge in re.findall(r"(\d+) px at the (\w+)", finding.what)
        }
        assert reported == {edge: pytest.approx(pixels, abs=8) for edge, pixels in edges.items()}
        given = re.search(r"--crop (\S+)", finding.fix or "")
        assert given is not None
        box = parse_crop(given[1])
        assert isinstance(box, CropBox)
        assert covers(box.as_tuple(), (200, 60, 80))


def test_a_single_frame_shows_no_motion(film: Callable[..., Path]) -> None:
    with pytest.raises(RefusedError, match="too few"):
        propose_crop(film("one.mp4", lambda n: scene(n, flag=(200, 60, 80)), frames=1))


def test_a_stream_that_cannot_seek_is_sampled_from_its_beginning(tmp_path: Path) -> None:
    flag = (200, 60, 80)
    path = write_video(
        tmp_path / "raw.h264",
        range(60),
        tick=Fraction(1, 25),
        container="h264",
        picture=lambda n: scene(n, flag=flag),
    )
    proposal = propose_crop(path, CameraOptions(sequence_fps=25.0))
    assert covers(proposal.box.as_tuple(), flag)


def test_a_folder_of_images_gets_a_proposal_too(tmp_path: Path) -> None:
    flag = (200, 60, 80)
    for number in range(40):
        Image.fromarray(scene(number, flag=flag)).save(tmp_path / f"{number}.png")
    proposal = propose_crop(tmp_path, CameraOptions(sequence_fps=25.0))
    assert covers(proposal.box.as_tuple(), flag)


@pytest.mark.parametrize("length", [34, 60])
def test_a_faint_tip_that_swings_out_now_and_then_lies_in_the_proposal(
    length: int, film: Callable[..., Path]
) -> None:
    """A strip 6 px thin at the flag's free end, 30 gray levels beside its 80, seen in a quarter of
    the time."""
    flag = (140, 60, 80)

    def picture(number: int) -> np.ndarray:
        image = scene(number, flag=flag).astype(float)
        if number % 60 >= 45:
            rows = 90 + number % 12
            image[rows : rows + 6, 220 : 220 + length] += 30 * np.sin(
                number + np.arange(length) / 4
            )
        return np.clip(np.rint(image), 0, 255).astype(np.uint8)

    box = propose_crop(film("tip.mp4", picture, frames=120)).box
    assert covers(box.as_tuple(), flag)
    assert box.x + box.width >= 220 + length
    # with its tip the flag is 80 + length px long: the square with its padding stays below 1.6
    # times that
    assert box.width <= 1.6 * (80 + length)
