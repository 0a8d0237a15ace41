"""Video files of many kinds: the frames that come out are the ones the stamps call for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import av
import av.error
import numpy as np
import pytest
from av.container import InputContainer
from av.video.stream import VideoStream

from flagdata.core.findings import Severity
from flagdata.errors import TimeError, UsageError
from flagdata.ingest import CameraOptions, CropBox, open_camera
from flagdata.ingest.camera.video_container import packets
from tests.flagdata.ingest.camera.conftest import PLAIN, START, number_of, numbered, write_video
from tests.flagdata.ingest.camera.reading import MS, grid_of, read

# 60 Hz onto 25 Hz by hand: frame = round(2.4 k), 2.4 k = 0, 2.4, 4.8, 7.2, 9.6, 12, …
SIXTY_TO_25 = [0, 2, 5, 7, 10, 12, 14, 17, 19, 22]


@pytest.mark.parametrize(
    ("container", "codec", "pixel_format", "encoder"),
    [
        ("mp4", "libx264", "yuv420p", {"preset": "ultrafast", "crf": "12", "bf": "0"}),
        ("mp4", "libx264", "yuv420p", {"preset": "veryfast", "crf": "12", "bf": "3", "g": "24"}),
        ("mov", "libx264", "yuv420p", {"preset": "veryfast", "crf": "12", "bf": "2"}),
        ("matroska", "libx264", "yuv420p", {"preset": "veryfast", "crf": "12", "bf": "2"}),
        ("mpegts", "libx264", "yuv420p", {"preset": "veryfast", "crf": "12", "bf": "2"}),
        ("avi", "libx264", "yuv420p", {"preset": "veryfast", "crf": "12", "bf": "2"}),
        ("avi", "mjpeg", "yuvj420p", {"qscale": "2"}),
        ("avi", "mpeg4", "yuv420p", {"qscale": "2"}),
        ("mp4", "libx264", "yuv422p10le", {"preset": "ultrafast", "crf": "12"}),
        ("mp4", "libx264", "gray", {"preset": "ultrafast", "crf": "12"}),
        ("matroska", "ffv1", "gray", {}),
        ("matroska", "ffv1", "yuva420p", {}),
        (
            "matroska",
            "libvpx-vp9",
            "yuv420p",
            {"deadline": "realtime", "cpu-used": "8", "crf": "12"},
        ),
        (
            "mp4",
            "libx265",
            "yuv420p",
            {"preset": "ultrafast", "x265-params": "log-level=none", "crf": "12"},
        ),
        ("mov", "png", "rgb24", {}),
        ("gif", "gif", "pal8", {}),
    ],
)
def test_the_nearest_frame_by_stamp_comes_out_of_every_container(
    container: str, codec: str, pixel_format: str, encoder: dict[str, str], tmp_path: Path
) -> None:
    if codec not in av.codecs_available:
        pytest.skip(f"this build of FFmpeg has no encoder {codec}")
    if container == "gif":
        pixel_format = "gray"
    path = write_video(
        tmp_path / "camera.bin",
        range(24),
        tick=Fraction(1, 50 if container == "gif" else 60),
        rate=50 if container == "gif" else 60,
        container=container,
        codec=codec,
        pixel_format=pixel_format,
        encoder=encoder,
    )
    info, frames, found = read(path, PLAIN)
    # GIF counts in hundredths of a second, so it gets 50 Hz: every second frame.
    expected = list(range(0, 24, 2)) if container == "gif" else SIXTY_TO_25
    assert [number_of(f.image) for f in frames] == expected
    assert grid_of(frames, START) == list(range(len(expected)))
    assert info.container_rate == pytest.approx(50 if container == "gif" else 60, rel=2e-3)
    # Matroska and GIF round stamps to their ticks (0.5 ms); 0.4 of a 60 Hz period is 6.667 ms.
    worst = 0.0 if container == "gif" else 0.4 / 60
    assert found["resampled"].value == pytest.approx(worst, abs=0.6e-3)
    assert found["resampled"].value == max(f.stamp_error for f in frames)
    assert not {k for k, f in found.items() if f.severity is not Severity.NOTE} - {
        "alpha-ignored",
        "gif-delays",
    }


def test_variable_stamps_choose_by_time_and_not_by_index(tmp_path: Path) -> None:
    # Nearest to 0, 40, …, 200 ms: 0; 43 (3 away); 76 (4); 119 (1); 142 (18, against 25 to 185); 185
    # (15, against 18).
    stamps = [0, 23, 43, 76, 119, 142, 185, 218, 241]
    path = write_video(tmp_path / "vfr.mp4", stamps)
    info, frames, found = read(path, PLAIN)
    assert info.variable_rate
    assert [number_of(f.image) for f in frames[:6]] == [0, 2, 3, 4, 5, 6]
    assert [round(f.stamp_error * 1e3, 6) for f in frames[:6]] == [0, 3, 4, 1, 18, 15]
    assert found["variable-rate"].value == pytest.approx(0.043)


def test_missing_frames_leave_holes_in_the_grid(tmp_path: Path) -> None:
    stamps = [*range(10), *range(15, 25)]
    path = write_video(tmp_path / "gap.mp4", stamps, tick=Fraction(1, 25))
    info, frames, found = read(path, PLAIN)
    assert grid_of(frames, START) == stamps
    assert [number_of(f.image) for f in frames] == list(range(20))
    assert not info.variable_rate
    assert (found["frames-missing"].count, found["frames-missing"].value) == (
        5,
        pytest.approx(6 * 0.04),
    )


def test_the_native_rate_counts_missing_frames_too(tmp_path: Path) -> None:
    stamps = [*range(10), *range(15, 20), *range(22, 25)]
    path = write_video(tmp_path / "gap.mp4", stamps, tick=Fraction(1, 50))
    _, frames, found = read(path, replace(PLAIN, rate="native"))
    assert [(f.time - START) // (20 * MS) for f in frames] == stamps
    assert (found["frames-missing"].count, found["frames-missing"].where) == (5 + 2, "frame 10")
    assert found["frames-missing"].value == pytest.approx(6 * 0.02)


def test_a_tolerance_wide_enough_bridges_a_gap_by_repeating(tmp_path: Path) -> None:
    path = write_video(tmp_path / "gap.mp4", [0, 1, 2, 5, 6], tick=Fraction(1, 25))
    _, frames, found = read(path, replace(PLAIN, tolerance=0.1))
    assert [number_of(f.image) for f in frames] == [0, 1, 2, 2, 3, 3, 4]
    assert found["frames-repeated"].count == 2


def test_the_first_frame_is_at_the_start_whatever_stamp_the_file_begins_with(
    tmp_path: Path,
) -> None:
    for name in ("offset.mp4", "offset.ts", "offset.mkv"):
        path = write_video(tmp_path / name, range(5000, 5000 + 400, 40))
        _, frames, _ = read(path, PLAIN)
        assert grid_of(frames, START) == list(range(10)), name
        assert [number_of(f.image) for f in frames] == list(range(10)), name


def test_33_bit_stamps_that_wrap_run_on(tmp_path: Path) -> None:
    # A transport stream counts to 2^33 at 90 kHz; the wrap falls into the middle of these 20
    # frames.
    first = 2**33 - 10 * 3600
    path = write_video(
        tmp_path / "wrap.ts",
        range(first, first + 20 * 3600, 3600),
        tick=Fraction(1, 90_000),
        muxer={"mpegts_copyts": "1"},
    )
    with av.open(str(path)) as raw:
        assert raw.streams.video[0].start_time is not None
    info, frames, found = read(path, PLAIN)
    assert info.duration == pytest.approx(19 * 0.04)
    assert grid_of(frames, START) == list(range(20))
    assert [number_of(f.image) for f in frames] == list(range(20))
    assert "clock-reset" not in found


def test_true_fps_rescales_the_times_of_a_high_speed_camera(tmp_path: Path) -> None:
    path = write_video(tmp_path / "fast.mp4", range(201), tick=Fraction(1, 60), rate=60)
    options = replace(PLAIN, true_fps=1000.0)
    info, frames, found = read(path, options)
    # 201 frames at 1000 Hz are 0.2 s: instants 0, 40, …, 200 ms are frames 0, 40, …, 200.
    assert [number_of(f.image) for f in frames] == [0, 40, 80, 120, 160, 200]
    assert grid_of(frames, START) == list(range(6))
    assert (info.container_rate, info.true_rate, info.duration) == (
        60.0,
        1000.0,
        pytest.approx(0.2),
    )
    assert all(f.stamp_error == 0 for f in frames)
    assert found["true-rate"].value == pytest.approx(0.06)
    assert found["frames-dropped"].count == 195


def test_true_fps_of_a_varying_rate_is_the_mean_of_the_frames(tmp_path: Path) -> None:
    """Steps of 7 to 12 ms, 120 in 1.053 s; the middle step of 8 ms alone would say 125 Hz."""
    steps = np.random.default_rng(0).choice([7, 8, 8, 8, 8, 9, 12, 12], 120)
    stamps = np.cumsum([0, *steps]).tolist()
    path = write_video(tmp_path / "vfr.mkv", stamps)
    mean = 120 / (stamps[-1] / 1000)
    info, frames, found = read(path, replace(PLAIN, rate="native", true_fps=mean))
    assert info.variable_rate
    assert info.duration == pytest.approx(stamps[-1] / 1000, rel=1e-6)
    assert (frames[-1].time - frames[0].time) / 1e9 == pytest.approx(stamps[-1] / 1000, rel=1e-6)
    assert found["true-rate-of-variable"].value == pytest.approx(1.0, rel=1e-6)


def test_the_native_rate_keeps_every_frame_at_its_own_stamp(tmp_path: Path) -> None:
    path = write_video(tmp_path / "fast.mp4", range(50), tick=Fraction(1, 60), rate=60)
    _, frames, found = read(path, replace(PLAIN, rate="native", true_fps=1000.0))
    assert [number_of(f.image) for f in frames] == list(range(50))
    assert [f.time - START for f in frames] == [i * MS for i in range(50)]
    assert "frames-dropped" not in found


def test_another_rate_makes_another_grid(cfr60: Path) -> None:
    _, frames, _ = read(cfr60, replace(PLAIN, rate=30.0))
    assert [number_of(f.image) for f in frames] == list(range(0, 120, 2))
    _, frames, _ = read(cfr60, replace(PLAIN, rate=20.0))
    assert [number_of(f.image) for f in frames] == list(range(0, 120, 3))


def test_a_known_exposure_moves_times_to_its_middle(cfr60: Path) -> None:
    _, frames, found = read(cfr60, replace(PLAIN, exposure=1 / 125))
    assert frames[0].time - START == 4 * MS
    assert frames[1].time - frames[0].time == 40 * MS
    assert "exposure-unknown" not in found
    _, _, found = read(cfr60, PLAIN)
    # Half a 60 Hz period.
    assert found["exposure-unknown"].value == pytest.approx(1 / 120)


def test_decoding_twice_and_with_two_threads_gives_identical_frames(cfr60: Path) -> None:
    once, again, threaded = (read(cfr60, o)[1] for o in (PLAIN, PLAIN, replace(PLAIN, threads=2)))
    for other in (again, threaded):
        assert [f.time for f in other] == [f.time for f in once]
        assert all(np.array_equal(a.image, b.image) for a, b in zip(once, other, strict=True))


def test_a_stream_is_read_once(cfr60: Path) -> None:
    with open_camera(cfr60, PLAIN) as stream:
        next(iter(stream))
        with pytest.raises(UsageError, match="read once"):
            iter(stream)


@pytest.mark.parametrize("counter_clockwise", [90, 180, 270])
def test_rotated_files_come_out_upright(counter_clockwise: int, tmp_path: Path) -> None:
    # The stored pictures are turned clockwise; the file says: turn them back.
    turns = counter_clockwise // 90
    path = write_video(
        tmp_path / "turned.mp4",
        range(4),
        tick=Fraction(1, 25),
        rotation=counter_clockwise,
        picture=lambda n: np.ascontiguousarray(np.rot90(numbered(n), -turns)),
    )
    info, frames, _ = read(path, PLAIN)
    assert [number_of(f.image) for f in frames] == [0, 1, 2, 3]
    assert info.rotation == 360 - counter_clockwise
    # Nothing but the corner cells fixes left and right: white at the bottom left.
    assert frames[0].image[-8, 8] > 200
    assert frames[0].image[-8, -8] < 50


def test_pixels_that_are_not_square_are_made_so(tmp_path: Path) -> None:
    # Stored at half width; each pixel is twice as wide as high.
    path = write_video(
        tmp_path / "anamorphic.mp4",
        range(3),
        tick=Fraction(1, 25),
        aspect=Fraction(2, 1),
        picture=lambda n: np.ascontiguousarray(numbered(n)[:, ::2]),
    )
    info, frames, found = read(path, PLAIN)
    assert (info.width, info.height) == (96, 96)
    assert [number_of(f.image) for f in frames] == [0, 1, 2]
    assert "letterboxed" not in found


def test_odd_sizes_and_a_crop_keep_the_pixels_they_name(tmp_path: Path) -> None:
    def offset(number: int) -> np.ndarray:
        wide = np.full((131, 163), 100, dtype=np.uint8)
        wide[17:113, 41:137] = numbered(number)
        return wide

    path = write_video(
        tmp_path / "odd.mkv",
        range(3),
        tick=Fraction(1, 25),
        codec="ffv1",
        pixel_format="gray",
        picture=offset,
    )
    info, frames, _ = read(path, replace(PLAIN, crop=CropBox(x=41, y=17, width=96, height=96)))
    assert (info.width, info.height, info.crop) == (163, 131, (41, 17, 96, 96))
    assert all(np.array_equal(f.image, numbered(n)) for n, f in enumerate(frames))
    assert [number_of(f.image) for f in frames] == [0, 1, 2]
    with pytest.raises(UsageError, match="beyond the image"):
        open_camera(path, replace(PLAIN, crop=CropBox(x=80, y=17, width=96, height=96)))


def test_black_and_white_of_both_ranges_come_out_as_0_and_255(tmp_path: Path) -> None:
    for name, codec, pixel_format in (
        ("limited.mp4", "libx264", "yuv420p"),
        ("ten.mp4", "libx264", "yuv420p10le"),
        ("full.avi", "mjpeg", "yuvj420p"),
        ("rgb.mov", "png", "rgb24"),
    ):
        path = write_video(
            tmp_path / name, range(3), tick=Fraction(1, 25), codec=codec, pixel_format=pixel_format
        )
        _, frames, _ = read(path, PLAIN)
        difference = frames[1].image.astype(int) - numbered(1)
        # Lossy coding rings at the cells' edges; their middles are flat.
        middles = difference[8::16, 8::16]
        assert np.abs(middles).max() <= 3, name


def write_with_sound(path: Path, numbers: range, numbered: Callable[..., np.ndarray]) -> Path:
    with av.open(
        str(path), "w", options={"mpegts_copyts": "1"} if path.suffix == ".ts" else {}
    ) as out:
        video = out.add_stream("libx264", rate=25, options={"preset": "ultrafast", "crf": "12"})
        video.width = video.height = 96
        video.pix_fmt = "yuv420p"
        sound = out.add_stream("aac", rate=48_000)
        for i in numbers:
            frame = av.VideoFrame.from_ndarray(numbered(i), format="gray").reformat(
                format="yuv420p", threads=1
            )
            frame.pts, frame.time_base = i, Fraction(1, 25)
            out.mux(video.encode(frame))
            noise = av.AudioFrame.from_ndarray(
                np.zeros((1, 1920), dtype=np.float32), format="fltp", layout="mono"
            )
            noise.sample_rate, noise.pts, noise.time_base = 48_000, i * 1920, Fraction(1, 48_000)
            out.mux(sound.encode(noise))
        out.mux(video.encode())
        out.mux(sound.encode())
    return path


def test_sound_beside_the_video_changes_nothing(tmp_path: Path) -> None:
    _, frames, _ = read(write_with_sound(tmp_path / "sound.mp4", range(10), numbered), PLAIN)
    assert [number_of(f.image) for f in frames] == list(range(10))


def test_a_container_that_breaks_off_still_flushes_the_decoder(cfr60: Path) -> None:
    # A stream that appears in the middle of a damaged transport stream makes PyAV raise IndexError
    # at the end.
    class Torn:
        def __init__(self, whole: InputContainer, error: Exception) -> None:
            self.whole, self.error, self.format = whole, error, whole.format

        def demux(self, stream: VideoStream) -> Iterator[av.Packet]:
            for packet in self.whole.demux(stream):
                if packet.size == 0:
                    raise self.error
                yield packet

    for error in (IndexError("list index out of range"), av.error.InvalidDataError(1, "torn")):
        with av.open(str(cfr60)) as whole:
            stream = whole.streams.video[0]
            given = list(packets(Torn(whole, error), stream))
            assert [p.size == 0 for p in given] == [False] * 120 + [True]
            assert sum(len(p.decode()) for p in given) == 120


def test_a_raw_stream_needs_a_rate_and_then_keeps_its_frames(tmp_path: Path) -> None:
    path = write_video(tmp_path / "raw.h264", range(12), tick=Fraction(1, 50), container="h264")
    with pytest.raises(TimeError, match="no time stamps") as raised:
        open_camera(path, PLAIN)
    assert "--sequence-fps" in raised.value.fix
    _, frames, _ = read(path, replace(PLAIN, sequence_fps=50.0))
    assert [number_of(f.image) for f in frames] == [0, 2, 4, 6, 8, 10]


def test_a_rate_for_a_file_with_stamps_is_refused_not_ignored(cfr60: Path) -> None:
    with pytest.raises(UsageError, match="stamps of its own"):
        open_camera(cfr60, replace(PLAIN, sequence_fps=50.0))


def test_without_any_start_the_file_is_refused_with_the_way_out(cfr60: Path) -> None:
    with pytest.raises(TimeError, match="nothing says when") as raised:
        open_camera(cfr60, CameraOptions(size=96))
    assert "--start" in raised.value.fix


def test_the_start_is_read_from_the_container(tmp_path: Path) -> None:
    path = write_video(
        tmp_path / "dated.mp4",
        range(50),
        tick=Fraction(1, 25),
        metadata={"creation_time": "2026-05-01T10:00:00Z"},
    )
    info, frames, found = read(path, CameraOptions(size=96))
    assert info.start == START == frames[0].time
    assert info.start_from == "metadata: creation_time"
    assert found["start-unsure"].severity is Severity.WARNING
    # Start or end of 1.96 s, cut to whole seconds: σ² = (1.96² + 1²) / 12.
    assert info.start_sigma == pytest.approx(((1.96**2 + 1) / 12) ** 0.5, rel=1e-3)


def test_the_wall_clock_inside_an_avchd_stream_needs_its_zone(tmp_path: Path) -> None:
    path = write_video(tmp_path / "cam.ts", range(25), tick=Fraction(1, 25), container="mpegts")
    dated = tmp_path / "dated.mts"
    # SEI (NAL type 6), unregistered user data (5), 16 + 4 + 1 + 2·5 bytes: 2026-05-01 12:00:00.
    body = bytes.fromhex("17ee8c60f84d11d98cd60800200c9a66") + b"MDPM" + bytes([2])
    body += bytes([0x18, 0x00, 0x20, 0x26, 0x05]) + bytes([0x19, 0x01, 0x12, 0x00, 0x00])
    payload, zeros = bytearray(), 0
    for byte in bytes([6, 5, len(body)]) + body + b"\x80":
        if zeros == 2 and byte <= 3:
            payload.append(3)
            zeros = 0
        payload.append(byte)
        zeros = zeros + 1 if byte == 0 else 0
    with av.open(str(path)) as source, av.open(str(dated), "w", format="mpegts") as out:
        stream = out.add_stream_from_template(source.streams.video[0])
        for packet in source.demux(source.streams.video[0]):
            if packet.size == 0:
                continue
            data = bytes(packet)
            if packet.is_keyframe:
                cut = data.index(b"\x00\x00\x00\x01", 4)
                data = data[:cut] + b"\x00\x00\x00\x01" + bytes(payload) + data[cut:]
            copy = av.Packet(data)
            copy.pts, copy.dts, copy.time_base = packet.pts, packet.dts, packet.time_base
            copy.is_keyframe = packet.is_keyframe
            copy.stream = stream
            out.mux(copy)
    with pytest.raises(TimeError, match="2026-05-01T12:00:00"):
        open_camera(dated, CameraOptions(size=96))
    info, _, _ = read(dated, CameraOptions(size=96, zone="Europe/Amsterdam"))
    assert (info.start, info.start_from) == (START, "metadata: recording time in the video")
