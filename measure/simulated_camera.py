"""A film of a simulated flag as a camera writes it: colour, noise, H.264 with the time of its first
frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from datetime import datetime
from fractions import Fraction
from multiprocessing import get_context
from pathlib import Path

import av
import numpy as np
from av.video.frame import VideoFrame

from flagdata.core.arrays import UInt8Array
from flagdata.core.rng import stream
from flagdata.lake.mesh_sequences import MeshSequence, RaggedMeshSequence
from sim.assets import Assets
from sim.datasets.camera_picture import noisy
from sim.render import Meshes, RenderParameters
from sim.render.raster import Raster
from sim.workers import single_threaded

NOISE = {"camera.read_noise": 0.8, "camera.shot_noise": 1.5}
"""Of the camera, in 8-bit steps: in the middle of the data set `outdoor`."""
RATE_FACTOR = 23
"""x264's: what phones and cameras write is no better."""
_CHUNK = 240
"""Frames that a process renders at a time."""


def write_film(
    path: Path,
    sequence: MeshSequence | RaggedMeshSequence,
    zeta: RenderParameters,
    *,
    rate: int,
    start: datetime,
    seed: int,
    workers: int,
    advance: Callable[[int], object],
    assets: Assets | None = None,
) -> None:
    """Films a flag in a wind along +x.

    Args:
        rate: frames a second; those of the sequence [Hz].
        start: that the file states as its creation time.
        seed: of the camera's noise.
        advance: called with the number of frames done.
        assets: where texture and background come from; None for those of the package.
    """
    with av.open(str(path), "w") as container:
        container.metadata["creation_time"] = start.isoformat()
        video = container.add_stream(
            "libx264", rate=rate, options={"preset": "veryfast", "crf": str(RATE_FACTOR)}
        )
        video.width, video.height, video.pix_fmt = zeta.width, zeta.height, "yuv420p"
        video.codec_context.time_base = Fraction(1, rate)
        video.codec_context.thread_count = 1  # the same bytes on every machine
        number = 0
        for planes in _render_pictures(
            sequence, zeta, Assets() if assets is None else assets, seed=seed, workers=workers
        ):
            for picture in planes:
                frame = VideoFrame.from_ndarray(picture, format="yuv420p")
                frame.pts = number
                container.mux(video.encode(frame))
                number += 1
            advance(len(planes))
        container.mux(video.encode())


def _render_pictures(
    sequence: MeshSequence | RaggedMeshSequence,
    zeta: RenderParameters,
    assets: Assets,
    *,
    seed: int,
    workers: int,
) -> Iterator[UInt8Array]:
    """Pictures (n, 1.5 height, width) in YUV 4:2:0 with noise, in order, a chunk at a time."""
    firsts = range(0, len(sequence), _CHUNK)
    with ProcessPoolExecutor(
        workers, mp_context=get_context("spawn"), initializer=single_threaded
    ) as pool:
        # No more than two a worker are waited for, so that finished chunks do not pile up.
        waiting: list[Future[UInt8Array]] = []
        for first in firsts:
            if len(waiting) >= 2 * workers:
                yield waiting.pop(0).result()
            waiting.append(pool.submit(_chunk, sequence, zeta, assets, first, seed))
        for future in waiting:
            yield future.result()


def _chunk(
    sequence: MeshSequence | RaggedMeshSequence,
    zeta: RenderParameters,
    assets: Assets,
    first: int,
    seed: int,
) -> UInt8Array:
    meshes = Meshes.flag(sequence, heading=0.0)
    pictures = (
        Raster(assets=assets).part(meshes, zeta, first, min(first + _CHUNK, len(meshes))).numpy()
    )
    rng = stream(seed, "demo", "camera", first)
    out = []
    for picture in pictures:
        planes = (
            VideoFrame.from_ndarray(picture, format="rgb24")
            .reformat(format="yuv420p")
            .to_ndarray()
            .astype(np.uint8)
        )
        planes[: zeta.height] = noisy(planes[: zeta.height], NOISE, rng)
        out.append(planes)
    return np.stack(out)
