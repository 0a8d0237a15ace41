"""Remedies of bags, data sets of other programs, chapters and raw streams of films."""

from __future__ import annotations

import shutil
from pathlib import Path

import av
import numpy as np
import pytest

from tests.flagdata.ingest.mcap.conftest import NOON, STEP
from tests.flagdata.ingest.mcap.ros import (
    COMPRESSED,
    PLAIN,
    bag,
    channel,
    compressed,
    film,
    gray,
    plain,
)
from tests.remedies.scene import write_film
from tests.remedies.user import User

COLUMNS = ("--columns", "stamp=time,speed=wind_speed[m/s],direction=wind_direction[deg]")
SMALL = ("--rate", "native")
"""Bags of pictures are of 20 to 70 frames of 48 × 64."""


def two_cameras(path: Path, *, depth: bool = False) -> Path:
    """Two topics of pictures, of which the second holds depths where `depth`."""
    with bag(path) as writer:
        names = ("/left", "/right")
        cameras = [
            channel(writer, name, "sensor_msgs/msg/CompressedImage", COMPRESSED) for name in names
        ]
        for k in range(20):
            at = NOON + k * STEP
            for number, camera in enumerate(cameras):
                said = "16UC1; png compressed " if depth and number else "png"
                writer.add_message(camera, at, compressed(at, k, said=said), at)
    return path


def test_one_of_several_topics_is_chosen(user: User) -> None:
    two_cameras(user.folder / "a.mcap")
    user.meets("mcap/topics.py", "choose one: --topic NAME", "ingest", "a.mcap", *SMALL)
    user.again("--topic", "/left")


def test_another_topic_is_ingested_from_the_same_file(user: User) -> None:
    two_cameras(user.folder / "a.mcap")
    user.meets(
        "mcap/mcap_pictures.py",
        "ingest the file again wi",
        "ingest",
        "a.mcap",
        *SMALL,
        "--topic",
        "/left",
    )
    user.succeeds(
        "ingest", "a.mcap", *SMALL, "--topic", "/right", shows="(?m)^[0-9a-f]{32}  camera"
    )
    user.leaves(["--topic"])


def test_a_topic_of_depths_is_left_for_one_of_grays(user: User) -> None:
    two_cameras(user.folder / "a.mcap", depth=True)
    user.meets(
        "mcap/mcap_pictures.py",
        "choose a topic of grays",
        "ingest",
        "a.mcap",
        *SMALL,
        "--topic",
        "/right",
    )
    user.follows("ingest", "a.mcap", *SMALL, "--topic", "/left")


def test_pictures_with_stamps_need_no_rate(user: User) -> None:
    film(user.folder / "a.mcap", range(20))
    user.meets(
        "mcap/mcap_pictures.py",
        "leave out --sequence-fps",
        "ingest",
        "a.mcap",
        *SMALL,
        "--sequence-fps",
        25,
    )
    user.again(without="--sequence-fps")


def test_messages_of_several_types_on_a_topic_are_chosen_by_their_type(user: User) -> None:
    with bag(user.folder / "a.mcap") as writer:
        one = channel(writer, "/cam", "sensor_msgs/msg/CompressedImage", COMPRESSED)
        other = channel(writer, "/cam", "sensor_msgs/msg/Image", PLAIN)
        for k in range(24):
            at = NOON + k * STEP
            data = compressed(at, k) if k < 12 else plain(at, gray(k), "mono8")
            writer.add_message(one if k < 12 else other, at, data, at)
    fix = user.meets(
        "mcap/topics.py", "choose one by its type:", "ingest", "a.mcap", *SMALL, "--topic", "/cam"
    )
    user.follows("ingest", "a.mcap", *SMALL, *fix[fix.index("--topic") :].split())


def parts(folder: Path, *, described: bool) -> list[Path]:
    """A bag in three parts."""
    folder.mkdir()
    names = [f"bag_{part}.mcap" for part in range(3)]
    for part, name in enumerate(names):
        film(folder / name, range(8 * part, 8 * part + 8))
    if described:
        text = (
            "rosbag2_bagfile_information:\n  version: 8\n  storage_identifier: mcap\n  "
            "relative_file_paths:\n"
        )
        (folder / "metadata.yaml").write_text(text + "".join(f"    - {name}\n" for name in names))
    return [folder / name for name in names]


@pytest.mark.parametrize("described", [True, False])
def test_the_parts_of_a_bag_are_one_recording_as_a_folder(user: User, described: bool) -> None:
    given = [
        path.relative_to(user.folder) for path in parts(user.folder / "bag", described=described)
    ]
    command = ("ingest", *given, "--join")
    if described:
        fix = user.meets("mcap/bags.py", "the folder of the parts", *command)
    else:
        fix = user.meets("mcap/bags.py", "a folder of the parts al", *command)
        (user.folder / "whole").mkdir()
        for path in given:
            shutil.move(path, "whole")
    user.follows(*fix.rpartition("flagdata ")[2].split(), shows="24 frames")


def test_files_that_were_recorded_at_the_same_time_are_ingested_by_themselves(user: User) -> None:
    folder = user.folder / "bag"
    folder.mkdir()
    film(folder / "left.mcap", range(0, 140, 2))
    film(folder / "right.mcap", range(1, 140, 2))
    fix = user.meets("mcap/topics.py", "ingest each by itself: f", "ingest", "bag", *SMALL)
    assert fix.endswith("flagdata ingest bag/*.mcap")
    user.follows("ingest", *sorted(Path("bag").glob("*.mcap")), *SMALL)


def test_what_is_no_film_is_ingested_by_itself(user: User) -> None:
    film(user.folder / "a.mcap", range(20))
    fix = user.meets(
        "camera/joined.py", "ingest each by itself: f", "ingest", "second.mp4", "a.mcap", "--join"
    )
    user.follows(*fix.rpartition("flagdata ")[2].split())


def test_stamps_that_count_from_a_start_are_placed_when_the_film_is_ingested(user: User) -> None:
    with bag(user.folder / "a.mcap") as writer:
        camera = channel(writer, "/cam", "sensor_msgs/msg/CompressedImage", COMPRESSED)
        for k in range(20):
            writer.add_message(camera, k * STEP, compressed(k * STEP, k), k * STEP)
    ended = user.types("doctor", "a.mcap")
    assert ended.code == 3
    user.meets("ingest/foreign.py", "give --start when you in", "doctor", "a.mcap")
    user.follows(
        "ingest",
        "a.mcap",
        *SMALL,
        "--start",
        "2026-05-01T12:00:00Z",
        shows="2026-05-01T12:00:00Z to",
    )


def test_what_doctor_does_not_examine_is_looked_at_by_sniff(user: User) -> None:
    user.meets("ingest/foreign.py", "flagdata ingest --sniff", "doctor", "mast.csv")
    user.follows("ingest", "--sniff", "mast.csv", shows="anemometer: delimited")


def test_a_later_chapter_without_those_before_it_is_given_its_start(user: User) -> None:
    for number in (1, 2):
        write_film(user.folder / f"GX{number:02d}0001.MP4", frames=30 + number)
    (user.folder / "card").mkdir()
    shutil.copy(user.folder / "GX020001.MP4", user.folder / "card")
    user.meets("camera/chapters.py", "put the earlier chapters", "ingest", "card/GX020001.MP4")
    user.again("--start", "2026-05-01T10:00:01Z")


def test_a_film_that_states_the_time_of_the_one_before_it_is_given_its_start(user: User) -> None:
    for number in (1, 2):
        write_film(user.folder / f"C{number:04d}.MP4", frames=30 + number)
    user.meets("camera/chapters.py", "give --start", "ingest", "C0002.MP4")
    user.again("--start", "2026-05-01T10:00:01Z")


def test_another_stream_of_a_film_is_chosen(user: User) -> None:
    with av.open("two.mkv", "w") as container:
        streams = []
        for _ in range(2):
            stream = container.add_stream("libx264", rate=50, options={"threads": "1"})
            stream.height, stream.width, stream.pix_fmt = 48, 64, "yuv420p"
            streams.append(stream)
        for k in range(30):
            for stream in streams:
                image = np.full((48, 64), 40 + 3 * k, np.uint8)
                container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="gray")))
        for stream in streams:
            container.mux(stream.encode(None))
    start = ("--start", "2026-05-01T12:00:00Z")
    user.meets(
        "camera/video_file.py",
        "choose another with --st",
        "ingest",
        "two.mkv",
        *start,
        "--stream",
        0,
    )
    user.leaves(["--stream"])
    user.succeeds("ingest", "two.mkv", *start, "--stream", 1, shows="stream 1 was taken")


def test_the_rate_that_a_phone_took_is_given(user: User) -> None:
    with av.open("slow.mov", "w", options={"movflags": "use_metadata_tags"}) as container:
        container.metadata["com.android.capture.fps"] = "200"
        container.metadata["creation_time"] = "2026-05-01T10:00:00Z"
        stream = container.add_stream("libx264", rate=50, options={"threads": "1"})
        stream.height, stream.width, stream.pix_fmt = 48, 64, "yuv420p"
        for k in range(30):
            image = np.full((48, 64), 40 + 3 * k, np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, format="gray")))
        container.mux(stream.encode(None))
    fix = user.meets("camera/video_file.py", "give the camera's rate:", "ingest", "slow.mov")
    user.again(*fix[fix.index("--true-fps") :].split())


def test_a_crop_that_cuts_what_moves_is_taken_whole(user: User) -> None:
    fix = user.meets(
        "camera/stream.py", "takes it whole", "ingest", "second.mp4", "--crop", "32,0,32,48"
    )
    user.follows("ingest", "second.mp4", *fix.partition(" takes")[0].split())
