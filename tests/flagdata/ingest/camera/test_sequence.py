"""Folders of images."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flagdata.errors import InputError, TimeError
from flagdata.ingest.camera import CameraOptions, open_camera
from tests.flagdata.ingest.camera.reading import read


@pytest.fixture
def options(plain: CameraOptions) -> CameraOptions:
    return replace(plain, sequence_fps=50.0)


def save(folder: Path, names: dict[int, str], numbered: Callable[..., np.ndarray], *, mode: str = "L") -> Path:
    folder.mkdir()
    for number, name in names.items():
        Image.fromarray(numbered(number)).convert(mode).save(folder / name)
    return folder


@pytest.mark.parametrize(("suffix", "mode"), [("png", "L"), ("png", "RGB"), ("png", "RGBA"), ("png", "P"), ("png", "1"),
                                              ("jpg", "L"), ("jpg", "RGB"), ("jpg", "CMYK"), ("tif", "I;16"),
                                              ("bmp", "RGB"), ("png", "LA")])  # fmt: skip
def test_images_are_taken_by_number_at_the_given_rate(
    suffix: str, mode: str, tmp_path: Path, options: CameraOptions, numbered: Callable[..., np.ndarray],
    number_of: Callable[..., int], start: int,
) -> None:  # fmt: skip
    folder = tmp_path / "images"
    folder.mkdir()
    for number in range(12):
        gray = numbered(number)
        deep = mode == "I;16"
        image = Image.fromarray(gray.astype(np.uint16) * 257) if deep else Image.fromarray(gray).convert(mode)
        # Without leading zeros: 10 comes after 9, not after 1.
        image.save(folder / f"img_{number}.{suffix}", **({"quality": 95} if suffix == "jpg" else {}))
    info, frames, found = read(folder, options)
    assert [number_of(f.image) for f in frames] == [0, 2, 4, 6, 8, 10]
    assert [f.time - start for f in frames] == [i * 40_000_000 for i in range(6)]
    assert (info.container, info.container_rate) == ("image-sequence", 50.0)
    assert ("alpha-ignored" in found) == (mode in ("RGBA", "LA"))
    if suffix != "jpg" and mode != "1":
        assert np.array_equal(frames[1].image, numbered(2))


def test_a_missing_number_is_a_missing_frame(
    tmp_path: Path, options: CameraOptions, numbered: Callable[..., np.ndarray], number_of: Callable[..., int]
) -> None:
    names = {n: f"f{n:04d}.png" for n in [*range(100, 105), *range(108, 112)]}
    _, frames, found = read(save(tmp_path / "gap", names, numbered), replace(options, sequence_fps=25.0))
    assert [number_of(f.image) for f in frames] == [100, 101, 102, 103, 104, 108, 109, 110, 111]
    assert found["frames-missing"].count == 3


def test_numbers_in_steps_of_ten_are_frames_one_after_the_other(
    tmp_path: Path, options: CameraOptions, numbered: Callable[..., np.ndarray]
) -> None:
    names = {n: f"f{n * 10:04d}.png" for n in range(5)}
    info, frames, found = read(save(tmp_path / "tens", names, numbered), replace(options, sequence_fps=25.0))
    assert len(frames) == 5
    assert found["numbered-by-steps"].value == 10
    assert info.duration == pytest.approx(0.16)


def test_names_without_numbers_follow_by_name_and_say_so(
    tmp_path: Path, options: CameraOptions, numbered: Callable[..., np.ndarray], number_of: Callable[..., int]
) -> None:
    names = {0: "a.png", 1: "b.png", 2: "c.png"}
    _, frames, found = read(save(tmp_path / "names", names, numbered), replace(options, sequence_fps=25.0))
    assert [number_of(f.image) for f in frames] == [0, 1, 2]
    assert "order-by-name" in found


def test_no_rate_is_guessed(tmp_path: Path, plain: CameraOptions, numbered: Callable[..., np.ndarray]) -> None:
    folder = save(tmp_path / "images", {0: "0.png", 1: "1.png"}, numbered)
    with pytest.raises(TimeError, match="no time stamps"):
        open_camera(folder, plain)


def test_an_unreadable_image_in_the_middle_is_left_out_and_counted(
    tmp_path: Path, options: CameraOptions, numbered: Callable[..., np.ndarray], number_of: Callable[..., int]
) -> None:
    folder = save(tmp_path / "images", {n: f"{n}.png" for n in range(6)}, numbered)
    data = (folder / "3.png").read_bytes()
    (folder / "3.png").write_bytes(data[: len(data) // 2])
    Image.fromarray(np.zeros((40, 40), dtype=np.uint8)).save(folder / "4.png")
    _, frames, found = read(folder, replace(options, sequence_fps=25.0))
    assert [number_of(f.image) for f in frames] == [0, 1, 2, 5]
    assert (found["corrupt-frames"].count, found["corrupt-frames"].where) == (1, "3.png")
    assert found["corrupt-frames"].what == "1 of 6 frames cannot be decoded and were left out"
    assert found["size-changed"].count == 1


def test_exif_turns_and_dates_a_photograph(
    tmp_path: Path,
    options: CameraOptions,
    numbered: Callable[..., np.ndarray],
    number_of: Callable[..., int],
    start: int,
) -> None:
    folder = tmp_path / "photos"
    folder.mkdir()
    for number in range(3):
        exif = Image.Exif()
        exif[0x0112] = 6  # the stored picture is to be turned 90° clockwise
        exif[0x8769] = {0x9003: "2026:05:01 12:00:00", 0x9291: "250", 0x9011: "+02:00"}
        stored = np.rot90(numbered(number))
        Image.fromarray(np.ascontiguousarray(stored)).save(folder / f"p{number}.jpg", exif=exif, quality=95)
    info, frames, _ = read(folder, replace(options, start=None, sequence_fps=25.0))
    assert [number_of(f.image) for f in frames] == [0, 1, 2]
    assert (info.start, info.rotation) == (start + 250_000_000, 90)


@pytest.mark.parametrize("content", [{}, {"notes.txt": b"x"}, {"a.png": b""}, {"a.png": b"\x89PNG\r\n\x1a\n"}])
def test_a_folder_without_a_readable_image_is_refused(
    content: dict[str, bytes], tmp_path: Path, options: CameraOptions
) -> None:
    for name, data in content.items():
        (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError):
        open_camera(tmp_path, options)


def test_two_kinds_of_images_in_one_folder_are_refused(
    tmp_path: Path, options: CameraOptions, numbered: Callable[..., np.ndarray]
) -> None:
    folder = save(tmp_path / "mixed", {0: "0.png", 1: "1.jpg"}, numbered)
    with pytest.raises(InputError, match="several kinds"):
        open_camera(folder, options)
