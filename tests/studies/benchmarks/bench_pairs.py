"""Clips a second out of a lake, decoded and from the decoded cache, beside WebDataset on the same
pictures.

Clips of 30 gray frames of 300×300, JPEG. The lake is read in random order, WebDataset, which cannot
do otherwise, in the order of its shards. Every way must give the same pixels.
"""

from __future__ import annotations

import io
import os
import tarfile
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import simplejpeg
import torch
import webdataset
from scipy.ndimage import gaussian_filter

import flagdata
from flagdata.core.rng import stream
from flagdata.core.schema import CLIP_FRAMES, FRAME_RATE, FRAME_SIZE, Kind
from flagdata.dataset import DecodedCache, Pairs, clip_rows
from flagdata.lake import Artifact, Lake
from flagdata.record import Record, RecordWriter
from flagdata.record.signals import Sensor, WindSeries
from flagdata.timebase import NANOSECONDS

START = 1_777_636_800 * NANOSECONDS  # 2026-05-01T12:00:00Z
CLIPS = 120
SHARDS = 4
SECONDS = 4.0  # each way is measured for at least this long
ROUNDS = (
    3  # interleaved, the best of each way is kept: other work on the machine only ever slows down
)
WORKERS = 2
BATCH = 10
# clips/s, lowest and highest, of prototypes measured on a two-core machine before the lake was
# built.
TO_BEAT = {"record": (132, 184), "cache": (427, 1121), "webdataset": (132, 137)}
TO_BEAT_WORKERS = {"record": (86, 92), "cache": (152, 226), "webdataset": (77, 82)}


def pictures(seed: int, count: int) -> Iterator[np.ndarray]:
    """Frames of a waving, textured cloth before a still background: about what a filmed flag costs
    in JPEG."""
    generator = stream(seed, "bench", "pictures")
    size = FRAME_SIZE
    background = gaussian_filter(generator.normal(size=(size, size)), 2) * 120 + 150
    cloth = gaussian_filter(generator.normal(size=(size, 2 * size)), 1) * 60 + 90
    y, x = np.mgrid[0:size, 0:size]
    for k in range(count):
        phase = 2 * np.pi * (x / 80 - k / 9)
        column = (x + 12 * np.sin(phase)).astype(int) % (2 * size)
        row = (y + 9 * np.cos(phase)).astype(int) % size
        inside = (
            (y > 60 + 14 * np.sin(phase)) & (y < 230 + 14 * np.sin(phase)) & (x > 30) & (x < 270)
        )
        image = np.where(inside, cloth[row, column], background) + generator.normal(
            size=(size, size)
        )
        yield np.clip(image, 0, 255).astype(np.uint8)


def make_lake(folder: Path, seed: int) -> Lake:
    """A lake of one recording of `CLIPS` clips."""
    lake = Lake.create(folder / "lake")
    make_recording(lake, seed, clips=CLIPS)
    return lake


def make_recording(lake: Lake, seed: int, *, clips: int) -> None:
    """Commit a recording of so many clips, with a minute of wind before it, and the clips."""
    period = round(NANOSECONDS / FRAME_RATE)
    seconds = 61 + int(clips * CLIP_FRAMES / FRAME_RATE)
    wind = WindSeries(
        time=START - 60 * NANOSECONDS + np.arange(seconds, dtype=np.int64) * NANOSECONDS,
        channels={"wind_speed": np.full(seconds, 5.0)},
        flags=np.zeros(seconds, dtype=np.uint16),
        sensor=Sensor(name="bench", accuracy=0.1),
    )
    with lake.transaction("benchmark recording") as transaction:
        path = transaction.staging(".mcap")
        with RecordWriter(path, metadata={}) as writer:
            writer.wind(wind)
            for index, image in enumerate(pictures(seed, clips * CLIP_FRAMES)):
                instant = START + index * period
                writer.frame(log_time=instant, publish_time=instant, timestamp=instant, image=image)
        recording = Artifact(
            kind=Kind.RECORDING,
            name="bench",
            object=transaction.put(path),
            session="bench",
            clock_sigma=0.1,
            rate=FRAME_RATE,
        )
        transaction.add(recording)
        for clip in clip_rows(Record.open(lake.object_path(str(recording.object))), recording):
            transaction.add(clip)


def make_shards(folder: Path, lake: Lake, pairs: Pairs) -> list[str]:
    """The same JPEG bytes as WebDataset shards, one sample a clip, one member a frame."""
    folder.mkdir()
    record = Record.open(lake.object_path(str(pairs.table.objects[0])))
    shards = [str(folder / f"{number}.tar") for number in range(SHARDS)]
    for number, shard in enumerate(shards):
        with tarfile.open(shard, "w") as archive:
            for index in range(number * len(pairs) // SHARDS, (number + 1) * len(pairs) // SHARDS):
                first = int(pairs.table.frame_first[index])
                for offset in range(CLIP_FRAMES):
                    data = record.jpeg(first + offset)
                    member = tarfile.TarInfo(f"{index:06d}.{offset:02d}.jpg")
                    member.size = len(data)
                    archive.addfile(member, io.BytesIO(data))
    return shards


def decode_sample(sample: dict[str, Any]) -> torch.Tensor:
    frames = [
        simplejpeg.decode_jpeg(sample[f"{k:02d}.jpg"], colorspace="GRAY")[..., 0]
        for k in range(CLIP_FRAMES)
    ]
    return torch.from_numpy(np.stack(frames)).unsqueeze(0)


def shards_reader(shards: list[str]) -> webdataset.WebDataset:
    return webdataset.WebDataset(
        shards, shardshuffle=False, nodesplitter=None, empty_check=False
    ).map(decode_sample)


def stack(clips: list[torch.Tensor]) -> torch.Tensor:
    return torch.stack(clips)


def in_random_order(pairs: Pairs, epoch: int) -> Iterator[torch.Tensor]:
    for index in stream(0, "bench", "order", epoch).permutation(len(pairs)).tolist():
        yield pairs[index].clip


def rate(epoch: Callable[[int], Iterable[int]]) -> tuple[float, float]:
    """Clips a second, and clips a second of this process's CPU time, over whole epochs, after the
    first clip or batch has been seen (workers have then started). The second is fair on a busy
    machine, but sees no worker processes."""
    clips, number, began, cpu = 0, 0, None, 0.0
    while True:
        for count in epoch(number):
            if began is None:
                began, cpu = time.perf_counter(), time.process_time()
                continue
            clips += count
        number += 1
        elapsed = time.perf_counter() - (began or 0)
        if elapsed >= SECONDS:
            return clips / elapsed, clips / (time.process_time() - cpu)


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Clips a second by each way, and whether their pixels agree."""
    del out  # no pictures
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with tempfile.TemporaryDirectory() as name:
            return measure(Path(name), seed)
    finally:
        torch.set_num_threads(threads)


def measure(folder: Path, seed: int) -> dict[str, Any]:
    lake = make_lake(folder, seed)
    began = time.perf_counter()
    pairs = flagdata.open(lake.path).pairs()
    resolving = time.perf_counter() - began
    cached = flagdata.open(lake.path).pairs(cache=DecodedCache(folder / "cache", limit=2 << 30))
    shards = make_shards(folder / "shards", lake, pairs)

    decoded = [pairs[index].clip for index in range(len(pairs))]
    agree = {
        "cache": all(
            torch.equal(cached[k].clip, clip) and torch.equal(cached[k].clip, clip)
            for k, clip in enumerate(decoded)
        ),
        "webdataset": all(
            torch.equal(clip, other)
            for clip, other in zip(decoded, shards_reader(shards), strict=True)
        ),
    }
    del decoded

    loaders = {
        f"{source} {run_in}": dataset.loader(BATCH, workers=WORKERS, run_in=run_in)
        for source, dataset in (("record", pairs), ("cache", cached))
        for run_in in ("threads", "fork")
    }
    sequential = torch.utils.data.DataLoader(
        shards_reader(shards),
        batch_size=BATCH,
        num_workers=WORKERS,
        collate_fn=stack,
        persistent_workers=True,
    )
    single = {
        "record": lambda epoch: (1 for _ in in_random_order(pairs, epoch)),
        "cache": lambda epoch: (1 for _ in in_random_order(cached, epoch)),
        "webdataset": lambda _: (1 for _ in shards_reader(shards)),
    }
    parallel = {
        **{
            way: lambda _, loader=loader: (len(batch) for batch in loader)
            for way, loader in loaders.items()
        },
        "webdataset fork": lambda _: (len(batch) for batch in sequential),
    }
    rates: dict[str, dict[str, list[tuple[float, float]]]] = {"one thread": {}, "two workers": {}}
    for _ in range(ROUNDS):
        for title, ways in (("one thread", single), ("two workers", parallel)):
            for way, epoch in ways.items():
                rates[title].setdefault(way, []).append(rate(epoch))
    size = lake.object_path(str(pairs.table.objects[0])).stat().st_size
    return {
        "clips": len(pairs),
        "bytes_per_frame": round(size / (CLIPS * CLIP_FRAMES)),
        "load_average": round(os.getloadavg()[0], 1),
        "resolve_seconds": round(resolving, 3),
        "pixels_agree_with_the_record": agree,
        "clips_per_second": {
            title: {way: round(max(wall for wall, _ in seen), 1) for way, seen in ways.items()}
            for title, ways in rates.items()
        },
        "clips_per_cpu_second": {
            title: {
                way: round(max(cpu for _, cpu in seen), 1)
                for way, seen in ways.items()
                if "fork" not in way
            }
            for title, ways in rates.items()
        },
        "to_beat": {"one thread": TO_BEAT, "two workers": TO_BEAT_WORKERS},
    }
