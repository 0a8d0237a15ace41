"""Compression once more, as by a phone or a web video: H.264 by x264."""

from __future__ import annotations

import numpy as np

from flagdata.record.video_archive import VideoEncoder, decode
from models.training.augment.augment import Disturbance, Drawn, Film

_PRESET = "superfast"


def _encode_film(drawn: Drawn) -> Film:
    """Encodes and decodes the film; the strength is x264's constant rate factor; of an odd side the
    last row or column is left out."""
    film = drawn.film[:, : drawn.film.shape[1] // 2 * 2, : drawn.film.shape[2] // 2 * 2]
    encoder = VideoEncoder(
        height=film.shape[1],
        width=film.shape[2],
        rate_factor=round(drawn.strength, 1),
        preset=_PRESET,
    )
    return np.stack(
        decode(
            [encoder.encode(np.ascontiguousarray(frame)) for frame in film], where="augmentation"
        )
    )


CODING = Disturbance(apply=_encode_film, unit="of rate factor", most=51.0)
