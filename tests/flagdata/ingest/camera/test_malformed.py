"""Malformed camera files: each ends in an error that says what to do, or in frames kept and
marked."""

from __future__ import annotations

import io
import struct
import wave
import zipfile
import zlib
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise, product
from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from flagdata.core.findings import Finding, Severity
from flagdata.errors import FlagdataError, InputError, LimitError, NotFoundError
from flagdata.ingest import CameraOptions, open_camera, probe
from flagdata.ingest.camera import Limits
from flagdata.ingest.camera.boxes import top
from flagdata.ingest.camera.sequence import heads
from flagdata.record.signals import Frame
from tests.flagdata.ingest.camera.conftest import PLAIN, START, number_of, numbered, write_video

FRAMES = 50
# name → container, codec, encoder options, muxer options
BASES = {
    "mp4": ("mp4", "libx264", {"preset": "ultrafast", "bf": "0", "g": "10"}, {}),
    "faststart": (
        "mp4",
        "libx264",
        {"preset": "veryfast", "bf": "2", "g": "10"},
        {"movflags": "faststart"},
    ),
    "fragments": (
        "mp4",
        "libx264",
        {"preset": "ultrafast", "bf": "0", "g": "10"},
        {"movflags": "frag_keyframe"},
    ),
    "mts": ("mpegts", "libx264", {"preset": "veryfast", "bf": "2", "g": "10"}, {}),
    "avi": ("avi", "mjpeg", {"qscale": "5"}, {}),
    "mkv": ("matroska", "libx264", {"preset": "veryfast", "bf": "2", "g": "10"}, {}),
}


@pytest.fixture(scope="module")
def bases(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    grain = np.random.default_rng(3)

    def grainy(picture: np.ndarray) -> np.ndarray:
        """With noise, so that the pictures and not the headers are most of the file."""
        return np.clip(picture.astype(int) + grain.integers(-40, 41, picture.shape), 0, 255).astype(
            np.uint8
        )

    folder = tmp_path_factory.mktemp("bases")
    made = {}
    for name, (container, codec, encoder, muxer) in BASES.items():
        path = write_video(
            folder / name,
            range(FRAMES),
            tick=Fraction(1, 25),
            container=container,
            codec=codec,
            encoder=encoder,
            muxer=muxer,
            pixel_format="yuvj420p" if codec == "mjpeg" else "yuv420p",
            picture=lambda number: grainy(numbered(number)),
        )
        made[name] = path.read_bytes()
    return made


def kept_or_refused(
    path: Path, options: CameraOptions
) -> tuple[list[Frame], tuple[Finding, ...]] | FlagdataError:
    """The frames and findings, or the error; checks what must hold of either."""
    try:
        with open_camera(path, options) as stream:
            frames = list(stream)
            findings = stream.findings
    except FlagdataError as error:
        return error
    times = [f.time for f in frames]
    assert times
    assert all(b > a for a, b in pairwise(times))
    assert all(f.image.shape == (96, 96) and f.image.dtype == np.uint8 for f in frames)
    return frames, findings


def marked(findings: tuple[Finding, ...]) -> bool:
    return any(f.severity is not Severity.NOTE for f in findings)


def test_a_file_cut_anywhere_is_refused_or_kept_and_marked(
    bases: dict[str, bytes], tmp_path: Path
) -> None:
    path = tmp_path / "cut"
    for base, share in product(BASES, (0.0005, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99)):
        path.write_bytes(bases[base][: int(len(bases[base]) * share)])
        outcome = kept_or_refused(path, PLAIN)
        if isinstance(outcome, FlagdataError):
            # Only the head of a file, or an MP4 without its index, leaves nothing to keep.
            assert share <= 0.1 or base in ("mp4", "faststart"), (base, share)
            continue
        frames, findings = outcome
        # What was kept is right: each picture is the one whose time it carries, to within its
        # stated error. The last may be the torn one.
        off = [
            abs(number_of(f.image) * 0.04 - (f.time - START) / 1e9) - f.stamp_error for f in frames
        ]
        assert max(off[:-1], default=0) < 1e-6, (base, share)
        assert marked(findings) or len(frames) == FRAMES, (base, share)


def test_an_mp4_without_index_says_that_it_was_not_closed(
    bases: dict[str, bytes], tmp_path: Path
) -> None:
    path = tmp_path / "unclosed.mp4"
    path.write_bytes(bases["mp4"][: len(bases["mp4"]) // 2])
    outcome = kept_or_refused(path, PLAIN)
    assert isinstance(outcome, InputError)
    assert "moov" in outcome.fix


@pytest.mark.parametrize(
    "movflags",
    [
        "frag_keyframe",
        "frag_keyframe+empty_moov+default_base_moof",
        "dash+frag_keyframe+global_sidx",
    ],
)
def test_of_a_fragmented_film_cut_in_any_box_all_whole_fragments_are_kept_and_the_cut_is_reported(
    movflags: str, tmp_path: Path
) -> None:
    whole = write_video(
        tmp_path / "whole.mp4",
        range(FRAMES),
        tick=Fraction(1, 25),
        muxer={"movflags": movflags},
        encoder={"preset": "veryfast", "bf": "2", "g": "10"},
    )
    data, path = whole.read_bytes(), tmp_path / "cut.mp4"
    found, _ = top(whole)
    first = next(box.end for box in found if box.kind == b"mdat")
    later = [box for box in found if box.at >= first]
    assert len(later) >= 8
    for box in later:
        complete = 10 * sum(one.kind == b"mdat" and one.end <= box.at for one in found)
        middle = (box.at + box.end) // 2
        for cut in (
            box.at + 3,
            box.body,
            middle,
            box.end - 1,
            *([box.end] if box.kind == b"moof" else []),
        ):
            path.write_bytes(data[:cut])
            outcome = kept_or_refused(path, replace(PLAIN, rate="native"))
            assert not isinstance(outcome, FlagdataError), (box, cut, outcome)
            frames, findings = outcome
            numbers = [number_of(frame.image) for frame in frames]
            # Within a fragment that is cut, what comes before the cut may be shown with traces of
            # it.
            assert numbers[:complete] == list(range(complete)), (box, cut)
            assert [(frame.time - START) // 40_000_000 for frame in frames[:complete]] == numbers[
                :complete
            ]
            assert "truncated" in {finding.kind for finding in findings}, (box, cut)


@pytest.mark.parametrize(
    "movflags", ["frag_keyframe", "frag_keyframe+empty_moov", "faststart", "empty_moov"]
)
def test_a_film_cut_before_its_first_frame_is_refused_with_what_is_missing(
    movflags: str, tmp_path: Path
) -> None:
    whole = write_video(
        tmp_path / "whole.mp4", range(20), tick=Fraction(1, 25), muxer={"movflags": movflags}
    )
    data, path = whole.read_bytes(), tmp_path / "cut.mp4"
    end = next(box.at for box in top(whole)[0] if box.kind == b"mdat") + 40
    for cut in range(10, end, 17):
        path.write_bytes(data[:cut])
        outcome = kept_or_refused(path, PLAIN)
        assert isinstance(outcome, FlagdataError)
        assert "moov" in outcome.fix or "copy it from the camera again" in outcome.fix, (
            cut,
            outcome,
        )


@pytest.mark.parametrize("container", ["matroska", "webm", "mov", "avi", "mpegts"])
def test_a_film_with_sound_that_is_cut_is_reported_as_cut_where_frames_are_missing(
    container: str, tmp_path: Path
) -> None:
    path = tmp_path / "sound"
    codecs = {"webm": ("libvpx", "libopus")}.get(container, ("mpeg4", "mp2"))
    with av.open(
        str(path),
        "w",
        format=container,
        options={"movflags": "faststart"} if container == "mov" else {},
    ) as out:
        picture = out.add_stream(codecs[0], rate=25, options={"g": "5"})
        picture.width, picture.height, picture.pix_fmt = 96, 96, "yuv420p"
        sound = out.add_stream(codecs[1], rate=48_000)
        noise = np.random.default_rng(1).integers(-9000, 9000, (FRAMES, 1, 1920), dtype=np.int16)
        for k in range(FRAMES):
            frame = av.VideoFrame.from_ndarray(numbered(k), format="gray").reformat(
                format="yuv420p", threads=1
            )
            frame.pts, frame.time_base = k, Fraction(1, 25)
            out.mux(picture.encode(frame))
            heard = av.AudioFrame.from_ndarray(noise[k], format="s16", layout="mono")
            heard.sample_rate, heard.pts = 48_000, 1920 * k
            out.mux(sound.encode(heard))
        out.mux(picture.encode())
        out.mux(sound.encode())
    data = path.read_bytes()
    whole = kept_or_refused(path, PLAIN)
    assert not isinstance(whole, FlagdataError)
    assert len(whole[0]) == FRAMES
    assert "truncated" not in {finding.kind for finding in whole[1]}
    for share in (0.3, 0.5, 0.7, 0.9):
        # A transport stream that is cut between its packets of 188 bytes betrays nothing.
        path.write_bytes(data[: int(len(data) * share) // 188 * 188 + 94])
        outcome = kept_or_refused(path, PLAIN)
        assert not isinstance(outcome, FlagdataError)
        numbers = [number_of(frame.image) for frame in outcome[0]]
        assert numbers == sorted(set(numbers))
        assert len(numbers) < FRAMES
        assert "truncated" in {finding.kind for finding in outcome[1]}


def test_flipped_bytes_anywhere_never_end_in_a_traceback(
    bases: dict[str, bytes], tmp_path: Path
) -> None:
    for data, seed in product(bases.values(), range(6)):
        random = np.random.default_rng(seed)
        flipped = bytearray(data)
        # Half of them in the headers and the index, where they do most harm.
        edge, size = min(len(data), 3000), len(data)
        heads, tails = random.integers(0, edge, 5), size - 1 - random.integers(0, edge, 5)
        for place in np.concatenate([random.integers(0, size, 10), heads, tails]):
            flipped[place] ^= int(random.integers(1, 256))
        (tmp_path / "flipped").write_bytes(flipped)
        kept_or_refused(tmp_path / "flipped", PLAIN)


def test_a_hole_in_the_middle_is_refused_or_marked(bases: dict[str, bytes], tmp_path: Path) -> None:
    unmarked = []
    for base, data in bases.items():
        a, b = int(len(data) * 0.4), int(len(data) * 0.5)
        noise = np.random.default_rng(1).bytes(b - a)
        for hole, middle in {
            "zeros": bytes(b - a),
            "noise": noise,
            "removed": b"",
            "repeated": data[a:b] * 2,
        }.items():
            (tmp_path / "hole").write_bytes(data[:a] + middle + data[b:])
            outcome = kept_or_refused(tmp_path / "hole", PLAIN)
            if not isinstance(outcome, FlagdataError) and not marked(outcome[1]):
                unmarked.append((base, hole))
    assert unmarked == []


def _zip() -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a", bytes(10**6))
    return stream.getvalue()


def _wave() -> bytes:
    stream = io.BytesIO()
    with wave.open(stream, "wb") as sound:
        sound.setparams((1, 2, 8000, 0, "NONE", ""))
        sound.writeframes(bytes(16_000))
    return stream.getvalue()


def _png() -> bytes:
    stream = io.BytesIO()
    Image.new("L", (32, 32)).save(stream, "PNG")
    return stream.getvalue()


OTHER = {
    "empty": b"",
    "one byte": b"\x00",
    "zeros": bytes(100_000),
    "noise": np.random.default_rng(0).bytes(100_000),
    "text": b"time,speed\n2026-05-01T12:00:00Z,3.2\n" * 50,
    "html": b"<!DOCTYPE html><html><body>404</body></html>",
    "utf-16": "Zeit;Wind\n".encode("utf-16") * 100,
    "zip": _zip(),
    "sound": _wave(),
    "one picture": _png(),
    "pdf": b"%PDF-1.7\n1 0 obj\n<<>>\nendobj\n",
    "riff without chunks": b"RIFF\x04\x00\x00\x00AVI ",
    "riff of absurd length": b"RIFF\xff\xff\xff\xffAVI LIST\xff\xff\xff\xffhdrl",
    "ftyp alone": struct.pack(">I4s4sI", 16, b"ftyp", b"isom", 512),
    "box of size zero": struct.pack(">I4s4sI", 16, b"ftyp", b"isom", 512)
    + struct.pack(">I4s", 0, b"moov"),
    "box larger than the file": struct.pack(">I4s4sI", 16, b"ftyp", b"isom", 512)
    + struct.pack(">I4s", 0x7FFFFFFF, b"moov"),
    "boxes within boxes": b"".join(struct.pack(">I4s", 8 * (400 - i), b"moov") for i in range(400)),
    "matroska magic alone": b"\x1a\x45\xdf\xa3",
    "matroska of absurd size": b"\x1a\x45\xdf\xa3\x01\xff\xff\xff\xff\xff\xff\xfe",
    "transport packets of nothing": (b"\x47\x1f\xff\x10" + bytes(184)) * 50,
    "gif header": b"GIF89a" + struct.pack("<HHBBB", 65535, 65535, 0xF7, 0, 0),
    "flv header": b"FLV\x01\x01\x00\x00\x00\x09\x00\x00\x00\x00",
    "y4m of no size": b"YUV4MPEG2 W0 H0 F25:1\nFRAME\n",
    "y4m of negative size": b"YUV4MPEG2 W-5 H5 F25:1\nFRAME\n",
    "y4m of absurd size": b"YUV4MPEG2 W65535 H65535 F25:1 C420\nFRAME\n",
    "y4m without frames": b"YUV4MPEG2 W16 H16 F25:1 C420\n",
    "y4m cut in a frame": b"YUV4MPEG2 W16 H16 F25:1 C420\nFRAME\n" + bytes(50),
}


def test_what_is_no_video_is_refused_with_the_way_out(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    for name, data in OTHER.items():
        path.write_bytes(data)
        outcome = kept_or_refused(path, PLAIN)
        assert isinstance(outcome, InputError | LimitError), name
        assert outcome.fix, name
        with pytest.raises(FlagdataError):
            probe(path)


def test_one_frame_without_a_rate_is_kept(tmp_path: Path) -> None:
    """It needs none."""
    path = tmp_path / "a.mp4"
    path.write_bytes(b"YUV4MPEG2 W16 H16 F0:0 C420\nFRAME\n" + bytes(384))
    outcome = kept_or_refused(path, PLAIN)
    assert isinstance(outcome, FlagdataError) or len(outcome[0]) == 1


def test_frames_beyond_the_limit_are_refused_by_the_header(
    bases: dict[str, bytes], tmp_path: Path
) -> None:
    path = tmp_path / "a.mp4"
    path.write_bytes(bases["mp4"])
    for limits, word in (
        (Limits(frame_pixels=96 * 96 - 1), "96 × 96"),
        (Limits(frames=49), "50 frames"),
        (Limits(total_pixels=49 * 96 * 96), "in all"),
        (Limits(duration=1.9), "limit of 2 s"),
    ):
        outcome = kept_or_refused(path, replace(PLAIN, limits=limits))
        assert isinstance(outcome, LimitError)
        assert word in outcome.what
    exact = Limits(frame_pixels=96 * 96, frames=50, total_pixels=50 * 96 * 96, duration=1.97)
    assert not isinstance(kept_or_refused(path, replace(PLAIN, limits=exact)), FlagdataError)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _bomb(width: int, height: int) -> bytes:
    """A PNG that claims a size it has no data for."""
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + _chunk(b"IHDR", header)
        + _chunk(b"IDAT", zlib.compress(bytes(1 << 20)))
    )


def test_a_small_png_of_absurd_size_is_refused_by_its_header_also_later_in_a_sequence(
    tmp_path: Path,
) -> None:
    timed = replace(PLAIN, sequence_fps=25.0)
    for width, height in ((30_000, 30_000), (100_000, 1000), (2**31 - 1, 1), (10_000, 9_000)):
        (tmp_path / "0001.png").write_bytes(_bomb(width, height) + _chunk(b"IEND", b""))
        assert isinstance(kept_or_refused(tmp_path, timed), LimitError), (width, height)
    Image.fromarray(numbered(0)).save(tmp_path / "0000.png")
    (tmp_path / "0001.png").write_bytes(_bomb(20_000, 20_000))
    assert isinstance(kept_or_refused(tmp_path, timed), LimitError)


def test_an_animated_picture_of_absurd_size_is_refused(tmp_path: Path) -> None:
    frame = b"\x21\xf9\x04\x00\x0a\x00\x00\x00\x2c" + struct.pack("<HHHHB", 0, 0, 60_000, 60_000, 0)
    body = frame + b"\x02\x02\x4c\x01\x00"
    data = (
        b"GIF89a"
        + struct.pack("<HHBBB", 60_000, 60_000, 0x80, 0, 0)
        + bytes(6)
        + body * 20
        + b"\x3b"
    )
    path = tmp_path / "bomb.gif"
    path.write_bytes(data)
    assert isinstance(kept_or_refused(path, PLAIN), LimitError)


def test_an_mp4_with_a_wrong_frame_count_or_duration_costs_nothing(
    bases: dict[str, bytes], tmp_path: Path
) -> None:
    data = bases["faststart"]
    # stts: version, entries = 1, (count, delta); 50 frames of some delta.
    at = data.index(b"stts") + 8
    count, delta = struct.unpack(">II", data[at + 4 : at + 12])
    assert count == FRAMES
    for name, entry in (
        ("many", (0xFFFFFFFF, delta)),
        ("slow", (count, 0x7FFFFFFF)),
        ("still", (count, 0)),
    ):
        path = tmp_path / f"{name}.mp4"
        path.write_bytes(data[: at + 4] + struct.pack(">II", *entry) + data[at + 12 :])
        outcome = kept_or_refused(path, PLAIN)
        # However far apart the frames claim to be, the instants between them are not filled with
        # copies.
        assert isinstance(outcome, LimitError) or len(outcome[0]) <= 6 * FRAMES, name


@pytest.mark.parametrize("name", ["", "nothing.mp4", "\x00", "a" * 5000])
def test_paths_that_lead_nowhere_are_not_found(name: str, tmp_path: Path) -> None:
    with pytest.raises((NotFoundError, InputError)):
        open_camera(Path(f"{tmp_path}/{name}"), PLAIN)


@pytest.mark.parametrize("form", ["TIFF", "PNG", "WEBP", "BMP", "GIF"])
def test_a_picture_with_any_byte_changed_is_read_left_out_or_beyond_the_limit(
    tmp_path: Path, form: str
) -> None:
    path = tmp_path / f"0001.{form.lower()}"
    Image.fromarray(np.arange(64, dtype=np.uint8).reshape(8, 8)).save(path, form)
    whole = path.read_bytes()
    assert heads([path], Limits()) != [None] or form == "GIF"  # of which a folder has none
    for place, value in product(range(len(whole)), (0, 1, 255)):
        path.write_bytes(whole[:place] + bytes([value]) + whole[place + 1 :])
        try:
            heads([path], Limits())
        except LimitError:
            continue


def test_a_tiff_that_names_a_second_picture_without_a_size_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "0001.tiff"
    Image.fromarray(np.arange(64, dtype=np.uint8).reshape(8, 8)).save(path, "TIFF")
    data = bytearray(path.read_bytes())
    (first,) = struct.unpack_from("<I", data, 4)
    (count,) = struct.unpack_from("<H", data, first)
    struct.pack_into("<I", data, first + 2 + 12 * count, len(data))
    path.write_bytes(data + struct.pack("<HHHIII", 1, 259, 3, 1, 1, 0))
    assert heads([path], Limits()) == [None]
