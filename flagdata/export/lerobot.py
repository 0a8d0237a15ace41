"""LeRobot data sets, version 3.0: an episode a row of the catalog, read by LeRobot's own reader and
tools.

LeRobot has one frame rate a data set and takes frame k of an episode to be shown at k / rate. The
exact instants stand beside it as the feature `flagdata.time`, and a film whose instants differ from
k / rate by half a period or more is refused. Wind is what the anemometer's newest mean over 1 s
said at that instant, with its σ and its age; ground truth, clock model and identity stand in the
table of episodes.

Episodes of one side follow one another, and the description states which these are.

Source: lerobot 0.6, `lerobot.datasets` (its code: the documentation names another file for tasks).
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any, ClassVar, Literal

import av
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from PIL import Image

from flagdata.core.arrays import AnyArray, Float32Array, FloatArray, UInt8Array
from flagdata.core.files.regular_files import LEROBOT_LABEL, LEROBOT_OWN
from flagdata.core.scheduling import kept_scheduling
from flagdata.core.schema import Kind
from flagdata.errors import InputError, UsageError
from flagdata.export.export_source import FILMED, Entry, ExportRows, label_units
from flagdata.timebase import NANOSECONDS

VERSION = "v3.0"
CAMERA = "observation.images.camera"
TASK = "cloth in the wind"
FILE = "chunk-{chunk_index:03d}/file-{file_index:03d}"
_VIDEO_BYTES, _DATA_BYTES = (
    200 << 20,
    100 << 20,
)  # a file is closed when it is larger; LeRobot's own defaults
_CHUNK = 1000  # files a folder
_NEAR_WHOLE = 1e-3  # relative; a rate this near to a whole number is that number
_NUMBERS: dict[str, tuple[str, str]] = {
    "timestamp": ("float32", "s from the episode's start, frame_index / fps"),
    "frame_index": ("int64", ""),
    "episode_index": ("int64", ""),
    "index": ("int64", ""),
    "task_index": ("int64", ""),
    "flagdata.time": ("int64", "instant of the frame on the common clock, UTC ns"),
    "flagdata.device_time": ("int64", "instant of the frame on the camera's own clock, UTC ns"),
    "observation.wind_speed": (
        "float32",
        "newest mean over 1 s of the wind speed, m/s; NaN where there is none",
    ),
    "observation.wind_sigma": ("float32", "standard uncertainty of that mean, m/s"),
    "observation.wind_direction": (
        "float32",
        "its direction, rad, from, clockwise from true north",
    ),
    "observation.wind_age": ("float32", "age of that mean at the frame, s"),
}
"""Feature → type and meaning."""


@dataclass(frozen=True, kw_only=True)
class LeRobot:
    """Files meta/…, data/…/*.parquet and, of films, videos/…/*.mp4.

    Attributes:
        frames: "av1" for films as LeRobot writes them; "png" for exact pictures in the table.
    """

    kinds: ClassVar[frozenset[Kind]] = FILMED

    frames: Literal["av1", "png"] = "av1"

    def __post_init__(self) -> None:
        if self.frames not in ("av1", "png"):
            raise UsageError(
                f"frames {self.frames!r} in LeRobot", where="--frames", fix="choose av1 or png"
            )

    def write(
        self, source: ExportRows, folder: Path, advance: Callable[[int], None]
    ) -> Mapping[str, Any]:
        rate = common_rate([row for row in source.rows["rate"].to_pylist() if row is not None])
        with ExitStack() as stack:
            data = stack.enter_context(_Data(folder, self.frames))
            film = stack.enter_context(_Films(folder, rate)) if self.frames == "av1" else None
            data_set = _Made(rate=rate, split_by=source.split_by)
            for entry in source.entries(source.by_side()):
                if not entry.count:
                    raise InputError(
                        "a record without frames makes no episode",
                        where=entry.key,
                        fix="leave it out by --where",
                    )
                data_set.add(entry, source.side_of(entry.row), data, film)
                advance(1)
        data_set.write(folder, self.frames)
        return {
            "episodes": len(data_set.episodes),
            "frames": data_set.total,
            "fps": float(rate),
            "units": label_units(),
            "worst_timing": data_set.worst,
            "video": "AV1, lossy" if self.frames == "av1" else "PNG, exact",
        }


def common_rate(rates: Sequence[float]) -> Fraction:
    """Finds the one frame rate of a data set [Hz]: the median, a whole number where it is near one.

    Raises:
        InputError: there is none.
    """
    if not rates:
        raise InputError(
            "no film states a frame rate",
            where="--where",
            fix="select films of two frames and more",
        )
    middle = float(np.median(rates))
    nearest = round(middle)
    is_whole = nearest > 0 and abs(middle - nearest) <= _NEAR_WHOLE * middle
    return Fraction(nearest) if is_whole else Fraction(middle).limit_denominator(1001)


@dataclass(kw_only=True)
class _Made:
    """What has been written so far.

    Attributes:
        split_by: how sides were decided, see `ExportRows`.
        sides: of each episode; `None` where it is on none.
    """

    rate: Fraction
    split_by: Mapping[str, Any] | None
    sides: list[str | None] = field(default_factory=list)
    episodes: list[dict[str, Any]] = field(default_factory=list)
    total: int = 0
    worst: float = 0.0
    size: tuple[int, int] | None = None
    tallies: dict[str, list[_FeatureSums]] = field(default_factory=dict)

    def add(self, entry: Entry, side: str | None, data: _Data, film: _Films | None) -> None:
        """Write an episode."""
        times = entry.frame_times
        number, count = len(self.episodes), entry.count
        self.worst = max(self.worst, self._farthest_from_grid(entry))
        columns: dict[str, AnyArray] = {
            "timestamp": (np.arange(count) / float(self.rate)).astype(np.float32),
            "frame_index": np.arange(count),
            "episode_index": np.full(count, number),
            "index": np.arange(self.total, self.total + count),
            "task_index": np.zeros(count, np.int64),
            "flagdata.time": times,
            "flagdata.device_time": entry.device_frame_times,
            **_wind(entry),
        }
        file_columns: dict[str, Any] = {}
        pictures = _FeatureSums.empty()
        if film is not None:
            file_columns = film.episode(self._pictures_of_entry(entry, pictures))
            where = data.episode(columns, None)
        else:
            where = data.episode(
                columns, [_png(image) for image in self._pictures_of_entry(entry, pictures)]
            )
        tallies = {name: _FeatureSums.of(columns[name]) for name in _NUMBERS} | {CAMERA: pictures}
        for name, tally in tallies.items():
            self.tallies.setdefault(name, []).append(tally)
        label = entry.label()
        self.sides.append(side)
        self.episodes.append(
            {
                "episode_index": number,
                "tasks": [TASK],
                "length": count,
                **where,
                "dataset_from_index": self.total,
                "dataset_to_index": self.total + count,
                **file_columns,
                "meta/episodes/chunk_index": 0,
                "meta/episodes/file_index": 0,
                "flagdata/artifact": entry.key,
                "flagdata/wind": label["wind"],
                "flagdata/wind_sigma": label["wind_sigma"],
                "flagdata/clock_sigma": label["clock_sigma"],
                LEROBOT_LABEL: json.dumps(
                    label, sort_keys=True, allow_nan=False, ensure_ascii=False
                ),
                **{
                    f"stats/{n}/{k}": v
                    for n, tally in tallies.items()
                    for k, v in tally.stats(n == CAMERA).items()
                },
            }
        )
        self.total += count

    def _farthest_from_grid(self, entry: Entry) -> float:
        """Computes how far a frame's instant is from k / rate at most [s].

        Raises:
            InputError: half a period, or more.
        """
        times = (entry.frame_times - entry.frame_times[0]) / NANOSECONDS
        farthest = float(np.abs(times - np.arange(len(times)) / float(self.rate)).max())
        if farthest >= 0.5 / float(self.rate):
            raise InputError(
                f"frames lie up to {farthest:.3f} s from a steady {float(self.rate):g} Hz, which "
                "LeRobot takes them to "
                "have",
                where=entry.key,
                fix="export films of one rate without gaps (clips have none), or to mcap, which "
                "keeps each instant",
            )
        return farthest

    def _pictures_of_entry(self, entry: Entry, tally: _FeatureSums) -> Iterator[UInt8Array]:
        """Yields the pictures of an entry one by one, (height, width) uint8, counted.

        Raises:
            InputError: their size is not that of the first entry.
        """
        for images in entry.images():
            self.size = self.size or images.shape[1:]
            if images.shape[1:] != self.size:
                raise InputError(
                    f"frames of {images.shape[2]} × {images.shape[1]} px beside {self.size[1]} × "
                    f"{self.size[0]}",
                    where=entry.key,
                    fix="a data set of LeRobot has one size: select films of one by --where",
                )
            tally.take(images / 255.0)
            yield from images

    def _splits(self) -> dict[str, str]:
        """Returns the episodes of each side, "first:end"; where none is on a side, all as "train",
        as LeRobot does."""
        ends = {side: end for end, side in enumerate(self.sides, start=1) if side is not None}
        if not ends:
            return {"train": f"0:{len(self.sides)}"}
        return {side: f"{end - self.sides.count(side)}:{end}" for side, end in ends.items()}

    def write(self, folder: Path, frames: str) -> None:
        """Writes the tables and documents of meta/."""
        meta = folder / "meta"
        (meta / "episodes" / "chunk-000").mkdir(parents=True)
        table = pa.Table.from_pylist(self.episodes)
        pq.write_table(
            table, meta / "episodes" / "chunk-000" / "file-000.parquet", compression="snappy"
        )
        pq.write_table(_tasks(), meta / "tasks.parquet")
        stats = {
            name: _FeatureSums.joined(parts).stats(name == CAMERA)
            for name, parts in self.tallies.items()
        }
        _json(meta / "stats.json", stats)
        height, width = self.size or (0, 0)
        features: dict[str, Any] = {
            CAMERA: {
                "dtype": "video" if frames == "av1" else "image",
                "shape": [height, width, 3],
                "names": ["height", "width", "channels"],
            },
            **{
                name: {
                    "dtype": kind,
                    "shape": [1],
                    "names": None,
                    **({"info": {"about": about}} if about else {}),
                }
                for name, (kind, about) in _NUMBERS.items()
            },
        }
        if frames == "av1":
            features[CAMERA]["info"] = {
                "video.height": height,
                "video.width": width,
                "video.codec": "av1",
                "video.pix_fmt": "yuv420p",
                "video.is_depth_map": False,
                "video.fps": int(self.rate),
                "video.channels": 3,
                "has_audio": False,
            }
        fps = int(self.rate) if self.rate.denominator == 1 else float(self.rate)
        _json(
            meta / "info.json",
            {
                "codebase_version": VERSION,
                "robot_type": None,
                "total_episodes": len(self.episodes),
                "total_frames": self.total,
                "total_tasks": 1,
                "chunks_size": _CHUNK,
                "fps": fps,
                "data_files_size_in_mb": _DATA_BYTES >> 20,
                "video_files_size_in_mb": _VIDEO_BYTES >> 20,
                "splits": self._splits(),
                LEROBOT_OWN: {"split_by": self.split_by},
                "data_path": f"data/{FILE}.parquet",
                "video_path": f"videos/{{video_key}}/{FILE}.mp4" if frames == "av1" else None,
                "features": features,
            },
        )


@dataclass(kw_only=True)
class _FeatureSums:
    """Sums of the values of a feature that are numbers; of pictures of all their pixels, 0 to 1."""

    count: int
    low: float
    high: float
    total: float
    squares: float

    @classmethod
    def empty(cls) -> _FeatureSums:
        return cls(count=0, low=np.inf, high=-np.inf, total=0.0, squares=0.0)

    @classmethod
    def of(cls, values: AnyArray) -> _FeatureSums:
        tally = cls.empty()
        tally.take(values[np.isfinite(values)].astype(np.float64))
        return tally

    @classmethod
    def joined(cls, parts: Sequence[_FeatureSums]) -> _FeatureSums:
        return cls(
            count=sum(part.count for part in parts),
            low=min(part.low for part in parts),
            high=max(part.high for part in parts),
            total=sum(part.total for part in parts),
            squares=sum(part.squares for part in parts),
        )

    def take(self, values: FloatArray) -> None:
        if values.size:
            self.count += values.size
            self.low, self.high = (
                min(self.low, float(values.min())),
                max(self.high, float(values.max())),
            )
            self.total += float(values.sum())
            self.squares += float((values**2).sum())

    def stats(self, pictures: bool) -> dict[str, Any]:
        """As LeRobot has them: of pictures (3, 1, 1); a feature without a number has a count of
        0."""
        count = max(self.count, 1)
        mean = self.total / count
        deviation = max(self.squares / count - mean**2, 0.0) ** 0.5
        low, high = (self.low, self.high) if self.count else (0.0, 0.0)
        values = {"min": low, "max": high, "mean": mean, "std": deviation}
        shaped = {name: [[[v]]] * 3 if pictures else [v] for name, v in values.items()}
        return {**shaped, "count": [self.count]}


class _Data:
    """Writes the frames' table, a row group an episode; a context manager."""

    def __init__(self, folder: Path, frames: str) -> None:
        self._folder = folder / "data"
        self._open = ExitStack()
        self._writer: pq.ParquetWriter | None = None
        self._number = -1
        self._written = 0
        fields = [pa.field(name, pa.type_for_alias(kind)) for name, (kind, _) in _NUMBERS.items()]
        if frames == "png":
            fields.insert(
                0, pa.field(CAMERA, pa.struct([("bytes", pa.binary()), ("path", pa.string())]))
            )
        self._schema = pa.schema(fields)

    def __enter__(self) -> _Data:
        return self

    def __exit__(self, *error: object) -> None:
        self._open.close()

    def episode(
        self, columns: Mapping[str, AnyArray], pictures: Sequence[bytes] | None
    ) -> dict[str, int]:
        """Appends an episode, and says in which file it is."""
        if self._writer is None or self._written >= _DATA_BYTES:
            self._open.close()
            self._number += 1
            self._written = 0
            path = _path(self._folder, self._number, "parquet")
            self._writer = self._open.enter_context(
                pq.ParquetWriter(path, self._schema, compression="snappy")
            )
        values: dict[str, Any] = {name: columns[name] for name in _NUMBERS}
        if pictures is not None:
            values[CAMERA] = [{"bytes": picture, "path": None} for picture in pictures]
        table = pa.table(
            [pa.array(values[field.name], field.type) for field in self._schema],
            schema=self._schema,
        )
        self._writer.write_table(table, row_group_size=table.num_rows)
        self._written += table.nbytes
        return {
            "data/chunk_index": self._number // _CHUNK,
            "data/file_index": self._number % _CHUNK,
        }


class _Films:
    """Writes films of many episodes, one behind the other; a context manager."""

    def __init__(self, folder: Path, rate: Fraction) -> None:
        self._folder = folder / "videos" / CAMERA
        self._rate = rate
        self._open = ExitStack()
        self._writing: tuple[Any, Any] | None = None
        self._size = 0
        self._number = -1
        self._frames = 0

    def __enter__(self) -> _Films:
        return self

    def __exit__(self, *error: object) -> None:
        if error[0] is None:
            self._finish()
        self._open.close()

    def episode(self, images: Iterator[UInt8Array]) -> dict[str, Any]:
        """Appends the pictures of an episode, and says where they are."""
        begin = None
        for image in images:
            container, stream = self._writing = self._writing or self._next(image)
            begin = self._frames if begin is None else begin
            frame = av.VideoFrame.from_ndarray(
                np.repeat(image[..., None], 3, axis=2), format="rgb24"
            )
            frame = frame.reformat(format="yuv420p")
            frame.pts, frame.time_base = self._frames, 1 / self._rate
            with kept_scheduling():
                packets = stream.encode(frame)
            self._size += sum(packet.size for packet in packets)
            container.mux(packets)
            self._frames += 1
        chunk, file = divmod(self._number, _CHUNK)
        file_columns = {
            "chunk_index": chunk,
            "file_index": file,
            "from_timestamp": float((begin or 0) / self._rate),
            "to_timestamp": float(self._frames / self._rate),
        }
        if self._size >= _VIDEO_BYTES:
            self._finish()
        return {f"videos/{CAMERA}/{name}": value for name, value in file_columns.items()}

    def _next(self, image: UInt8Array) -> tuple[Any, Any]:
        """Opens container and stream of a new file for pictures like this one."""
        height, width = image.shape
        if height % 2 or width % 2:
            raise InputError(
                f"AV1 cannot hold pictures of {width} × {height} px",
                where="--frames",
                fix="export with --frames png",
            )
        self._number += 1
        self._frames = 0
        self._size = 0
        container = self._open.enter_context(
            av.open(str(_path(self._folder, self._number, "mp4")), "w")
        )
        options = {"crf": "30", "g": "2", "preset": "8", "svtav1-params": "lp=1"}
        stream: Any = container.add_stream("libsvtav1", rate=self._rate, options=options)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        stream.codec_context.time_base = 1 / self._rate
        return container, stream

    def _finish(self) -> None:
        if self._writing is not None:
            container, stream = self._writing
            with kept_scheduling():
                container.mux(stream.encode(None))
            self._open.close()
            self._writing = None


def _path(folder: Path, number: int, suffix: str) -> Path:
    path = (
        folder / f"{FILE.format(chunk_index=number // _CHUNK, file_index=number % _CHUNK)}.{suffix}"
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def _wind(entry: Entry) -> dict[str, Float32Array]:
    """Returns the newest mean over 1 s at each frame: speed, σ and direction, and how old it is."""
    means, times = entry.record.wind_1hz(), entry.frame_times
    names = ("speed", "sigma", "direction")
    if means is None:
        return {
            f"observation.wind_{name}": np.full(len(times), np.nan, np.float32)
            for name in (*names, "age")
        }
    newest = np.searchsorted(means.time, times, side="right") - 1
    is_known = newest >= 0
    columns = {name: np.where(is_known, getattr(means, name)[newest], np.nan) for name in names}
    columns["age"] = np.where(is_known, (times - means.time[newest]) / NANOSECONDS, np.nan)
    return {
        f"observation.wind_{name}": values.astype(np.float32) for name, values in columns.items()
    }


def _png(image: UInt8Array) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(image).convert("RGB").save(buffer, "PNG")
    return buffer.getvalue()


def _tasks() -> pa.Table:
    """Builds the table of tasks, whose index is the text of a task, as pandas stores it."""
    columns = [
        {
            "name": name,
            "field_name": name,
            "pandas_type": kind,
            "numpy_type": store,
            "metadata": None,
        }
        for name, kind, store in (("task_index", "int64", "int64"), ("task", "unicode", "object"))
    ]
    stored = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": columns,
        "pandas_version": "2.0.0",
    }
    schema = pa.schema(
        [("task_index", pa.int64()), ("task", pa.string())], metadata={"pandas": json.dumps(stored)}
    )
    return pa.table([[0], [TASK]], schema=schema)


def _json(path: Path, content: Any) -> None:
    path.write_text(
        json.dumps(content, indent=4, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8"
    )
