"""Drawn films that show no flag: a wall, text that scrolls, fire, birds, a curtain, umbrellas, leaves.

Each takes what is behind it, (n, height, width) at 25 Hz, and draws into a copy of it.
"""

from __future__ import annotations

import cv2
import numpy as np

from flagdata.arrays import FloatArray, UInt8Array
from flagdata.rng import stream

RATE = 25.0


def _grid(behind: UInt8Array) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rows (height, 1), columns (1, width) and times (n,) of a film."""
    count, height, width = behind.shape
    return np.arange(height)[:, None] + 0.0, np.arange(width)[None] + 0.0, np.arange(count) / RATE


def wall(behind: UInt8Array) -> UInt8Array:
    """A blank wall, with a camera's noise."""
    noise = stream(21, "wall").normal(0, 1.5, behind.shape)
    return np.clip(np.rint(170 + noise), 0, 255).astype(np.uint8)


def scroll(behind: UInt8Array) -> UInt8Array:
    """Lines of text that run upwards over a still picture, in a column."""
    rng, (_, height, width) = stream(22, "scroll"), behind.shape
    page = np.full((6 * height, width // 2), 20, np.uint8)
    for row in range(0, len(page) - 12, 14):
        for left in range(4, width // 2 - 12, 12):
            if rng.random() < 0.8:
                page[row : row + int(rng.integers(5, 9)), left : left + int(rng.integers(4, 10))] = 235
    film = behind.copy()
    for k, frame in enumerate(film):
        first = round(47.0 * k / RATE)
        frame[:, width // 4 : width // 4 + width // 2] = page[first : first + height]
    return film


def fire(behind: UInt8Array) -> UInt8Array:
    """Flames that rise from a hearth and flicker."""
    rng, (rows, columns, times) = stream(23, "fire"), _grid(behind)
    height, width = behind.shape[1:]
    fuel = cv2.GaussianBlur(rng.normal(0, 1, (8 * height, width)), (0, 0), sigmaX=4, sigmaY=9)
    fuel /= fuel.std()
    film = behind.copy()
    for frame, time in zip(film, times, strict=True):
        first = round(190 * time)
        rising = fuel[first : first + height]
        shape = (rows - 0.25 * height) / (0.55 * height) - np.square((columns - width / 2) / (0.22 * width))
        flames = (shape + 0.35 * rising > 0.35) & (rows < 0.8 * height)
        frame[flames] = np.clip(170 + 40 * rising, 0, 255)[flames]
    return film


def birds(behind: UInt8Array) -> UInt8Array:
    """A flock that crosses the sky, each bird with wings that beat."""
    rng, (_, _, times) = stream(24, "birds"), _grid(behind)
    height, width = behind.shape[1:]
    flock = rng.uniform((-0.4, 0.2, 0.12, 6, 0), (0.7, 0.7, 0.25, 11, 6), (24, 5))
    film = behind.copy()
    for frame, time in zip(film, times, strict=True):
        for x, y, speed, beat, phase in flock:
            across, down = (x + speed * time) * width, (y + 0.03 * np.sin(time + phase)) * height
            wing = down + 4 * np.sin(beat * time + phase)
            ends = [(across - 7, wing), (across, down), (across + 7, wing)]
            cv2.polylines(frame, [np.rint(ends).astype(np.int32)], isClosed=False, color=15.0, thickness=2)
    return film


def curtain(behind: UInt8Array) -> UInt8Array:
    """A curtain at a window, whose folds wander and whose hem swings: a rail above it, a jamb at each side."""
    rows, columns, times = _grid(behind)
    height, width = behind.shape[1:]
    top, low, left, right = 0.2 * height, 0.85 * height, 0.3 * width, 0.7 * width
    film = behind.copy()
    film[:, round(top) - 5 : round(top), round(0.2 * width) : round(0.8 * width)] = 25
    down = (rows - top) / (low - top)
    for frame, time in zip(film, times, strict=True):
        swing = 0.05 * width * np.square(down) * (np.sin(2.1 * time) + 0.6 * np.sin(3.7 * time + 1))
        along = (columns - left - swing) / (right - left)
        folds = np.sin(2 * np.pi * 6 * along + 1.5 * np.sin(1.7 * time + 2 * down))
        own = (along >= 0) & (along < 1) & (down >= 0) & (down < 1)
        frame[own] = np.clip(150 + 55 * folds, 0, 255)[own]
    return film


def umbrellas(behind: UInt8Array) -> UInt8Array:
    """People under umbrellas who walk by."""
    rng, (_, _, times) = stream(25, "umbrellas"), _grid(behind)
    height, width = behind.shape[1:]
    people = rng.uniform((-0.1, 0.45, -0.06, 60, 0), (1.1, 0.6, 0.06, 230, 6), (9, 5))
    film = behind.copy()
    for frame, time in zip(film, times, strict=True):
        for x, y, speed, gray, phase in people:
            at = (round((x + speed * time) * width), round((y + 0.012 * np.sin(9 * time + phase)) * height))
            cv2.rectangle(frame, (at[0] - 6, at[1]), (at[0] + 6, at[1] + round(0.3 * height)), float(gray) / 2, -1)
            cv2.ellipse(frame, at, (round(0.09 * width), round(0.11 * height)), 0, 180, 360, float(gray), -1)
    return film


def leaves(behind: UInt8Array) -> UInt8Array:
    """A tree's crown of leaves that sway, each by itself, on a trunk."""
    rng, (_, _, times) = stream(26, "leaves"), _grid(behind)
    height, width = behind.shape[1:]
    crown = rng.normal((0.5 * width, 0.4 * height, 130, 9, 3), (0.1 * width, 0.1 * height, 45, 2, 2), (900, 5))
    film = behind.copy()
    film[:, round(0.5 * height) :, round(0.49 * width) : round(0.51 * width)] = 40
    for frame, time in zip(film, times, strict=True):
        for x, y, gray, beat, phase in crown:
            at = (round(x + 1.5 * np.sin(beat * time + phase)), round(y + 1.5 * np.cos(1.3 * beat * time + phase)))
            cv2.ellipse(frame, at, (3, 2), 40 * float(phase), 0, 360, float(np.clip(gray, 20, 240)), -1)
    return film
