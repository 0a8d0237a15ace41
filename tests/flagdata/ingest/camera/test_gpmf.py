"""GPS time in GoPro's telemetry, in files written here after the documented format."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from flagdata.ingest import CameraOptions, open_camera, probe
from flagdata.timebase import NANOSECONDS, parse

START = parse("2026-05-01T10:00:00.250Z")


def record(key: str, kind: str, size: int, count: int, content: bytes) -> bytes:
    return (
        key.encode()
        + struct.pack(">cBH", kind.encode(), size, count)
        + content
        + bytes(-len(content) % 4)
    )


def nested(key: str, *records: bytes) -> bytes:
    content = b"".join(records)
    return key.encode() + struct.pack(">BBH", 0, 1, len(content)) + content


def device(*records: bytes) -> bytes:
    name, other = (
        record("DVNM", "c", 1, 6, b"Camera"),
        nested("STRM", record("ACCL", "s", 6, 1, bytes(6))),
    )
    return nested(
        "DEVC", record("DVID", "L", 4, 1, bytes(4)), name, other, nested("STRM", *records)
    )


def until_hero10(second: int, *, fix: int = 3, clock: str = "2605011000{:02d}.250") -> bytes:
    return device(
        record("GPSF", "L", 4, 1, struct.pack(">L", fix)),
        record("GPSU", "U", 16, 1, clock.format(second).encode()),
        record("GPS5", "l", 20, 1, bytes(20)),
    )


def since_hero11(second: int, *, fix: int = 3) -> bytes:
    day, midnight = (
        9617,
        36_000_000 + 250 + 1000 * second,
    )  # 2026-05-01 is 9,617 days after 2000-01-01
    rows = [
        struct.pack(">7l2H", 1, 2, 3, 4, 5, day, midnight + 100 * k, 150, fix) for k in range(10)
    ]
    return device(
        record("TYPE", "c", 1, 9, b"lllllllSS"),
        record(
            "SCAL", "l", 4, 9, struct.pack(">9l", 10**7, 10**7, 1000, 1000, 100, 1, 1000, 100, 1)
        ),
        record("GPS9", "?", 32, 10, b"".join(rows)),
    )


def film(path: Path, payloads: Sequence[bytes], *, first: int = 0) -> Path:
    """A film of one second a payload, 5 frames each; its pictures begin `first` seconds after its
    telemetry."""
    with av.open(str(path), "w") as out:
        out.metadata["creation_time"] = "2026-05-01T12:00:03Z"
        video = out.add_stream("mpeg4", rate=5)
        video.width, video.height, video.pix_fmt = 64, 48, "yuv420p"
        telemetry = out.add_data_stream("bin_data")  # FFmpeg names its handler as the cameras do
        for second, payload in enumerate(payloads):
            packet = av.Packet(payload)
            packet.stream, packet.time_base = telemetry, Fraction(1, 1000)
            packet.pts = packet.dts = 1000 * second
            packet.duration = 1000
            out.mux(packet)
            for k in range(5 * second, 5 * second + 5):
                shown = av.VideoFrame.from_ndarray(
                    np.full((72, 64), 90, dtype=np.uint8), format="yuv420p"
                )
                shown.pts = k + 5 * first
                out.mux(video.encode(shown))
        out.mux(video.encode(None))
    return path


@pytest.mark.parametrize("payload", [until_hero10, since_hero11])
@pytest.mark.parametrize("first", [0, 2])
def test_a_film_begins_by_the_gps_time_of_its_telemetry(
    tmp_path: Path, payload, first: int
) -> None:
    path = film(tmp_path / "gopro.mp4", [payload(second) for second in range(4)], first=first)
    with open_camera(path, CameraOptions()) as camera:
        begun = START + first * NANOSECONDS
        assert (camera.info.start, camera.info.start_from) == (begun, "telemetry: GPS")
        # anywhere within a payload of one second
        assert camera.info.start_sigma == pytest.approx(1 / 3**0.5, abs=0.01)
        (finding,) = [one for one in camera.findings if one.kind == "start-by-gps"]
    assert f"is {7202.75 - first:.1f} s ahead" in finding.what  # 12:00:03 by a clock two hours off
    found = probe(path).start
    assert found is not None
    assert found.instant == begun


def test_payloads_without_a_fix_or_damaged_do_not_count(tmp_path: Path) -> None:
    wrong = until_hero10(0, fix=0, clock="1601010000{:02d}.000")  # a clock that was never set
    payloads = [
        wrong,
        wrong,
        until_hero10(2)[:-30],
        b"DEVC\0\1\xff\xff",
        until_hero10(4),
        until_hero10(5),
    ]
    with open_camera(film(tmp_path / "late.mp4", payloads), CameraOptions()) as camera:
        assert camera.info.start == START


def test_one_wrong_time_among_many_does_not_move_the_start(tmp_path: Path) -> None:
    payloads = [
        until_hero10(0, clock="2605010900{:02d}.250"),
        *(until_hero10(second) for second in range(1, 5)),
    ]
    with open_camera(film(tmp_path / "slip.mp4", payloads), CameraOptions()) as camera:
        assert camera.info.start == START


@pytest.mark.parametrize(
    "payload", [until_hero10(0, fix=0), since_hero11(0, fix=0), b"DEVC\0\1\0\0"]
)
def test_telemetry_without_a_fix_leaves_the_cameras_own_clock(
    tmp_path: Path, payload: bytes
) -> None:
    with open_camera(film(tmp_path / "indoors.mp4", [payload] * 2), CameraOptions()) as camera:
        assert camera.info.start_from == "metadata: creation_time"
        kinds = {finding.kind for finding in camera.findings}
    assert "telemetry-without-time" in kinds


def test_the_users_start_goes_before_gps(tmp_path: Path) -> None:
    with open_camera(
        film(tmp_path / "gopro.mp4", [until_hero10(0)]), CameraOptions(start=0)
    ) as camera:
        assert camera.info.start == 0
