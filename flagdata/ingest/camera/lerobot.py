"""One episode of a LeRobot data set (version 3.0) as a camera's source: a film or pictures in the table of frames.

Frames have the instants of the feature `flagdata.time` where the data set has it, as those that flagdata exported;
else they count from the episode's start by their column `timestamp`, and the user gives the start.

Source: lerobot 0.6, `lerobot.datasets`.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from fractions import Fraction
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import av
import av.error
import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from PIL import Image

from flagdata.documents import read_json
from flagdata.errors import CorruptError, InputError, LimitError, NotFoundError, TimeError, UnknownNameError
from flagdata.files import LEROBOT_INFO
from flagdata.findings import Finding, Severity
from flagdata.ingest.camera.geometry import Orientation
from flagdata.ingest.camera.luma import luma_of_frame, luma_of_image
from flagdata.ingest.camera.options import CameraOptions
from flagdata.ingest.camera.source import Picture, SourceFacts
from flagdata.ingest.camera.stamps import survey

VERSION = "v3.0"
TIME = "flagdata.time"
_NANOSECOND = Fraction(1, 1_000_000_000)
_BROKEN = (OSError, ValueError, SyntaxError, EOFError, Image.DecompressionBombError)
_PAST_END = 0.25  # frame periods before the episode's end up to which a frame of its film counts


def described(folder: Path) -> Mapping[str, Any]:
    """What meta/info.json states of a data set.

    Raises:
        CorruptError: it cannot be read, or lacks what each has.
        InputError: another version, or another way of storing it.
    """
    where = folder / LEROBOT_INFO
    info = read_json(where, noun="LeRobot's description")
    version, stored = info.get("codebase_version"), info.get("storage_format", "parquet")
    if version != VERSION:
        fix = "convert it by LeRobot's own script, convert_dataset_v21_to_v30"
        raise InputError(f"a LeRobot data set of version {version}, not {VERSION}", where=str(where), fix=fix)
    if stored != "parquet":
        fix = "write it as Parquet and MP4 by LeRobot's own tools"
        raise InputError(f"a LeRobot data set stored as {stored}", where=str(where), fix=fix)
    if not isinstance(info.get("features"), dict) or not isinstance(info.get("data_path"), str):
        raise CorruptError("LeRobot's description lacks its features or paths", where=str(where), fix="copy it again")
    return info


def cameras(info: Mapping[str, Any]) -> dict[str, str]:
    """Feature → "video" or "image", of those that are pictures."""
    kinds = {name: str(one.get("dtype")) for name, one in info["features"].items() if isinstance(one, Mapping)}
    return {name: kind for name, kind in kinds.items() if kind in ("video", "image")}


class EpisodeSource:
    """The pictures of one camera in one episode. See `flagdata.ingest.camera.source.Source`.

    Raises:
        InputError: several episodes or cameras and none is named, or none of its pictures can be decoded.
        NotFoundError: no such episode, or one of its files is missing.
        UnknownNameError: no such camera.
        TimeError: a rate for frames that have stamps.
        CorruptError: its tables cannot be read.
    """

    def __init__(self, folder: Path, options: CameraOptions) -> None:
        self._where = str(folder)
        info = described(folder)
        self._camera, self._kind = _chosen(cameras(info), options.topic, self._where)
        if options.sequence_fps is not None:
            raise TimeError("its frames have stamps", where=self._where, fix="leave out --sequence-fps")
        row = _episode(folder, options.episode)
        data = folder / info["data_path"].format(chunk_index=row["data/chunk_index"], file_index=row["data/file_index"])
        columns = ["timestamp", *([TIME] if TIME in info["features"] else [])]
        columns += [self._camera] if self._kind == "image" else []
        table = _table(data, columns, int(row["episode_index"]))
        if table.num_rows > options.limits.frames:
            raise LimitError(
                f"{table.num_rows} frames are beyond the limit of {options.limits.frames}", where=self._where,
                fix="raise the limit",
            )  # fmt: skip
        seconds = np.asarray(table["timestamp"].to_numpy(), dtype=np.float64)
        self._stamped = TIME in columns
        self._stamps = table[TIME].to_numpy() if self._stamped else np.rint(seconds * 1e9).astype(np.int64)
        self._limits = options.limits
        self._folder = folder
        self._pictures = table[self._camera] if self._kind == "image" else None
        self._film: tuple[Path, float, float] | None = None
        if self._kind == "video":
            place = {part: row[f"videos/{self._camera}/{part}"] for part in ("chunk_index", "file_index")}
            path = folder / str(info["video_path"]).format(video_key=self._camera, **place)
            begin, end = (float(row[f"videos/{self._camera}/{part}_timestamp"]) for part in ("from", "to"))
            self._film = (path, begin, end)
        self._broken = 0
        timing = survey(
            np.sort(self._stamps), tick=_NANOSECOND, missing=0, fallback_rate=_rate(info), where=self._where
        )
        first = next(self.samples(1, 1, 1), None)
        if first is None:
            raise InputError("no picture of the episode can be decoded", where=self._where, fix="copy it again")
        luma = first[0].luma()
        findings = [] if self._stamped else [_counted()]
        self.facts = SourceFacts(
            container="lerobot", codec=self._kind, pixel_format="", width=luma.image.width, height=luma.image.height,
            aspect=Fraction(1), orientation=Orientation(), interlaced=False, timing=timing, metadata={}, recorded=None,
            sequence=False, findings=tuple(findings), stamped=timing.origin if self._stamped else None,
        )  # fmt: skip

    def pictures(self) -> Iterator[Picture]:
        shown = 0
        for picture in self._decoded():
            shown += 1
            yield picture
        self._broken = len(self._stamps) - shown

    def samples(self, runs: int, count: int, stride: int) -> Iterator[list[Picture]]:
        length = len(self._stamps)
        first = 0
        for run in range(runs):
            start = max(first, length * run // runs)
            first = min(start + count * stride, length)
            pictures = list(islice(self._decoded(start), 0, count * stride, stride))
            if pictures:
                yield pictures

    def damage(self) -> list[Finding]:
        if not self._broken:
            return []
        what = f"{self._broken} of {len(self._stamps)} frames cannot be decoded and were left out"
        return [Finding(kind="corrupt-frames", severity=Severity.ERROR, count=self._broken, what=what)]

    def close(self) -> None:
        """Files are open only while pictures are read."""

    def _decoded(self, start: int = 0) -> Iterator[Picture]:
        if self._film is not None:
            yield from self._of_film(start)
            return
        pictures = self._pictures if self._pictures is not None else pa.chunked_array([], pa.binary())
        for stamp, cell in zip(self._stamps[start:].tolist(), pictures.slice(start), strict=True):
            held = cell.as_py() or {}
            try:
                image = Image.open(io.BytesIO(held["bytes"]) if held.get("bytes") else self._folder / held["path"])
                if image.width * image.height > self._limits.frame_pixels:
                    raise LimitError("a picture beyond the limit of pixels", where=self._where, fix="raise the limit")
                image.load()
            except (*_BROKEN, KeyError, TypeError):
                continue
            yield Picture(stamp=stamp, luma=partial(luma_of_image, image))

    def _of_film(self, start: int) -> Iterator[Picture]:
        """Frames of the episode's part of its film: the k-th belongs to the k-th row."""
        path, begin, end = self._film or (Path(), 0.0, 0.0)
        if not path.is_file():
            raise NotFoundError("the film of the episode is missing", where=str(path), fix="copy the data set again")
        period = (end - begin) / max(len(self._stamps), 1)
        wanted = begin + start * period
        try:
            with av.open(f"file:{path.resolve()}") as container:
                stream = container.streams.video[0]
                stream.codec_context.thread_count = 1
                container.seek(int((wanted - period) * av.time_base) if wanted > period else 0)
                for frame in container.decode(stream):
                    at = frame.time
                    if at is None or at < wanted - _PAST_END * period:
                        continue
                    number = round((at - begin) / period)
                    if number >= len(self._stamps):
                        return
                    luma = partial(luma_of_frame, frame, codec=stream.codec_context.name)
                    yield Picture(stamp=int(self._stamps[number]), luma=luma)
        except (av.error.FFmpegError, IndexError):
            return


def _chosen(found: Mapping[str, str], wanted: str | None, where: str) -> tuple[str, str]:
    if wanted is not None:
        if wanted not in found:
            raise UnknownNameError.of("camera", wanted, found, where=where)
        return wanted, found[wanted]
    if len(found) != 1:
        what = f"{len(found)} cameras: {', '.join(found)}" if found else "a LeRobot data set without a camera"
        raise InputError(what, where=where, fix="choose one: --topic NAME" if found else "there is no film in it")
    return next(iter(found.items()))


def _episode(folder: Path, wanted: int | None) -> dict[str, Any]:
    files = sorted((folder / "meta" / "episodes").glob("*/*.parquet"))
    if not files:
        raise CorruptError("no table of episodes", where=str(folder / "meta" / "episodes"), fix="copy it again")
    rows: list[dict[str, Any]] = []
    for path in files:
        try:
            names = [name for name in pq.read_schema(path).names if not name.startswith("stats/")]
            rows += pq.read_table(path, columns=names).to_pylist()
        except (pa.ArrowException, OSError) as error:
            raise CorruptError(f"a table cannot be read: {error}", where=str(path), fix="copy it again") from None
    if wanted is None and len(rows) != 1:
        raise InputError(
            f"{len(rows)} episodes, each a recording of its own", where=str(folder),
            fix=f"choose one: --episode 0 to {len(rows) - 1}",
        )  # fmt: skip
    for row in rows:
        if wanted in (None, row["episode_index"]):
            return row
    raise NotFoundError(f"there is no episode {wanted}", where=str(folder), fix=f"there are {len(rows)}, from 0 on")


def _table(path: Path, columns: list[str], episode: int) -> pa.Table:
    try:
        table = pq.read_table(path, columns=[*columns, "episode_index", "frame_index"])
    except FileNotFoundError:
        raise NotFoundError("the table of the episode is missing", where=str(path), fix="copy it again") from None
    except (pa.ArrowException, OSError) as error:
        raise CorruptError(f"a table cannot be read: {error}", where=str(path), fix="copy it again") from None
    table = table.filter(pc.field("episode_index") == episode).sort_by("frame_index")
    if not table.num_rows:
        raise CorruptError(f"the table has no frame of episode {episode}", where=str(path), fix="copy it again")
    return table


def _rate(info: Mapping[str, Any]) -> Fraction:
    fps = info.get("fps")
    return Fraction(str(fps)) if isinstance(fps, int | float) and fps > 0 else Fraction(1)


def _counted() -> Finding:
    return Finding(
        kind="stamps-synthetic", severity=Severity.WARNING,
        what="LeRobot counts a frame's time as its number / fps: gaps and jitter of the camera are not in the data set",
        fix="where the original recording exists, ingest that",
    )  # fmt: skip
