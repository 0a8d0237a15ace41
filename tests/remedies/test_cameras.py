"""Remedies of films whose rate, start or clock is not stated, of LeRobot's data sets, and of
damaged bags."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from mcap.writer import Writer
from PIL import Image

from tests.flagdata.ingest.camera.test_gpmf import film as with_telemetry
from tests.flagdata.ingest.camera.test_gpmf import until_hero10
from tests.flagdata.ingest.mcap.conftest import NOON, STEP
from tests.flagdata.ingest.mcap.ros import COMPRESSED, Cdr, bag, channel, compressed
from tests.remedies.cases import OR, Case, heal
from tests.remedies.user import User

START = ("--start", "2026-05-01T12:00:00Z")
ZSTANDARD = b"\x28\xb5\x2f\xfd"
"""What a frame of Zstandard begins with (RFC 8878)."""
SET = "export lerobot --to set --frames png --where \"name in ('first', 'second')\""
"""A data set of two episodes."""
CASES = [
    Case(
        "camera/recording_start.py",
        "declare its wind (flagdata declare)",
        "ingest second.mp4 --start unknown",
        (
            "declare second --speed 3 --sigma 0.2",
            OR,
            "align second mast --by given --clock-offset 830944805 --offset-sigma 0.1",
        ),
    ),
    Case(
        "camera/lerobot_camera.py",
        "choose one: --episode 0 to",
        "ingest set --rate native",
        ("ingest set --rate native --episode 1",),
        before=("ingest second.mp4", SET),
    ),
    Case(
        "camera/lerobot_camera.py",
        "leave out --sequence-fps",
        "ingest set --rate native --episode 0 --sequence-fps 25",
        ("ingest set --rate native --episode 0",),
        before=("ingest second.mp4", SET),
    ),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_what_a_remedy_says_heals(case: Case, user: User) -> None:
    heal(user, case)


def test_one_of_several_cameras_of_a_data_set_is_chosen(user: User) -> None:
    user.succeeds(
        "export", "lerobot", "--to", "set", "--frames", "png", "--where", "name = 'first'"
    )
    info = user.folder / "set" / "meta" / "info.json"
    described = json.loads(info.read_text())
    (camera,) = (name for name, one in described["features"].items() if one["dtype"] == "image")
    described["features"][f"{camera}.other"] = described["features"][camera]
    info.write_text(json.dumps(described))
    user.meets(
        "camera/lerobot_camera.py", "choose one: --topic NAME", "ingest", "set", "--rate", "native"
    )
    user.again("--topic", camera)


def test_raw_streams_are_ingested_by_themselves(user: User) -> None:
    for number, name in enumerate(("a.h264", "b.h264")):
        with av.open(name, "w", format="h264") as container:
            stream = container.add_stream("libx264", rate=50, options={"threads": "1"})
            stream.height, stream.width, stream.pix_fmt = 48, 64, "yuv420p"
            for k in range(30):
                image = np.full((48, 64), 40 + 3 * k + number, np.uint8)
                container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="gray")))
            container.mux(stream.encode(None))
    rate = ("--sequence-fps", 50, *START)
    user.meets(
        "camera/joined.py",
        "ingest the files by them",
        "ingest",
        "a.h264",
        "b.h264",
        "--join",
        *rate,
    )
    for name in ("a.h264", "b.h264"):
        user.follows("ingest", name, *rate)


def pictures(folder: Path, *, taken: str = "") -> None:
    """Thirty pictures that may state when they were taken, on a clock without a zone."""
    folder.mkdir()
    exif = Image.Exif()
    if taken:
        exif.get_ifd(0x8769)[0x9003] = taken
    for k in range(30):
        pixels = np.full((48, 64, 3), 40, np.uint8)
        pixels[:, 2 * k % 60 :][:, :4] = 200
        Image.fromarray(pixels).save(folder / f"img{k:03d}.jpg", exif=exif)


def test_the_zone_of_a_cameras_clock_is_named(user: User) -> None:
    pictures(user.folder / "pics", taken="2026:05:01 12:00:00")
    user.meets(
        "camera/recording_start.py",
        ", or --zone, the zone of",
        "ingest",
        "pics",
        "--sequence-fps",
        25,
    )
    user.again("--zone", "+02:00", shows="2026-05-01T10:00:00Z")


def test_a_rate_that_lets_pictures_last_for_days_is_given_anew(user: User) -> None:
    pictures(user.folder / "pics")
    user.meets(
        "camera/stream.py",
        "give the rate at which t",
        "ingest",
        "pics",
        *START,
        "--sequence-fps",
        "0.0001",
    )
    user.follows("ingest", "pics", *START, "--sequence-fps", 25)


def test_the_start_of_a_film_whose_gps_had_no_fix_is_given(user: User) -> None:
    with_telemetry(user.folder / "a.mp4", [until_hero10(second, fix=0) for second in range(2)])
    user.meets(
        "camera/video_file.py", "if that clock was not se", "ingest", "a.mp4", "--rate", "native"
    )
    user.again(*START, shows="2026-05-01T12:00:00Z, from option")


def test_a_take_after_the_clock_started_anew_is_ingested_by_itself(user: User) -> None:
    def take(name: str, begin: float) -> bytes:
        with av.open(name, "w", options={"mpegts_copyts": "1"}) as container:
            stream = container.add_stream("libx264", rate=25, options={"threads": "1", "bf": "0"})
            stream.height, stream.width, stream.pix_fmt = 48, 64, "yuv420p"
            for k in range(20):
                frame = av.VideoFrame.from_ndarray(
                    np.full((48, 64), 40 + 5 * k, np.uint8), format="gray"
                )
                frame.pts, frame.time_base = round(25 * begin) + k, Fraction(1, 25)
                container.mux(stream.encode(frame))
            container.mux(stream.encode(None))
        return Path(name).read_bytes()

    first, second = take("one.ts", 5000), take("two.ts", 4000)
    (user.folder / "both.ts").write_bytes(first + second)
    user.meets("camera/container_clock.py", "cut the file there and i", "ingest", "both.ts", *START)
    user.follows("ingest", "two.ts", "--start", "2026-05-01T12:01:00Z", shows="frames +20 ")


def test_a_topic_whose_pictures_are_whole_is_chosen(user: User) -> None:
    with bag(user.folder / "a.mcap") as writer:
        for topic in ("/left", "/right"):
            camera = channel(writer, topic, "sensor_msgs/msg/CompressedImage", COMPRESSED)
            for k in range(20):
                at = NOON + k * STEP
                broken = Cdr().stamp(at).text("cam").text("png").data(b"nothing").done()
                writer.add_message(
                    camera, at, broken if topic == "/left" else compressed(at, k, said="png"), at
                )
    command = ("ingest", "a.mcap", "--rate", "native", "--topic")
    user.meets("mcap/mcap_pictures.py", "choose another topic: --", *command, "/left")
    user.follows(*command, "/right")


def test_what_is_in_a_file_without_pictures_is_listed(user: User) -> None:
    user.succeeds("export", "mcap", "--to", "out", "--where", "name = 'mast'")
    (record,) = (user.folder / "out").glob("*.mcap")
    user.meets("mcap/topics.py", "see flagdata doctor FILE", "ingest", record, "--as", "camera")
    user.follows("doctor", record)


@pytest.mark.parametrize("damage", ["cut", "flipped"])
def test_what_is_whole_of_a_damaged_bag_is_saved(user: User, damage: str) -> None:
    with Path("a.mcap").open("wb") as stream:
        writer = Writer(stream, chunk_size=1000)
        writer.start(profile="ros2", library="test")
        camera = channel(writer, "/cam", "sensor_msgs/msg/CompressedImage", COMPRESSED)
        for k in range(40):
            at = NOON + k * STEP
            writer.add_message(camera, at, compressed(at, k, said="png"), at)
        writer.finish()
    data = Path("a.mcap").read_bytes()
    command = ("ingest", "a.mcap", "--rate", "native")
    if damage == "cut":
        Path("a.mcap").write_bytes(data[:-500])
        user.meets("mcap/mcap_layout.py", "salvage what is whole: f", *command)
    else:
        chunks = [at for at in range(len(data)) if data[at : at + 4] == ZSTANDARD]
        middle = chunks[len(chunks) // 2] + 40
        Path("a.mcap").write_bytes(
            data[:middle] + bytes([data[middle] ^ 0xFF]) + data[middle + 1 :]
        )
        user.meets("record/unpacking.py", "run `flagdata recover` o", *command)
    user.follows("recover", "a.mcap", "NEW.mcap")
    user.succeeds("ingest", "NEW.mcap", "--rate", "native")
