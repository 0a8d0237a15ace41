"""Video files that are cut off, damaged, oddly stored or not video: what can be read is kept and
marked."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import av
import av.error
import numpy as np
import pytest
from PIL import Image

from flagdata.core.findings import Severity
from flagdata.core.json_values import json_values
from flagdata.errors import InputError, NotFoundError, TimeError, UsageError
from flagdata.ingest import CameraOptions, CropBox, open_camera, probe
from tests.flagdata.ingest.camera.conftest import PLAIN, START, number_of, write_video
from tests.flagdata.ingest.camera.reading import grid_of, read


def test_a_cut_off_file_keeps_its_frames_and_is_marked(tmp_path: Path) -> None:
    whole = write_video(
        tmp_path / "whole.mp4",
        range(100),
        tick=Fraction(1, 25),
        muxer={"movflags": "faststart"},
        encoder={"preset": "ultrafast", "crf": "12", "bf": "0"},
    )
    data = whole.read_bytes()
    cut = tmp_path / "cut.mp4"
    cut.write_bytes(data[: len(data) * 3 // 4])
    _, frames, found = read(cut, PLAIN)
    numbers = [number_of(f.image) for f in frames]
    assert 20 < len(numbers) < 100
    assert numbers == list(range(len(numbers)))
    assert found["truncated"].severity is Severity.ERROR
    assert 0 <= 100 - found["truncated"].count - len(numbers) <= 1


def test_damage_in_the_middle_costs_only_frames_near_it(tmp_path: Path, cfr60: Path) -> None:
    data = bytearray(cfr60.read_bytes())
    with av.open(str(cfr60)) as raw:
        packets = [(p.pos, p.size) for p in raw.demux(video=0) if p.size]
    for position, size in packets[40:44]:
        data[position : position + size] = bytes(size)
    broken = tmp_path / "broken.mp4"
    broken.write_bytes(data)
    _, frames, found = read(broken, replace(PLAIN, rate="native"))
    assert found["corrupt-packets"].count == 4
    assert found["corrupt-packets"].where == "packet 41"
    # A key frame every 12: 44…47 stand on damaged references.
    assert found["damaged-references"].count == 4
    numbers = {number_of(f.image) for f in frames}
    assert set(range(40)) | set(range(48, 120)) <= numbers
    assert len(frames) == 116


def test_a_video_whose_size_changes_keeps_the_first_size(tmp_path: Path) -> None:
    small = write_video(
        tmp_path / "a.ts",
        range(10),
        tick=Fraction(1, 25),
        encoder={"bf": "0"},
        muxer={"mpegts_copyts": "1"},
    )
    large = write_video(
        tmp_path / "b.ts",
        range(10, 20),
        tick=Fraction(1, 25),
        encoder={"bf": "0"},
        picture=lambda n: np.full((128, 128), 90, dtype=np.uint8),
        muxer={"mpegts_copyts": "1"},
    )
    both = tmp_path / "both.ts"
    both.write_bytes(small.read_bytes() + large.read_bytes())
    _, frames, found = read(both, PLAIN)
    # The seam breaks the transport stream's count of packets, so the one before it may be left out
    # as doubtful.
    assert [number_of(f.image) for f in frames] in ([*range(10)], [*range(8), 9])
    assert found["size-changed"].severity is Severity.ERROR


def test_interlaced_video_is_flagged(tmp_path: Path) -> None:
    path = write_video(
        tmp_path / "interlaced.mp4",
        range(10),
        tick=Fraction(1, 25),
        encoder={"preset": "veryfast", "x264-params": "interlaced=1:tff=1"},
    )
    _, _, found = read(path, PLAIN)
    assert found["interlaced"].severity is Severity.WARNING


def test_a_cover_picture_is_no_video(tmp_path: Path) -> None:
    path = tmp_path / "sound.mkv"
    with av.open(str(path), "w") as out:
        sound = out.add_stream("aac", rate=48_000)
        silence = av.AudioFrame.from_ndarray(
            np.zeros((1, 1024), dtype=np.float32), format="fltp", layout="mono"
        )
        silence.sample_rate = 48_000
        out.mux(sound.encode(silence))
        out.mux(sound.encode())
    with pytest.raises(InputError, match="no video"):
        open_camera(path, PLAIN)


def test_a_file_that_is_not_there_is_not_found(tmp_path: Path) -> None:
    with pytest.raises(NotFoundError):
        open_camera(tmp_path / "nothing.mp4", PLAIN)


def test_a_playlist_cannot_make_the_reader_open_other_files(tmp_path: Path, cfr60: Path) -> None:
    for name, text in (
        ("list.ffconcat", f"ffconcat version 1.0\nfile '{cfr60}'\n"),
        ("list.m3u8", f"#EXTM3U\n#EXT-X-TARGETDURATION:2\n#EXTINF:2,\n{cfr60}\n#EXT-X-ENDLIST\n"),
        (
            "list.sdp",
            "v=0\no=- 0 0 IN IP4 127.0.0.1\nm=video 5004 RTP/AVP 96\na=rtpmap:96 H264/90000\n",
        ),
    ):
        path = tmp_path / name
        path.write_text(text)
        with pytest.raises(InputError):
            open_camera(path, PLAIN)


def test_a_probe_describes_the_file_without_needing_a_start(cfr60: Path) -> None:
    seen = probe(cfr60)
    assert (seen.codec, seen.width, seen.height, seen.frames, seen.rate) == (
        "h264",
        96,
        96,
        120,
        60.0,
    )
    assert seen.duration == pytest.approx(119 / 60)
    assert not seen.variable_rate
    assert seen.start is None
    assert json_values(seen)["start"] is None


def test_a_transport_stream_joined_in_the_middle_keeps_time_from_its_first_packet(
    tmp_path: Path,
) -> None:
    whole = write_video(
        tmp_path / "whole.ts",
        range(60),
        tick=Fraction(1, 25),
        encoder={"preset": "ultrafast", "crf": "12", "bf": "0", "g": "20"},
    )
    data = whole.read_bytes()
    with av.open(str(whole)) as raw:
        first = [p.pos for p in raw.demux(video=0) if p.size][5]
    joined = tmp_path / "joined.ts"
    # The tables at the head, then from the sixth frame on; the next key frame is frame 20.
    joined.write_bytes(data[: 3 * 188] + data[first:])
    _, frames, found = read(joined, PLAIN)
    assert [number_of(f.image) for f in frames] == list(range(20, 60))
    assert grid_of(frames, START) == list(range(15, 55))
    assert found["frames-missing"].count == 15
    assert found["frames-missing"].value == pytest.approx(15 * 0.04)


def test_hidden_reference_frames_are_not_missed(tmp_path: Path) -> None:
    # VP8 with alternate reference frames: packets that are decoded and never shown.
    path = write_video(
        tmp_path / "hidden.webm",
        range(60),
        tick=Fraction(1, 25),
        codec="libvpx",
        encoder={
            "auto-alt-ref": "1",
            "lag-in-frames": "16",
            "deadline": "good",
            "cpu-used": "5",
            "b": "2M",
        },
    )
    _, frames, found = read(path, PLAIN)
    assert [number_of(f.image) for f in frames] == list(range(60))
    assert "frames-missing" not in found


def test_true_fps_of_a_variable_rate_is_applied_and_warned_about(tmp_path: Path) -> None:
    path = write_video(tmp_path / "slow.mp4", [0, 23, 56, 99, 122, 155, 198, 221, 254, 297])
    info, _, found = read(path, replace(PLAIN, true_fps=240.0))
    # The median step is 33 ms: eight times slower than 240 Hz, within its rounding.
    assert info.duration == pytest.approx(0.297 / 8, rel=0.02)
    assert found["true-rate-of-variable"].severity is Severity.WARNING


def test_what_an_edit_list_cuts_away_is_not_shown(tmp_path: Path) -> None:
    path = write_video(
        tmp_path / "edited.mp4",
        range(30),
        tick=Fraction(1, 25),
        encoder={"preset": "ultrafast", "crf": "12", "bf": "0", "g": "10"},
    )
    data = bytearray(path.read_bytes())
    with av.open(str(path)) as raw:
        ticks = int(1 / (25 * raw.streams.video[0].time_base))
    # elst, version 0: flags, one entry of (duration, media time, rate); the player is to start at
    # frame 12.
    at = data.index(b"elst") + 12
    assert data[at - 8 : at] == bytes([0, 0, 0, 0, 0, 0, 0, 1])
    data[at + 4 : at + 8] = (12 * ticks).to_bytes(4, "big")
    path.write_bytes(data)
    _, frames, found = read(path, PLAIN)
    assert [number_of(f.image) for f in frames] == list(range(12, 30))
    assert grid_of(frames, START) == list(range(18))
    assert "frames-missing" not in found
    assert "truncated" not in found
    # Frames 0…9 are not even needed to decode; 10 and 11 are, since frame 10 is the key frame.
    assert found["frames-not-shown"].count == 10


def test_a_small_crop_is_enlarged_and_says_so(cfr60: Path) -> None:
    _, frames, found = read(cfr60, replace(PLAIN, crop=CropBox(x=0, y=0, width=32, height=32)))
    assert frames[0].image.shape == (96, 96)
    assert (found["enlarged"].severity, found["enlarged"].value) == (Severity.WARNING, 3.0)


def test_a_camcorders_m2ts_with_time_codes_between_packets_is_whole(tmp_path: Path) -> None:
    path = write_video(
        tmp_path / "cam.mts",
        range(20),
        tick=Fraction(1, 25),
        container="mpegts",
        muxer={"mpegts_m2ts_mode": "1"},
    )
    assert path.read_bytes()[4:5] == b"\x47"
    _, frames, found = read(path, PLAIN)
    assert [number_of(f.image) for f in frames] == list(range(20))
    assert "truncated" not in found
    cut = tmp_path / "cut.mts"
    cut.write_bytes(path.read_bytes()[:-50])
    _, _, found = read(cut, PLAIN)
    assert found["truncated"].severity is Severity.WARNING


@pytest.mark.parametrize("hundredths", [0, 1])
def test_a_gif_that_states_no_rate_is_no_camera_of_100_hz(hundredths: int, tmp_path: Path) -> None:
    path = tmp_path / "film.gif"
    pictures = [
        Image.fromarray(np.random.default_rng(k).integers(0, 255, (32, 32), dtype=np.uint8))
        for k in range(9)
    ]
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=10 * hundredths)
    with pytest.raises(TimeError, match="--true-fps"):
        open_camera(path, PLAIN)
    with open_camera(path, replace(PLAIN, true_fps=30.0)) as film:
        assert film.info.true_rate == pytest.approx(30.0)


def test_a_gifs_rate_is_known_to_half_a_hundredth(tmp_path: Path) -> None:
    path = tmp_path / "film.gif"
    pictures = [
        Image.fromarray(np.random.default_rng(k).integers(0, 255, (32, 32), dtype=np.uint8))
        for k in range(9)
    ]
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=30)
    with open_camera(path, PLAIN) as film:
        (finding,) = [f for f in film.findings if f.kind == "gif-delays"]
    # 1/35 ms and 1/25 ms
    assert "between 28.6 and 40 Hz" in finding.what


def test_a_video_stream_is_chosen_by_its_number(tmp_path: Path) -> None:
    path = tmp_path / "two.mkv"
    with av.open(str(path), "w") as out:
        streams = [out.add_stream("ffv1", rate=25) for _ in range(2)]
        for stream, side in zip(streams, (64, 96), strict=True):
            stream.width, stream.height, stream.pix_fmt = side, side, "gray"
        for _ in range(5):
            for stream in streams:
                shown = np.full((stream.height, stream.width), 90, dtype=np.uint8)
                out.mux(stream.encode(av.VideoFrame.from_ndarray(shown, format="gray")))
        for stream in streams:
            out.mux(stream.encode(None))
    for number, side in ((None, 64), (0, 64), (1, 96)):
        with open_camera(path, CameraOptions(start=0, stream=number)) as stream:
            assert stream.info.width == side
            assert "more-video-streams" in {finding.kind for finding in stream.findings}
    with pytest.raises(UsageError, match="stream 2 is no video") as refused:
        open_camera(path, CameraOptions(start=0, stream=2))
    assert refused.value.fix == "give --stream 0 or 1"
