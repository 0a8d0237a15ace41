"""Frames of an edited MP4 or MOV come once each, at the times of their recording; a plain one is
left to FFmpeg."""

from __future__ import annotations

import struct
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest

from flagdata.errors import InputError
from flagdata.ingest import open_camera
from flagdata.ingest.camera.boxes import boxes
from tests.flagdata.ingest.camera.conftest import PLAIN, START, number_of, write_video
from tests.flagdata.ingest.camera.reading import MS, read

FRAMES = 100
Entry = tuple[float, float, float]
"""Seconds that are shown, second of the medium from which on (-1: a pause), rate of the medium."""


def edited(path: Path, entries: list[Entry], *, wide: bool = False) -> Path:
    """The film with another edit list, whose index lies behind its frames."""
    data = bytearray(path.read_bytes())

    def found(*kinds: bytes) -> tuple[int, int]:
        at, end = 0, len(data)
        with path.open("rb") as stream:
            for kind in kinds:
                box = next(box for box in boxes(stream, at, end) if box.kind == kind)
                at, end, whole = box.body, box.end, (box.at, box.end)
        return whole

    movie = struct.unpack_from(">I", data, found(b"moov", b"mvhd")[0] + 20)[0]
    medium = struct.unpack_from(">I", data, found(b"moov", b"trak", b"mdia", b"mdhd")[0] + 20)[0]
    layout = ">Qqi" if wide else ">Iii"
    packed = b"".join(
        struct.pack(
            layout, round(shown * movie), -1 if at < 0 else round(at * medium), round(rate * 65536)
        )
        for shown, at, rate in entries
    )
    elst = struct.pack(">I4sII", 16 + len(packed), b"elst", wide << 24, len(entries)) + packed
    start, end = found(b"moov", b"trak", b"edts")
    fresh = struct.pack(">I4s", 8 + len(elst), b"edts") + elst
    for kinds in ((b"moov",), (b"moov", b"trak")):
        at, stop = found(*kinds)
        struct.pack_into(">I", data, at, stop - at + len(fresh) - (end - start))
    data[start:end] = fresh
    path.write_bytes(data)
    return path


@pytest.fixture(params=["mp4", "mov"])
def film(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    encoder = {"preset": "veryfast", "bf": "2", "g": "12"}
    return write_video(
        tmp_path / "film",
        range(FRAMES),
        tick=Fraction(1, 50),
        rate=50,
        container=request.param,
        encoder=encoder,
    )


@pytest.mark.parametrize(
    ("entries", "says"),
    [
        ([(0.5, 0.0, 1.0), (4.0, 0.5, 0.25), (0.5, 1.5, 1.0)], "another speed (1/4)"),
        ([(1.0, 0.0, 2.0)], "another speed (2)"),
        ([(1.0, 0.0, 1.0), (1.0, 1.0, 0.0)], "another speed (0)"),
        ([(1.0, 0.0, 1.0), (1.0, 0.5, 1.0)], "2 parts of it"),
        ([(1.0, 1.0, 1.0), (1.0, 0.0, 1.0)], "2 parts of it"),
        ([(0.4, 0.0, 1.0), (0.4, 1.4, 1.0)], "2 parts of it"),
        ([(0.5, 0.0, 1.0), (1.0, -1, 1.0), (0.5, 0.5, 1.0)], "2 parts of it"),
    ],
)
@pytest.mark.parametrize("wide", [False, True])
def test_each_frame_of_an_edited_film_comes_once_at_its_time_and_the_edits_are_reported(
    entries: list[Entry], says: str, wide: bool, film: Path
) -> None:
    _, frames, found = read(edited(film, entries, wide=wide), replace(PLAIN, rate="native"))
    assert [number_of(f.image) for f in frames] == list(range(FRAMES))
    assert [f.time - START for f in frames] == [k * 20 * MS for k in range(FRAMES)]
    assert says in found["edit-list-passed-over"].what
    assert not found.keys() & {
        "frames-not-shown",
        "frames-missing",
        "stamps-duplicate",
        "frames-undecoded",
    }


@pytest.mark.parametrize(
    ("entries", "shown"),
    [
        ([(2.0, 0.04, 1.0)], range(FRAMES)),  # two frames are kept back for their order
        ([(0.5, -1, 1.0), (2.0, 0.04, 1.0)], range(FRAMES)),  # begins after the sound
        ([(1.0, 0.48, 1.0)], range(24, 74)),  # trimmed by the phone, from a key frame on
    ],
)
def test_a_film_that_is_trimmed_or_begins_later_is_shown_as_its_edit_list_says(
    entries: list[Entry], shown: range, film: Path
) -> None:
    _, frames, found = read(edited(film, entries), replace(PLAIN, rate="native"))
    numbers = [number_of(f.image) for f in frames]
    # FFmpeg may keep a frame or two about the ends of what is shown.
    assert abs(numbers[0] - shown[0]) <= 2
    assert abs(numbers[-1] - shown[-1]) <= 2
    assert numbers == list(range(numbers[0], numbers[-1] + 1))
    assert [f.time - START for f in frames] == [k * 20 * MS for k in range(len(frames))]
    assert "edit-list-passed-over" not in found
    assert ("frames-not-shown" in found) == (len(frames) < FRAMES)


def test_a_film_of_which_the_edit_list_shows_nothing_is_refused_with_a_remedy(film: Path) -> None:
    with pytest.raises(InputError, match="shows none of its 100 frames") as refused:
        open_camera(edited(film, [(0.0, 0.0, 1.0)]), PLAIN)
    assert "-ignore_editlist 1" in refused.value.fix


def test_a_phones_slow_motion_is_reported_with_its_rate_which_works(tmp_path: Path) -> None:
    stated = {"com.android.capture.fps": "240.000000"}
    film = write_video(
        tmp_path / "slow.mp4",
        range(60),
        tick=Fraction(1, 30),
        rate=30,
        container="mp4",
        metadata=stated,
        muxer={"movflags": "use_metadata_tags"},
    )
    options = replace(PLAIN, rate="native")
    finding = read(film, options)[2]["capture-rate"]
    assert (finding.value, finding.fix) == (240, "give the camera's rate: --true-fps 240")
    _, frames, found = read(film, replace(options, true_fps=240.0))
    assert "capture-rate" not in found
    assert frames[-1].time - START == round(59e9 / 240)
    stated["com.android.capture.fps"] = "29.97"
    usual = write_video(
        tmp_path / "usual.mp4",
        range(10),
        tick=Fraction(1, 30),
        rate=30,
        container="mp4",
        metadata=stated,
        muxer={"movflags": "use_metadata_tags"},
    )
    assert "capture-rate" not in read(usual, options)[2]
