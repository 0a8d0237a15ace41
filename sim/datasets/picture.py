"""From the renderer's colours to the camera's file: gray, noise, JPEG of a size that tells nothing."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from flagdata.record.writer import encode_jpeg
from flagdata.rng import stream
from sim.datasets.recipe import CameraSpec
from sim.run.tables import Quantity, Range

_END = b"\xff\xd9"  # the marker that ends a JPEG
_FILL = b"\xff"  # any marker may be preceded by fill bytes (ITU-T T.81, B.1.1.2)


def settings(spec: CameraSpec, *, seed: int) -> dict[str, float]:
    """What a recording's camera draws, "camera.…" → value."""

    def drawn(quantity: Quantity, name: str) -> float:
        return quantity.at(stream(seed, "camera", name).random()) if isinstance(quantity, Range) else quantity

    return {
        "camera.jpeg_quality": float(round(drawn(spec.jpeg_quality, "jpeg-quality"))),
        "camera.read_noise": drawn(spec.read_noise, "read-noise"),
        "camera.shot_noise": drawn(spec.shot_noise, "shot-noise"),
    }


def jpegs(frames: NDArray[np.uint8], drawn: dict[str, float], *, slot: int, seed: int) -> Iterator[bytes]:
    """JPEGs of frames (n, height, width, 3), gray (Rec. 601, as everywhere in `flagdata.ingest`).

    Args:
        drawn: of `settings`.
        slot: see `CameraSpec.frame_slot`.
    """
    rng = stream(seed, "camera", "noise")
    read, shot = drawn["camera.read_noise"], drawn["camera.shot_noise"]
    for frame in frames:
        gray = np.asarray(Image.fromarray(frame).convert("L"), dtype=np.float32)
        if read or shot:
            sigma = np.sqrt(read**2 + shot**2 * gray / 255)
            gray = np.clip(np.rint(gray + sigma * rng.standard_normal(gray.shape, dtype=np.float32)), 0, 255)
        yield filled(encode_jpeg(gray.astype(np.uint8), quality=int(drawn["camera.jpeg_quality"])), slot)


def filled(jpeg: bytes, slot: int) -> bytes:
    """The same picture, its length a whole multiple of `slot`."""
    return jpeg[: -len(_END)] + _FILL * (-len(jpeg) % slot) + _END
