"""One camera of one episode of a LeRobot data set (version 3.0), frame by frame for ingest: from
its MP4, or from pictures in the table of frames.

If the data set has the feature `flagdata.time`, as flagdata's exports do, it gives each frame's
instant in UTC. Otherwise times count from the episode's start (column `timestamp`), and the user
gives the start.

Source: lerobot 0.6, `lerobot.datasets`.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from functools import partial
from itertools import islice
from pathlib import Path
from types import NoneType
from typing import Any, TypeVar

import av
import av.error
import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from PIL import Image

from flagdata.core.arrays import IntArray
from flagdata.core.files.bounded_parquet import read_parquet
from flagdata.core.files.regular_files import LEROBOT_INFO, LEROBOT_LABEL, LEROBOT_OWN, is_beside
from flagdata.core.findings import Finding, Severity
from flagdata.core.printable import printable
from flagdata.errors import (
    CorruptError,
    InputError,
    LimitError,
    NotFoundError,
    TimeError,
    UnknownNameError,
)
from flagdata.ingest.camera.camera_options import CameraOptions
from flagdata.ingest.camera.damage import undecoded_findings
from flagdata.ingest.camera.frame_stamps import survey
from flagdata.ingest.camera.luma import BROKEN, STILLS, luma_of_frame, luma_of_image
from flagdata.ingest.camera.picture_geometry import Orientation
from flagdata.ingest.camera.picture_source import Picture, SourceFacts
from flagdata.ingest.camera.video_container import open_container
from flagdata.recipes.documents import from_json, read_json
from flagdata.recipes.shelves import is_name

VERSION = "v3.0"
TIME = "flagdata.time"
"""Feature with each frame's instant [UTC ns]."""
_TRAIN_ALONE = (
    "its description has one split, train, which LeRobot writes for every data set: no side is "
    "taken from it"
)
_EPISODES = re.compile(r"(\d{1,18}):(\d{1,18})")
_NANOSECOND = Fraction(1, 1_000_000_000)
_FIELD = re.compile(r"\{(\w+)(?::0?(\d?)d)?\}")
_FARTHEST = 9.2e18  # ns; 64 bits hold a little more
_EARLY = (
    0.25  # frame periods by which a decoded frame may precede the first one wanted and still count
)

T = TypeVar("T")


def description_of(folder: Path) -> Mapping[str, Any]:
    """Reads what meta/info.json states of a data set.

    Raises:
        CorruptError: it cannot be read, or lacks what each has.
        InputError: another version, or another way of storing it.
    """
    where = folder / LEROBOT_INFO
    info = read_json(where, noun="LeRobot's description")
    version, stored = info.get("codebase_version"), info.get("storage_format", "parquet")
    if version != VERSION:
        fix = "convert it by LeRobot's own script, convert_dataset_v21_to_v30"
        raise InputError(
            f"the LeRobot data set has version {version}, not {VERSION}", where=str(where), fix=fix
        )
    if stored != "parquet":
        fix = "write it as Parquet and MP4 by LeRobot's own tools"
        raise InputError(f"the LeRobot data set is stored as {stored}", where=str(where), fix=fix)
    fps = info.get("fps")
    is_complete = isinstance(info.get("features"), dict) and isinstance(info.get("data_path"), str)
    if not is_complete or not isinstance(fps, int | float) or fps <= 0:
        message = "LeRobot's description lacks its features, paths or frame rate"
        raise CorruptError(message, where=str(where), fix="copy it again")
    return info


def stated_of(
    folder: Path, info: Mapping[str, Any], row: Mapping[str, Any]
) -> tuple[dict[str, Any], tuple[Finding, ...]]:
    """Reads what a data set states of an episode, as columns of the catalog: data set and side,
    seed and session.

    The side is the split of its description that the episode is in. One split, train, over all
    episodes states none: LeRobot writes it for every data set. An export of flagdata says under a
    key of its own whether its splits are sides, and has seed and session in the label of the
    episode.

    Args:
        row: of the table of episodes.

    Raises:
        CorruptError: splits that are no ranges of episodes, an episode in two of them, or a label
            that is damaged.
    """
    own = info.get(LEROBOT_OWN)
    label = _label(row, str(folder))
    columns = {name: label[name] for name in ("seed", "session") if label.get(name) is not None}
    number = round(_number(row, "episode_index", str(folder)))
    splits = _splits(info, str(folder / LEROBOT_INFO))
    if isinstance(own, Mapping):
        splits = splits if own.get("split_by") is not None else {}
    elif splits == {"train": (0, info.get("total_episodes"))}:
        return columns, (
            Finding(kind="side-not-stated", severity=Severity.NOTE, what=_TRAIN_ALONE),
        )
    sides = [side for side, (first, end) in splits.items() if first <= number < end]
    if len(sides) > 1:
        raise CorruptError(
            f"episode {number} is in the splits {' and '.join(map(repr, sides))}",
            where=str(folder / LEROBOT_INFO),
            fix="correct its splits, which are ranges of episodes: first:end",
        )
    if sides:
        columns |= {
            "dataset": label.get("dataset") or printable(folder.resolve().name),
            "side": sides[0],
        }
    return columns, ()


def _splits(info: Mapping[str, Any], where: str) -> dict[str, tuple[int, int]]:
    """Reads the first and one past the last episode of each split.

    Raises:
        CorruptError: they are not stated so.
    """
    stated = info.get("splits") or {}
    matches = {
        name: _EPISODES.fullmatch(value)
        for name, value in (stated.items() if isinstance(stated, Mapping) else [("", "")])
        if is_name(name) and isinstance(value, str)
    }
    found = {
        name: (int(match[1]), int(match[2])) for name, match in matches.items() if match is not None
    }
    if len(found) != len(stated):
        raise CorruptError(
            "its splits are no ranges of episodes",
            where=where,
            fix="correct its splits, which are ranges of episodes: first:end",
        )
    return found


def _label(row: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Reads the label that an export of flagdata has for an episode; nothing in another data set.

    Raises:
        CorruptError: it is damaged.
    """
    text = row.get(LEROBOT_LABEL)
    if text is None:
        return {}
    try:
        label = from_json(text)
        texts = [label[name] for name in ("dataset", "session") if label.get(name) is not None]
        if not all(map(is_name, texts)) or type(label.get("seed")) not in (int, NoneType):
            raise ValueError("values of other types")
    except (ValueError, TypeError, AttributeError) as error:
        raise CorruptError(
            f"the label of an episode is damaged: {error}", where=where, fix="export it again"
        ) from None
    return label


def cameras(info: Mapping[str, Any]) -> dict[str, str]:
    """Lists the features that are pictures: name → "video" or "image"."""
    kinds = {
        name: str(feature.get("dtype"))
        for name, feature in info["features"].items()
        if isinstance(feature, Mapping)
    }
    return {name: kind for name, kind in kinds.items() if kind in ("video", "image")}


class EpisodeSource:
    """The pictures of one camera in one episode. See
    `flagdata.ingest.camera.picture_source.PictureSource`.

    Raises:
        InputError: several episodes or cameras and none is named, or none of its pictures can be
            decoded.
        NotFoundError: no such episode, or one of its files is missing.
        UnknownNameError: no such camera.
        TimeError: a rate for frames that have stamps.
        CorruptError: its tables cannot be read.
    """

    def __init__(self, folder: Path, options: CameraOptions) -> None:
        self._where = str(folder)
        info = description_of(folder)
        self._camera, self._kind = _chosen(cameras(info), options.topic, self._where)
        if options.sequence_fps is not None:
            raise TimeError(
                "its frames have stamps", where=self._where, fix="leave out --sequence-fps"
            )
        row = _episode(folder, options.episode)
        data = folder / _path(info["data_path"], row, "data", self._where)
        columns = ["timestamp", *([TIME] if TIME in info["features"] else [])]
        columns += [self._camera] if self._kind == "image" else []
        table = _table(data, columns, round(_number(row, "episode_index", self._where)))
        if table.num_rows > options.limits.frames:
            raise LimitError(
                f"{table.num_rows} frames are beyond the limit of {options.limits.frames}",
                where=self._where,
                fix="raise the limit",
            )
        self._stamped = TIME in columns
        self._stamps = stamps_of(table, str(data))
        self._limits = options.limits
        self._folder = folder
        self._pictures = table[self._camera] if self._kind == "image" else None
        self._film: tuple[Path, float, float] | None = None
        if self._kind == "video":
            of_film = f"videos/{self._camera}"
            path = folder / _path(
                str(info.get("video_path")), row, of_film, self._where, video_key=self._camera
            )
            begin, end = (
                _number(row, f"{of_film}/{part}_timestamp", self._where) for part in ("from", "to")
            )
            if not 0 <= begin < end:
                raise CorruptError(
                    f"its film lasts from {begin} s to {end} s",
                    where=self._where,
                    fix="copy it again",
                )
            self._film = (path, begin, end)
        self._broken = 0
        timing = survey(
            np.sort(self._stamps),
            tick=_NANOSECOND,
            missing=0,
            fallback_rate=Fraction(str(info["fps"])),
            where=self._where,
        )
        first = next(self.samples(1, 1, 1), None)
        if first is None:
            raise InputError(
                "no picture of the episode can be decoded", where=self._where, fix="copy it again"
            )
        luma = first[0].luma()
        data_set, side_findings = stated_of(folder, info, row)
        findings = [*([] if self._stamped else [_counted_finding()]), *side_findings]
        self.facts = SourceFacts(
            container="lerobot",
            codec=self._kind,
            pixel_format="",
            width=luma.image.width,
            height=luma.image.height,
            aspect=Fraction(1),
            orientation=Orientation(),
            interlaced=False,
            timing=timing,
            metadata={},
            recorded=None,
            sequence=False,
            findings=tuple(findings),
            stamped=timing.origin if self._stamped else None,
            data_set=data_set,
        )

    def pictures(self) -> Iterator[Picture]:
        count = 0
        for picture in self._decode_pictures():
            count += 1
            yield picture
        self._broken = len(self._stamps) - count

    def samples(self, runs: int, count: int, stride: int) -> Iterator[list[Picture]]:
        length = len(self._stamps)
        first = 0
        for run in range(runs):
            start = max(first, length * run // runs)
            first = min(start + count * stride, length)
            pictures = list(islice(self._decode_pictures(start), 0, count * stride, stride))
            if pictures:
                yield pictures

    def damage(self) -> list[Finding]:
        return undecoded_findings(self._broken, total=len(self._stamps))

    def close(self) -> None:
        """Files are open only while pictures are read."""

    def _decode_pictures(self, start: int = 0) -> Iterator[Picture]:
        if self._film is not None:
            yield from self._of_film(start)
            return
        pictures = (
            self._pictures if self._pictures is not None else pa.chunked_array([], pa.binary())
        )
        for stamp, cell in zip(self._stamps[start:].tolist(), pictures.slice(start), strict=True):
            value = cell.as_py()
            stored = value.get("bytes") if isinstance(value, Mapping) else value
            try:
                if not stored:
                    stored = (self._folder / _inside(str(value["path"]), self._where)).read_bytes()
                image = Image.open(io.BytesIO(stored), formats=STILLS)
                if image.width * image.height > self._limits.frame_pixels:
                    raise LimitError(
                        "a picture is beyond the limit of pixels",
                        where=self._where,
                        fix="raise the limit",
                    )
                image.load()
            except BROKEN:
                continue
            yield Picture(stamp=stamp, luma=partial(luma_of_image, image))

    def _of_film(self, start: int) -> Iterator[Picture]:
        """Frames of the episode's part of its film: the k-th belongs to the k-th row."""
        path, begin, end = self._film or (Path(), 0.0, 0.0)
        if not path.is_file():
            raise NotFoundError(
                "the film of the episode is missing", where=str(path), fix="copy the data set again"
            )
        period = (end - begin) / max(len(self._stamps), 1)
        wanted = begin + start * period
        try:
            container, stream = open_container(path, self._limits, threads=1)
            with container:
                container.seek(int((wanted - period) * av.time_base) if wanted > period else 0)
                for frame in container.decode(stream):
                    at = frame.time
                    if at is None or at < wanted - _EARLY * period:
                        continue
                    number = round((at - begin) / period)
                    if number >= len(self._stamps):
                        return
                    luma = partial(luma_of_frame, frame, codec=stream.codec_context.name)
                    yield Picture(stamp=int(self._stamps[number]), luma=luma)
        except av.error.FFmpegError:
            return


def _path(template: str, row: Mapping[str, Any], prefix: str, where: str, **names: str) -> str:
    """Builds the path where the description has a file of an episode, from the data set's folder
    on.

    Raises:
        CorruptError: outside that folder, or not by the fields that LeRobot has.
    """
    numbers = {
        part: round(_number(row, f"{prefix}/{part}", where))
        for part in ("chunk_index", "file_index")
    }

    def fill_field(match: re.Match[str]) -> str:
        values = {**numbers, **names}
        return str(values[match[1]]).zfill(int(match[2] or 0)) if match[1] in values else match[0]

    text = _FIELD.sub(fill_field, template)
    if "{" in text:
        raise CorruptError(
            f"{template!r} names no file", where=f"{where}/{LEROBOT_INFO}", fix="copy it again"
        )
    return _inside(text, where)


def _inside(text: str, where: str) -> str:
    """Checks a path within a data set.

    Raises:
        CorruptError: it leads out of it.
    """
    if text.startswith("/") or "\0" in text or ".." in Path(text).parts:
        raise CorruptError(
            f"{text!r} leads out of the data set", where=where, fix="do not trust this data set"
        )
    return text


def _number(row: Mapping[str, Any], name: str, where: str) -> float:
    """Reads a number of a row of the table of episodes.

    Raises:
        CorruptError: it is not there, or no finite number.
    """
    value = row.get(name)
    if not isinstance(value, int | float) or not math.isfinite(value):
        raise CorruptError(
            f"the table of episodes does not state {name}", where=where, fix="copy it again"
        )
    return value


def stamps_of(table: pa.Table, where: str) -> IntArray:
    """Reads (n,) instants of frames [UTC ns], or nanoseconds from the episode's start where the
    table has no `TIME`.

    Raises:
        CorruptError: a column of another type, or with values that are no instants.
    """
    name, kind = (
        (TIME, pa.types.is_int64)
        if TIME in table.column_names
        else ("timestamp", pa.types.is_floating)
    )
    column = table[name]
    values = (
        column.to_numpy() if kind(column.type) and not column.null_count else np.array([np.nan])
    )
    if not np.all(np.abs(values.astype(np.float64)) < _FARTHEST * (1 if name == TIME else 1e-9)):
        raise CorruptError(
            f"the column {name} has values that are no instants", where=where, fix="copy it again"
        )
    return values if name == TIME else np.rint(values.astype(np.float64) * 1e9).astype(np.int64)


def _chosen(streams: Mapping[str, str], wanted: str | None, where: str) -> tuple[str, str]:
    if wanted is not None:
        if wanted not in streams:
            raise UnknownNameError.of("camera", wanted, streams, where=where)
        return wanted, streams[wanted]
    if len(streams) != 1:
        message = (
            f"{len(streams)} cameras: {', '.join(streams)}"
            if streams
            else "a LeRobot data set without a camera"
        )
        raise InputError(
            message,
            where=where,
            fix="choose one: --topic NAME" if streams else "there is no film in it",
        )
    return next(iter(streams.items()))


def _episode(folder: Path, wanted: int | None) -> dict[str, Any]:
    files = tables(folder / "meta" / "episodes")
    if not files:
        raise CorruptError(
            "there is no table of episodes",
            where=str(folder / "meta" / "episodes"),
            fix="copy it again",
        )
    rows: list[dict[str, Any]] = []
    for path in files:
        names = [
            name for name in _reading(path, pq.read_schema).names if not name.startswith("stats/")
        ]
        rows += read(path, names).to_pylist()
    if wanted is None and len(rows) != 1:
        raise InputError(
            f"{len(rows)} episodes, each a recording of its own",
            where=str(folder),
            fix=f"choose one: --episode 0 to {len(rows) - 1}",
        )
    for row in rows:
        if wanted in (None, row.get("episode_index")):
            return row
    raise NotFoundError(
        f"there is no episode {wanted}", where=str(folder), fix=f"there are {len(rows)}, from 0 on"
    )


def tables(folder: Path) -> list[Path]:
    """Lists the tables of a part of a data set, in order; not what an operating system put beside
    them."""
    return sorted(path for path in folder.glob("*/*.parquet") if not is_beside(path.name))


def read(path: Path, columns: list[str]) -> pa.Table:
    """Columns of a table of a data set.

    Raises:
        NotFoundError: it is missing.
        CorruptError: it cannot be read, or lacks one of them.
        LimitError: it states more than is held in memory.
    """
    return _reading(path, partial(read_parquet, columns=columns))


def _reading(path: Path, how: Callable[[Path], T]) -> T:
    try:
        return how(path)
    except FileNotFoundError:
        raise NotFoundError(
            "a table of the data set is missing", where=str(path), fix="copy it again"
        ) from None
    except (pa.ArrowException, OSError) as error:
        raise CorruptError(
            f"a table cannot be read: {error}", where=str(path), fix="copy it again"
        ) from None


def _table(path: Path, columns: list[str], episode: int) -> pa.Table:
    table = read(path, [*columns, "episode_index", "frame_index"])
    table = table.filter(pc.field("episode_index") == episode).sort_by("frame_index")
    if not table.num_rows:
        raise CorruptError(
            f"the table has no frame of episode {episode}", where=str(path), fix="copy it again"
        )
    return table


def _counted_finding() -> Finding:
    return Finding.of(
        "stamps-synthetic",
        "LeRobot counts a frame's time as its number / fps: gaps and jitter of the camera are not "
        "in the data set",
        fix="where the original recording exists, ingest that",
    )
