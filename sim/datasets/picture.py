"""From the renderer's colours to the camera's file: gray, noise, JPEG of a size that tells nothing."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from flagdata.errors import InputError
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


def jpegs(frames: NDArray[np.uint8], drawn: dict[str, float], *, slot: int, seed: int) -> tuple[list[bytes], int]:
    """JPEGs of frames (n, height, width, 3), gray (Rec. 601, as everywhere in `flagdata.ingest`), and their quality.

    All are `slot` bytes long. Where one would be longer at the drawn quality, the whole film has the best at which none
    is: a camera with a limited rate does the same.

    Args:
        drawn: of `settings`.

    Raises:
        InputError: a frame is longer at any quality.
    """
    grays = list(_noisy(frames, drawn, seed=seed))
    quality = int(drawn["camera.jpeg_quality"])
    coded: list[bytes] = []
    while len(coded) < len(grays):
        jpeg = encode_jpeg(grays[len(coded)], quality=quality)
        if len(jpeg) <= slot:
            coded.append(jpeg)
            continue
        if quality == 1:
            raise InputError(
                f"a frame takes {len(jpeg):,} B at the lowest quality", where=f"frame-slot = {slot}", fix="raise it"
            )
        quality -= 1
        coded.clear()
    return [filled(jpeg, slot) for jpeg in coded], quality


def _noisy(frames: NDArray[np.uint8], drawn: dict[str, float], *, seed: int) -> Iterator[NDArray[np.uint8]]:
    rng = stream(seed, "camera", "noise")
    read, shot = drawn["camera.read_noise"], drawn["camera.shot_noise"]
    for frame in frames:
        gray = np.asarray(Image.fromarray(frame).convert("L"), dtype=np.float32)
        if read or shot:
            sigma = np.sqrt(read**2 + shot**2 * gray / 255)
            gray = np.clip(np.rint(gray + sigma * rng.standard_normal(gray.shape, dtype=np.float32)), 0, 255)
        yield gray.astype(np.uint8)


def filled(jpeg: bytes, length: int) -> bytes:
    """The same picture in a file of this length, which is not below its own."""
    return jpeg[: -len(_END)] + _FILL * (length - len(jpeg)) + _END
