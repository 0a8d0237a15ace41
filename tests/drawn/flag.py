"""A drawn flag whose motion follows a wind series: kinematics, not mechanics.

It stands in for a camera in tests of clocks and ingest, where only *when* something moves matters.
Its droop, amplitude and frequency follow the wind by plain formulas; no physics is measured from
it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import Float32Array, FloatArray, UInt8Array
from flagdata.errors import InputError


@dataclass(frozen=True, kw_only=True)
class DrawnFlag:
    """Geometry and response of the drawing.

    Attributes:
        width, height: of the picture [px].
        length: of the flag along the fly [px]; its hoist is two thirds of it.
        response: time constant with which the flag follows the wind [s].
        noise: standard deviation of the camera's noise [gray levels].
    """

    width: int = 400
    height: int = 300
    length: int = 190
    response: float = 0.25
    noise: float = 2.0

    def __post_init__(self) -> None:
        if self.width < 1.5 * self.length or self.height < 1.4 * self.length:
            raise InputError(
                f"a flag of {self.length} px does not fit into {self.width} × {self.height}",
                fix="give a picture at least 1.5 times as wide and 1.4 times as high as the flag "
                "is long",
            )

    def frames(
        self, wind: FloatArray, rate: float, rng: np.random.Generator
    ) -> Iterator[UInt8Array]:
        """One gray picture (height, width) uint8 for each wind speed of `wind` [m/s] at `rate`
        [Hz]."""
        scene = self._background(rng)
        grain = (self.noise * rng.standard_normal((16, self.height, self.width))).astype(np.float32)
        speed = _follow(np.maximum(wind, 0.0), self.response * rate)
        phase = 2 * math.pi * np.cumsum(0.35 + 0.3 * speed) / rate
        for number, (u, p) in enumerate(zip(speed.tolist(), phase.tolist(), strict=True)):
            picture = scene + grain[int(rng.integers(16))] if self.noise else scene.copy()
            self._draw(picture, u, p, lean=0.04 * math.sin(0.13 * number / rate))
            yield np.clip(picture, 0, 255).astype(np.uint8)

    def _background(self, rng: np.random.Generator) -> Float32Array:
        """Sky, haze, a tree line and the pole."""
        rows = np.arange(self.height, dtype=np.float32)[:, None]
        scene = np.broadcast_to(205 - 60 * rows / self.height, (self.height, self.width)).copy()
        ridge = self.height * (
            0.9 - 0.03 * np.cumsum(rng.standard_normal(self.width)) / math.sqrt(self.width)
        )
        scene[rows > ridge] = 70
        scene[:, self._pole - 5 : self._pole] = 60
        return scene.astype(np.float32)

    @property
    def _pole(self) -> int:
        return (self.width - self.length) // 3

    def _draw(self, picture: Float32Array, speed: float, phase: float, lean: float) -> None:
        """Lay the flag over `picture`: hanging at no wind, streaming and rippling as the speed
        grows."""
        hoist = self.length * 2 / 3
        droop = math.atan2(1.0, 0.12 * speed**2 + 0.12) + lean
        reach, sag = self.length * math.cos(droop), self.length * math.sin(droop)
        columns = slice(self._pole, min(self.width, self._pole + math.ceil(reach) + 1))
        window = picture[:, columns]
        fly = (np.arange(window.shape[1], dtype=np.float32)[None, :]) / np.float32(max(reach, 8.0))
        amplitude = 16 * (1 - math.exp(-speed / 3)) * fly
        ripple = amplitude * (np.sin(7 * fly - phase) + 0.35 * np.sin(12 * fly - 1.7 * phase))
        rows = np.arange(self.height, dtype=np.float32)[:, None]
        drop = (rows - 0.06 * self.height - sag * fly * 0.75 - ripple) / np.float32(hoist)
        cover = np.clip(np.minimum(drop, 1 - drop) * hoist + 0.5, 0, 1) * np.clip(
            (1 - fly) * reach + 0.5, 0, 1
        )
        band = np.where(
            drop < 1 / 3, np.float32(95), np.where(drop < 2 / 3, np.float32(235), np.float32(45))
        )
        light = 1 + 0.25 * np.cos(7 * fly - phase) * np.minimum(fly * 3, 1)
        window += cover.astype(np.float32) * ((band * light).astype(np.float32) - window)


def _follow(signal: FloatArray, constant: float) -> FloatArray:
    """First-order lag with a time constant in samples, started settled."""
    from scipy.signal import lfilter

    if constant <= 0:
        return signal
    keep = math.exp(-1 / constant)
    out, _ = lfilter([1 - keep], [1, -keep], signal, zi=[keep * signal[0]])
    return np.asarray(out)
