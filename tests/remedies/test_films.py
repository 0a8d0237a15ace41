"""Remedies of films, pictures, meshes, records and files of other programs."""

from __future__ import annotations

from typing import cast

import av
import numpy as np
import pytest
from av.video.stream import VideoStream
from PIL import Image

from tests.remedies.cases import OR, Case, heal
from tests.remedies.scene import write_film
from tests.remedies.user import User

FILM = "ingest second.mp4"
CASES = [
    Case("camera/stream.py", "leave out --topic", f"{FILM} --topic x", (FILM,)),
    Case("camera/stream.py", "leave out --episode", f"{FILM} --episode 2", (FILM,)),
    Case(
        "camera/video_container.py", "give --stream ", f"{FILM} --stream 3", (f"{FILM} --stream 0",)
    ),
    Case(
        "camera/video_container.py",
        "or give --true-fps HZ if a high-speed camera",
        f"{FILM} --sequence-fps 25",
        (FILM, OR, f"{FILM} --true-fps 100"),
    ),
    Case(
        "camera/stream.py",
        "choose a crop: --crop auto proposes one",
        FILM,
        (f"{FILM} --crop auto",),
    ),
    Case(
        "camera/recording_start.py",
        "or align the recording by its contents",
        FILM,
        (f"{FILM} --start 2026-05-01T10:00:00Z",),
    ),
    Case(
        "camera/stream.py",
        "or --true-fps HZ if the file states a wrong rate",
        f"{FILM} --exposure 0.1",
        (f"{FILM} --exposure 0.002", OR, f"{FILM} --exposure 0.1 --true-fps 5"),
    ),
    Case(
        "markers/marker_table.py",
        "give the frames per second by --rate",
        "ingest frames.csv",
        ("ingest frames.csv --rate 25",),
    ),
    Case("meshes/folder.py", "give it by --rate", "ingest meshes", ("ingest meshes --rate 25",)),
    Case(
        "meshes/mesh_artifacts.py",
        "name the unit of the positions by --unit",
        "ingest meshes --rate 25 --unit mm",
        ("ingest meshes --rate 25 --unit m",),
    ),
    Case(
        "mcap/topics.py",
        "salvage what is whole: flagdata recover FILE NEW.mcap",
        "ingest cut.mcap",
        ("recover cut.mcap NEW.mcap", "ingest NEW.mcap"),
    ),
    Case(
        "mcap/topics.py",
        "salvage what is whole: flagdata recover FILE NEW.mcap",
        "doctor cut.mcap",
        ("recover cut.mcap NEW.mcap", "doctor NEW.mcap"),
    ),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_what_a_remedy_says_heals(case: Case, user: User) -> None:
    heal(user, case)


def test_a_cloth_whose_texture_is_in_millimetres_is_exported_in_metres(user: User) -> None:
    """The unit of its positions is named as the next message says."""

    def export(places: str, texture: str) -> None:
        for path in (user.folder / "meshes").iterdir():
            lines = (line.split() for line in original[path.name].splitlines())
            factor = {"v": units[places], "vt": units[texture]}
            rows = (
                [w, *(f"{factor[w] * float(x):g}" if w in factor else x for x in rest)]
                for w, *rest in lines
            )
            path.write_text("\n".join(map(" ".join, rows)) + "\n")

    units = {"m": 1, "mm": 1000}
    original = {path.name: path.read_text() for path in (user.folder / "meshes").iterdir()}
    command = ("ingest", "meshes", "--rate", 25)
    export("mm", "mm")
    refused = user.types(*command)
    assert "a cloth of 500 m by its texture coordinates" in refused.err
    assert "fix:   export it with texture coordinates in metres\n" in refused.err
    export("mm", "m")
    user.meets("meshes/mesh_artifacts.py", "name the unit of the positions by --unit", *command)
    user.again("--unit", "mm")
    export("m", "m")
    user.succeeds(*command)


@pytest.fixture
def pictures(user: User) -> list[Image.Image]:
    """Thirty pictures, in the folder pics too."""
    (user.folder / "pics").mkdir()
    images = []
    for k in range(30):
        pixels = np.full((48, 64, 3), 40, np.uint8)
        pixels[:, 2 * k % 60 :][:, :4] = 200
        images.append(Image.fromarray(pixels))
        images[-1].save(user.folder / "pics" / f"img{k:03d}.png")
    return images


def test_pictures_need_a_rate_and_a_start(user: User, pictures: list[Image.Image]) -> None:
    rate = ("--sequence-fps", "25")
    user.meets(
        "camera/sequence.py",
        "--sequence-fps",
        "ingest",
        "pics",
        "--start",
        "2026-05-01T12:00:00+02:00",
    )
    user.again(*rate)
    fix = user.meets(
        "camera/recording_start.py", "give --start with a zone, e.g.", "ingest", "pics", *rate
    )
    user.again(*fix[fix.index("--start 2") :].split()[:2])
    user.meets(
        "camera/stream.py",
        "leave out --stream",
        "ingest",
        "pics",
        *rate,
        "--stream",
        1,
        "--start",
        "2026-05-01T12:00:00+02:00",
    )
    user.again(without="--stream")


def test_the_rate_of_a_gif_is_given(user: User, pictures: list[Image.Image]) -> None:
    pictures[0].save(user.folder / "a.gif", save_all=True, append_images=pictures[1:], duration=40)
    start = ("--start", "2026-05-01T12:00:00Z")
    user.meets(
        "camera/video_file.py", "if the camera's rate is known, give it", "ingest", "a.gif", *start
    )
    user.again("--true-fps", 25)
    pictures[0].save(user.folder / "b.gif", save_all=True, append_images=pictures[1:], duration=0)
    user.meets(
        "camera/video_file.py", "give the rate at which the camera ran", "ingest", "b.gif", *start
    )
    user.again("--true-fps", 25)


@pytest.mark.parametrize(
    "form", [("a.h264", "libx264", "yuv420p"), ("a.mjpeg", "mjpeg", "yuvj420p")]
)
def test_a_raw_stream_is_a_film_whose_rate_is_given(user: User, form: tuple[str, str, str]) -> None:
    name, codec, pixels = form
    with av.open(name, "w", format=name.partition(".")[2]) as container:
        stream = cast(VideoStream, container.add_stream(codec, rate=50, options={"threads": "1"}))
        stream.height, stream.width, stream.pix_fmt = 48, 64, pixels
        for k in range(30):
            image = av.VideoFrame.from_ndarray(
                np.full((48, 64), 40 + 3 * k, np.uint8), format="gray"
            )
            container.mux(stream.encode(image.reformat(format=pixels)))
        container.mux(stream.encode(None))
    start = ("--start", "2026-05-01T12:00:00Z")
    user.meets("camera/video_container.py", "give the camera's frame", "ingest", name, *start)
    user.again("--sequence-fps", 50, shows=r"\(0.560 s\)")


def test_files_that_are_no_chapters_are_ingested_by_themselves(user: User) -> None:
    write_film(user.folder / "a.mp4", frames=25, begin="2026-05-01T10:00:00Z")
    write_film(user.folder / "b.mp4", frames=25, begin="2026-05-01T10:00:00Z", size=(32, 32))
    write_film(user.folder / "c.mp4", frames=25, begin="2026-05-01T11:00:00Z")
    user.meets(
        "camera/joined.py",
        "ingest it by itself, without --join",
        "ingest",
        "a.mp4",
        "b.mp4",
        "--join",
    )
    user.follows("ingest", "b.mp4")
    user.meets("camera/joined.py", "or leave out --join", "ingest", "a.mp4", "c.mp4", "--join")
    user.follows("ingest", "a.mp4", "c.mp4")


def test_a_record_without_its_row_is_taken_off_and_named_or_ingested_from_the_export(
    user: User,
) -> None:
    user.succeeds("ingest", "second.mp4", "--session", "s")
    user.succeeds("export", "mcap", "--to", "out", "--where", "name = 'second'")
    (exported,) = (user.folder / "out").glob("*.mcap")
    exported.with_name("alone").mkdir()
    alone = exported.rename(exported.with_name("alone") / exported.name)
    user.succeeds("withdraw", "second", "-m", "to restore it")
    fix = user.meets("ingest/records.py", "take it off (flagdata withdraw)", "ingest", alone)
    user.follows("withdraw", "second", "-m", "to name it")
    user.leaves(["export"])
    assert "--name" in fix
    user.succeeds("ingest", alone, "--name", "n", "--session", "s")
    user.succeeds("withdraw", "n", "-m", "to restore it")
    alone.rename(exported)
    user.succeeds("ingest", exported)
    assert '"session": "s"' in user.succeeds("show", "second", "--json").out


def test_the_files_of_an_export_are_named_where_its_folder_was(user: User) -> None:
    user.succeeds("export", "mcap", "--to", "out")
    ended = user.types("ingest", "out")
    assert "give the files in it: out/*.mcap" in ended.err
    user.succeeds("ingest", *sorted((user.folder / "out").glob("*.mcap")))
