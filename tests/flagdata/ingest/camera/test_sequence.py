"""Folders of images."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flagdata.errors import InputError, TimeError
from flagdata.ingest import CameraOptions, open_camera
from tests.flagdata.ingest.camera.conftest import PLAIN, START, number_of, numbered
from tests.flagdata.ingest.camera.reading import read


@pytest.fixture
def options() -> CameraOptions:
    return replace(PLAIN, sequence_fps=50.0)


def save(
    folder: Path, names: dict[int, str], numbered: Callable[..., np.ndarray], *, mode: str = "L"
) -> Path:
    folder.mkdir()
    for number, name in names.items():
        Image.fromarray(numbered(number)).convert(mode).save(folder / name)
    return folder


@pytest.mark.parametrize(
    ("suffix", "mode"),
    [
        ("png", "L"),
        ("png", "RGB"),
        ("png", "RGBA"),
        ("png", "P"),
        ("png", "1"),
        ("jpg", "L"),
        ("jpg", "RGB"),
        ("jpg", "CMYK"),
        ("tif", "I;16"),
        ("bmp", "RGB"),
        ("png", "LA"),
    ],
)
def test_images_are_taken_by_number_at_the_given_rate(
    suffix: str, mode: str, tmp_path: Path, options: CameraOptions
) -> None:
    folder = tmp_path / "images"
    folder.mkdir()
    for number in range(12):
        gray = numbered(number)
        deep = mode == "I;16"
        image = (
            Image.fromarray(gray.astype(np.uint16) * 257)
            if deep
            else Image.fromarray(gray).convert(mode)
        )
        # Without leading zeros: 10 comes after 9, not after 1.
        image.save(
            folder / f"img_{number}.{suffix}", **({"quality": 95} if suffix == "jpg" else {})
        )
    info, frames, found = read(folder, options)
    assert [number_of(f.image) for f in frames] == [0, 2, 4, 6, 8, 10]
    assert [f.time - START for f in frames] == [i * 40_000_000 for i in range(6)]
    assert (info.container, info.container_rate) == ("image-sequence", 50.0)
    assert ("alpha-ignored" in found) == (mode in ("RGBA", "LA"))
    if suffix != "jpg" and mode != "1":
        assert np.array_equal(frames[1].image, numbered(2))


def test_a_missing_number_is_a_missing_frame(tmp_path: Path, options: CameraOptions) -> None:
    names = {n: f"f{n:04d}.png" for n in [*range(100, 105), *range(108, 112)]}
    _, frames, found = read(
        save(tmp_path / "gap", names, numbered), replace(options, sequence_fps=25.0)
    )
    assert [number_of(f.image) for f in frames] == [100, 101, 102, 103, 104, 108, 109, 110, 111]
    assert found["frames-missing"].count == 3


def test_numbers_in_steps_of_ten_are_frames_one_after_the_other(
    tmp_path: Path, options: CameraOptions
) -> None:
    names = {n: f"f{n * 10:04d}.png" for n in range(5)}
    info, frames, found = read(
        save(tmp_path / "tens", names, numbered), replace(options, sequence_fps=25.0)
    )
    assert len(frames) == 5
    assert found["numbered-by-steps"].value == 10
    assert info.duration == pytest.approx(0.16)


def test_names_without_numbers_follow_by_name_and_say_so(
    tmp_path: Path, options: CameraOptions
) -> None:
    names = {0: "a.png", 1: "b.png", 2: "c.png"}
    _, frames, found = read(
        save(tmp_path / "names", names, numbered), replace(options, sequence_fps=25.0)
    )
    assert [number_of(f.image) for f in frames] == [0, 1, 2]
    assert "order-by-name" in found


def test_no_rate_is_guessed(tmp_path: Path) -> None:
    folder = save(tmp_path / "images", {0: "0.png", 1: "1.png"}, numbered)
    with pytest.raises(TimeError, match="no time stamps"):
        open_camera(folder, PLAIN)


def test_an_unreadable_image_in_the_middle_is_left_out_and_counted(
    tmp_path: Path, options: CameraOptions
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


def test_exif_turns_and_dates_a_photograph(tmp_path: Path, options: CameraOptions) -> None:
    folder = tmp_path / "photos"
    folder.mkdir()
    for number in range(3):
        exif = Image.Exif()
        exif[0x0112] = 6  # the stored picture is to be turned 90° clockwise
        exif[0x8769] = {0x9003: "2026:05:01 12:00:00", 0x9291: "250", 0x9011: "+02:00"}
        stored = np.rot90(numbered(number))
        Image.fromarray(np.ascontiguousarray(stored)).save(
            folder / f"p{number}.jpg", exif=exif, quality=95
        )
    info, frames, _ = read(folder, replace(options, start=None, sequence_fps=25.0))
    assert [number_of(f.image) for f in frames] == [0, 1, 2]
    assert (info.start, info.rotation) == (START + 250_000_000, 90)


@pytest.mark.parametrize(
    "content", [{}, {"notes.txt": b"x"}, {"a.png": b""}, {"a.png": b"\x89PNG\r\n\x1a\n"}]
)
def test_a_folder_without_a_readable_image_is_refused(
    content: dict[str, bytes], tmp_path: Path, options: CameraOptions
) -> None:
    for name, data in content.items():
        (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError):
        open_camera(tmp_path, options)


def test_two_kinds_of_images_in_one_folder_are_refused(
    tmp_path: Path, options: CameraOptions
) -> None:
    folder = save(tmp_path / "mixed", {0: "0.png", 1: "1.jpg"}, numbered)
    with pytest.raises(InputError, match="several kinds"):
        open_camera(folder, options)


def test_notes_of_an_operating_system_are_no_images_and_change_neither_order_nor_count(
    tmp_path: Path, options: CameraOptions
) -> None:
    folder = save(tmp_path / "images", {n: f"f_{n}.png" for n in range(14)}, numbered)
    for name in (
        *(f"._f_{n}.png" for n in range(14)),
        ".DS_Store",
        "Thumbs.db",
        "desktop.ini",
        "._f_0.jpg",
    ):
        (folder / name).write_bytes(b"\0\5\x16\7" + bytes(100))
    _, frames, found = read(folder, replace(options, rate="native"))
    assert [number_of(f.image) for f in frames] == list(range(14))
    assert found.keys() == {"exposure-unknown"}
    (folder / "notes.txt").write_text("calm")
    assert "1 of .txt" in read(folder, options)[2]["files-not-read"].what


@pytest.mark.parametrize("odd", [0, 5, 11])
def test_an_image_of_another_size_is_left_out_wherever_it_is(
    odd: int, tmp_path: Path, options: CameraOptions
) -> None:
    folder = save(tmp_path / "images", {n: f"{n}.png" for n in range(12)}, numbered)
    Image.fromarray(np.zeros((40, 30), dtype=np.uint8)).save(folder / f"{odd}.png")
    _, frames, found = read(folder, replace(options, rate="native"))
    kept = [n for n in range(12) if n != odd]
    assert [number_of(f.image) for f in frames] == kept
    assert [(f.time - START) // 20_000_000 for f in frames] == kept
    assert found["size-changed"].count == 1
    assert "than most" in found["size-changed"].what


def test_as_many_images_of_one_size_as_of_another_are_refused(
    tmp_path: Path, options: CameraOptions
) -> None:
    folder = save(tmp_path / "images", {n: f"{n}.png" for n in range(4)}, numbered)
    for n in (0, 2):
        Image.fromarray(np.zeros((40, 30), dtype=np.uint8)).save(folder / f"{n}.png")
    with pytest.raises(InputError, match="30 × 40 and 96 × 96 px"):
        open_camera(folder, options)
    for n in (0, 2):  # the fix
        (folder / f"{n}.png").unlink()
    assert len(read(folder, replace(options, rate="native"))[1]) == 2


@pytest.mark.parametrize("mode", ["RGBA", "LA", "P"])
def test_transparency_of_any_image_is_reported(
    mode: str, tmp_path: Path, options: CameraOptions
) -> None:
    folder = save(tmp_path / "images", {n: f"{n}.png" for n in range(6)}, numbered)
    palette = {"transparency": b"\x00\xff"} if mode == "P" else {}
    Image.fromarray(numbered(4)).convert(mode).save(folder / "4.png", **palette)
    _, frames, found = read(folder, replace(options, rate="native"))
    assert found["alpha-ignored"].count == 1
    assert np.array_equal(frames[4].image, numbered(4))


def test_gray_of_fewer_bits_than_it_is_stored_in_shows_and_says_so(
    tmp_path: Path, options: CameraOptions
) -> None:
    for bits, suffix in ((10, "png"), (12, "tif"), (12, "png"), (14, "png"), (16, "png")):
        folder = tmp_path / f"{bits}{suffix}"
        folder.mkdir()
        for n in range(5):
            deep = (numbered(n) * ((2**bits - 1) / 255)).round().astype(np.uint16)
            Image.fromarray(deep).save(folder / f"{n}.{suffix}")
        _, frames, found = read(folder, replace(options, rate="native"))
        assert all(np.array_equal(f.image, numbered(n)) for n, f in enumerate(frames))
        assert (
            (found["depth-by-content"].value == bits)
            if bits < 16
            else ("depth-by-content" not in found)
        )


def test_an_image_that_is_to_be_turned_otherwise_than_the_rest_is_upright_and_reported(
    tmp_path: Path, options: CameraOptions
) -> None:
    turned = {
        1: 0,
        6: 1,
        3: 2,
        8: 3,
    }  # Exif's number → quarter turns anticlockwise of the stored picture
    for most in (1, 6):
        folder = tmp_path / f"most{most}"
        folder.mkdir()
        values = [most, most, 1, 6, most, 3, 8, most]
        for n, value in enumerate(values):
            exif = Image.Exif()
            exif[0x0112] = value
            Image.fromarray(np.ascontiguousarray(np.rot90(numbered(n), turned[value]))).save(
                folder / f"{n}.png", exif=exif
            )
        _, frames, found = read(folder, replace(options, rate="native"))
        assert all(np.array_equal(f.image, numbered(n)) for n, f in enumerate(frames))
        assert found["orientation-changed"].count == len(values) - values.count(most)


def test_pages_behind_the_first_are_reported_as_not_read(
    tmp_path: Path, options: CameraOptions
) -> None:
    for suffix in ("tif", "png", "webp"):
        folder = tmp_path / suffix
        folder.mkdir()
        pages = [Image.fromarray(numbered(n)).convert("RGB") for n in range(3)]
        for n in range(2):
            lossless = {"lossless": True} if suffix == "webp" else {}
            pages[0].save(
                folder / f"{n}.{suffix}", save_all=True, append_images=pages[1:], **lossless
            )
        assert read(folder, options)[2]["pages-not-read"].count == 2


def test_images_of_other_formats_are_named_in_the_refusal(
    tmp_path: Path, options: CameraOptions
) -> None:
    for n in range(3):
        (tmp_path / f"{n}.heic").write_bytes(b"heic")
    with pytest.raises(InputError, match=r"3 of \.heic") as refused:
        open_camera(tmp_path, options)
    assert "PNG" in refused.value.fix
    (tmp_path / "flag.MP4").write_bytes(b"film")
    with pytest.raises(InputError, match=r"1 of \.mp4") as refused:
        open_camera(tmp_path, options)
    assert "one video by its own path" in refused.value.fix
    folder = save(tmp_path / "mixed", {0: "0.png", 1: "1.jpeg"}, numbered)
    with pytest.raises(InputError, match=r"several kinds \(JPEG, PNG\)"):
        open_camera(folder, options)
