"""Whether a source is a camera's, an anemometer's, a mesh sequence or a table of markers, by its
content."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from flagdata.core.files.regular_files import LEROBOT_INFO, check_input, is_folder, is_lerobot
from flagdata.errors import FlagdataError, InputError, UnknownNameError
from flagdata.ingest.anemometer import Guess, sniff
from flagdata.ingest.anemometer.formats.log_formats import FORMATS
from flagdata.ingest.markers import COLUMNS, is_marker_table
from flagdata.ingest.mcap.bags import is_bag, other_bag

if TYPE_CHECKING:
    from flagdata.ingest.camera.camera_probing import Pictured

CAMERA = "camera"
MESHES = "meshes"
MARKERS = "markers"


def guesses(
    path: Path, *, topic: str | None = None, encoding: str | None = None
) -> tuple[Guess, ...]:
    """Lists what a source may be, the likeliest first; never empty. A file of no known signature is
    tried as a video.

    Args:
        topic: of an MCAP file, for which it is judged.
        encoding: of a text, by the user's word.

    Raises:
        NotFoundError: there is no such source.
        InputError: it is empty, or a pipe or device, which has no content to go by.
    """
    if not is_folder(path):
        check_input(path)
    if path.is_file() and is_marker_table(path):
        reason = f"its columns are {', '.join(COLUMNS)} and more"
        return (Guess(format="marker table", score=0.99, reasons=(reason,), kind="markers"),)
    if is_bag(path):
        return _of_mcap(path, topic)
    bag = other_bag(path)
    if bag is not None:
        return (
            Guess(
                format="bag", score=0.99, reasons=(f"this is {bag[0]}",), kind="other", fix=bag[1]
            ),
        )
    if is_lerobot(path):
        reason = f"it has LeRobot's {LEROBOT_INFO}"
        return (Guess(format="LeRobot", score=0.99, reasons=(reason,), kind="camera"),)
    candidates = sniff(path, encoding=encoding)
    if candidates[0].kind != "other":
        return candidates
    video = _first_picture(path) if path.is_file() else None
    if video is None:
        return candidates
    reason = f"FFmpeg reads it as {video.container} with {video.codec} video"
    return (Guess(format="video", score=0.8, reasons=(reason,), kind="camera"), *candidates)


def classify(
    path: Path,
    *,
    format_name: str | None = None,
    recipe: str | None = None,
    columns: str | None = None,
    topic: str | None = None,
    encoding: str | None = None,
) -> Guess:
    """Classifies what a source is to be ingested as: a guess of kind "camera", "anemometer",
    "meshes", "markers" or "record".

    Args:
        format_name: what the user says it is: "camera", "meshes", "markers" or an anemometer
            format; goes before the content.
        recipe: a sensor recipe the user named, for any source that is no camera's, meshes or
            markers by its content.
        columns: what the columns of a table are, by the user's word; likewise.
        topic: of an MCAP file.
        encoding: of a text, by the user's word.

    Raises:
        InputError: something else (one mesh, an archive), with what to do.
        UnknownNameError: no such format.
        NotFoundError: there is no such source.
    """
    if not is_folder(path):
        check_input(path)
    if format_name == CAMERA:
        return Guess(format="video", score=1.0, reasons=("given as a camera's",), kind="camera")
    if format_name == MESHES:
        return Guess(format="mesh folder", score=1.0, reasons=("given as meshes",), kind="meshes")
    if format_name == MARKERS:
        return Guess(
            format="marker table", score=1.0, reasons=("given as markers",), kind="markers"
        )
    if format_name is not None:
        if format_name not in FORMATS:
            raise UnknownNameError.of(
                "format", format_name, [CAMERA, MESHES, MARKERS, *FORMATS], where="--as"
            )
        return Guess(
            format=format_name, score=1.0, reasons=(f"the format {format_name} was named",)
        )
    best = guesses(path, topic=topic, encoding=encoding)[0]
    by_content = best.kind in (CAMERA, MARKERS, "record") or (best.kind == MESHES and path.is_dir())
    if recipe is not None and not by_content:
        return Guess(
            format="delimited",
            score=1.0,
            reasons=(f"the recipe {recipe} was named",),
            recipe=recipe,
        )
    if columns is not None and not by_content:
        return Guess(format="delimited", score=1.0, reasons=("its columns were named",))
    if by_content or best.kind == "anemometer":
        return best
    raise InputError(
        "this is no video, wind log, folder of meshes or table of markers: "
        f"{'; '.join(best.reasons)}",
        where=str(path),
        fix=best.fix or "see flagdata ingest --sniff",
    )


def _of_mcap(path: Path, topic: str | None) -> tuple[Guess, ...]:
    """Recognises a record of flagdata's, or of another program's file the topic that was named:
    pictures before numbers."""
    from flagdata.ingest.anemometer.containers.mcap_topic import of_numbers
    from flagdata.ingest.mcap.bags import parts_of
    from flagdata.ingest.mcap.mcap_pictures import of_pictures
    from flagdata.ingest.mcap.topics import profile, topics
    from flagdata.ingest.records import is_ours
    from flagdata.record.writer import PROFILE

    ours = topic is None and any(
        profile(part) == PROFILE and is_ours(part) for part in parts_of(path)
    )
    if ours and path.is_file():
        return (
            Guess(
                format="record",
                score=1.0,
                reasons=("its header says that flagdata wrote it",),
                kind="record",
            ),
        )
    if ours:  # each is a recording of its own
        reason, fix = (
            "a folder of records that flagdata wrote",
            f"give the files in it: {path / '*.mcap'}",
        )
        return (Guess(format="records", score=0.0, reasons=(reason,), kind="other", fix=fix),)
    present = [
        present_topic
        for present_topic in topics(path)
        if topic in (None, present_topic.name, present_topic.plain)
    ]
    candidates = [
        Guess(
            format="MCAP",
            score=0.9,
            reasons=(f"the topic {picture_topic} holds pictures",),
            kind="camera",
        )
        for picture_topic in of_pictures(present)
    ]
    candidates += [
        Guess(format="MCAP", score=0.8, reasons=(f"the topic {number_topic} holds numbers",))
        for number_topic in of_numbers(path, present)
    ]
    if candidates:
        return tuple(candidates)
    if topic is not None:
        raise UnknownNameError.of(
            "topic of pictures or numbers",
            topic,
            [present_topic.name for present_topic in topics(path)],
        )
    reason = (
        "its topics hold neither pictures nor numbers: "
        f"{', '.join(map(str, present)) or 'there are none'}"
    )
    return (
        Guess(
            format="MCAP",
            score=0.0,
            reasons=(reason,),
            kind="other",
            fix="give a file that has such a topic",
        ),
    )


def _first_picture(path: Path) -> Pictured | None:
    from flagdata.ingest.camera.camera_probing import (
        first_picture,
    )  # decoders of video, which a wind's log needs none of

    try:
        return first_picture(path)
    except FlagdataError:
        return None
