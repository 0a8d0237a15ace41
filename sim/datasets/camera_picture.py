"""From the renderer's colours to the camera's file: gray, noise, then JPEGs of one size, which
reveals nothing, or H.264."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from PIL import Image

from flagdata.core.arrays import UInt8Array
from flagdata.core.rng import stream
from flagdata.errors import InputError
from flagdata.recipes.typed_tables import Quantity, Range
from flagdata.record.video_archive import VideoEncoder
from flagdata.record.writer import Coding, encode_jpeg
from sim.datasets.dataset_recipe import CameraSpec

_END = b"\xff\xd9"  # the marker that ends a JPEG
_PRESET = "veryfast"  # a fifth of the time of "medium", 5 % more bytes, 0.1 to 0.3 dB less
_FILL = b"\xff"  # any marker may be preceded by fill bytes (ITU-T T.81, B.1.1.2)


def settings(spec: CameraSpec, *, seed: int) -> dict[str, float]:
    """Draws the settings of a recording's camera, "camera.…" → value."""

    def drawn(quantity: Quantity, name: str) -> float:
        return (
            quantity.at(stream(seed, "camera", name).random())
            if isinstance(quantity, Range)
            else quantity
        )

    if spec.coding is Coding.JPEG:
        coding = {"camera.jpeg_quality": float(round(drawn(spec.jpeg_quality, "jpeg-quality")))}
    else:
        coding = {"camera.rate_factor": drawn(spec.rate_factor, "rate-factor")}
    return {
        **coding,
        "camera.read_noise": drawn(spec.read_noise, "read-noise"),
        "camera.shot_noise": drawn(spec.shot_noise, "shot-noise"),
    }


def encode_pictures(
    frames: UInt8Array, drawn: dict[str, float], spec: CameraSpec, *, seed: int
) -> list[bytes]:
    """Encodes frames (n, height, width, 3) as the camera stores them, one message each.

    Args:
        drawn: of `settings`; where JPEGs take a lower quality to fit, it is changed to that.

    Raises:
        InputError: as `jpegs`, or an odd size for H.264.
    """
    if spec.coding is Coding.JPEG:
        pictures, quality = jpegs(frames, drawn, slot=spec.frame_slot, seed=seed)
        drawn["camera.jpeg_quality"] = float(quality)
        return pictures
    encoder = VideoEncoder(
        height=frames.shape[1],
        width=frames.shape[2],
        rate_factor=drawn["camera.rate_factor"],
        preset=_PRESET,
    )
    return [encoder.encode(gray) for gray in _noisy(frames, drawn, seed=seed)]


def jpegs(
    frames: UInt8Array, drawn: dict[str, float], *, slot: int, seed: int
) -> tuple[list[bytes], int]:
    """JPEGs of frames (n, height, width, 3), gray (Rec. 601, as everywhere in `flagdata.ingest`),
    and their quality.

    All are `slot` bytes long. Where one would be longer at the drawn quality, the whole film has
    the best at which none
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
                f"a frame takes {len(jpeg):,} B at the lowest quality",
                where=f"frame-slot = {slot}",
                fix="raise it",
            )
        quality -= 1
        coded.clear()
    return [pad_jpeg(jpeg, slot) for jpeg in coded], quality


def _noisy(frames: UInt8Array, drawn: dict[str, float], *, seed: int) -> Iterator[UInt8Array]:
    rng = stream(seed, "camera", "noise")
    for frame in frames:
        yield noisy(np.asarray(Image.fromarray(frame).convert("L")), drawn, rng)


def noisy(gray: UInt8Array, drawn: Mapping[str, float], rng: np.random.Generator) -> UInt8Array:
    """Adds the camera's noise to a gray picture (height, width).

    Args:
        drawn: of `settings`.
    """
    read, shot = drawn["camera.read_noise"], drawn["camera.shot_noise"]
    if not (read or shot):
        return gray
    light = gray.astype(np.float32)
    sigma = np.sqrt(read**2 + shot**2 * light / 255)
    return np.clip(
        np.rint(light + sigma * rng.standard_normal(light.shape, dtype=np.float32)), 0, 255
    ).astype(np.uint8)


def pad_jpeg(jpeg: bytes, length: int) -> bytes:
    """Pads a JPEG to a length that is not below its own; the picture stays the same."""
    return jpeg[: -len(_END)] + _FILL * (length - len(jpeg)) + _END
