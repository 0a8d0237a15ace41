"""Drawn films that show no flag on a pole: a wall, text that scrolls, fire, birds, a curtain,
umbrellas, leaves, palms, water, a crowd, a rotor, cloth below a bar, traffic.

Each takes what is behind it, (n, height, width) at 25 Hz, and draws into a copy of it, by a random
generator.
"""

from __future__ import annotations

import cv2
import numpy as np

from flagdata.core.arrays import FloatArray, UInt8Array

RATE = 25.0


def _grid(behind: UInt8Array) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rows (height, 1), columns (1, width) and times (n,) of a film."""
    count, height, width = behind.shape
    return np.arange(height)[:, None] + 0.0, np.arange(width)[None] + 0.0, np.arange(count) / RATE


def wall(behind: UInt8Array, rng: np.random.Generator) -> UInt8Array:
    """A blank wall, with a camera's noise."""
    noise = rng.normal(0, 1.5, behind.shape)
    return np.clip(np.rint(170 + noise), 0, 255).astype(np.uint8)


def scroll(behind: UInt8Array, rng: np.random.Generator) -> UInt8Array:
    """Lines of text that run upwards over a still picture, in a column."""
    _, height, width = behind.shape
    page = np.full((6 * height, width // 2), 20, np.uint8)
    for row in range(0, len(page) - 12, 14):
        for left in range(4, width // 2 - 12, 12):
            if rng.random() < 0.8:
                page[
                    row : row + int(rng.integers(5, 9)), left : left + int(rng.integers(4, 10))
                ] = 235
    film = behind.copy()
    for k, frame in enumerate(film):
        first = round(47.0 * k / RATE)
        frame[:, width // 4 : width // 4 + width // 2] = page[first : first + height]
    return film


def fire(behind: UInt8Array, rng: np.random.Generator) -> UInt8Array:
    """Flames that rise from a hearth and flicker."""
    rows, columns, times = _grid(behind)
    height, width = behind.shape[1:]
    fuel = cv2.GaussianBlur(rng.normal(0, 1, (8 * height, width)), (0, 0), sigmaX=4, sigmaY=9)
    fuel /= fuel.std()
    film = behind.copy()
    for frame, time in zip(film, times, strict=True):
        first = round(190 * time)
        rising = fuel[first : first + height]
        shape = (rows - 0.25 * height) / (0.55 * height) - np.square(
            (columns - width / 2) / (0.22 * width)
        )
        flames = (shape + 0.35 * rising > 0.35) & (rows < 0.8 * height)
        frame[flames] = np.clip(170 + 40 * rising, 0, 255)[flames]
    return film


def birds(behind: UInt8Array, rng: np.random.Generator) -> UInt8Array:
    """A flock that crosses the sky, each bird with wings that beat."""
    _, _, times = _grid(behind)
    height, width = behind.shape[1:]
    flock = rng.uniform((-0.4, 0.2, 0.12, 6, 0), (0.7, 0.7, 0.25, 11, 6), (24, 5))
    film = behind.copy()
    for frame, time in zip(film, times, strict=True):
        for x, y, speed, beat, phase in flock:
            across, down = (x + speed * time) * width, (y + 0.03 * np.sin(time + phase)) * height
            wing = down + 4 * np.sin(beat * time + phase)
            ends = [(across - 7, wing), (across, down), (across + 7, wing)]
            cv2.polylines(
                frame, [np.rint(ends).astype(np.int32)], isClosed=False, color=15.0, thickness=2
            )
    return film


def curtain(behind: UInt8Array, rng: np.random.Generator) -> UInt8Array:
    """A curtain at a window, whose folds wander and whose hem swings: a rail above it, a jamb at
    each side."""
    rows, columns, times = _grid(behind)
    height, width = behind.shape[1:]
    top, low, left, right = 0.2 * height, 0.85 * height, 0.3 * width, 0.7 * width
    first = rng.uniform(0, 2 * np.pi)
    film = behind.copy()
    film[:, round(top) - 5 : round(top), round(0.2 * width) : round(0.8 * width)] = 25
    down = (rows - top) / (low - top)
    for frame, time in zip(film, times, strict=True):
        swing = (
            0.05
            * width
            * np.square(down)
            * (np.sin(2.1 * time + first) + 0.6 * np.sin(3.7 * time + 1))
        )
        along = (columns - left - swing) / (right - left)
        folds = np.sin(2 * np.pi * 6 * along + 1.5 * np.sin(1.7 * time + 2 * down))
        own = (along >= 0) & (along < 1) & (down >= 0) & (down < 1)
        frame[own] = np.clip(150 + 55 * folds, 0, 255)[own]
    return film


def umbrellas(behind: UInt8Array, rng: np.random.Generator) -> UInt8Array:
    """People under umbrellas who walk by."""
    _, _, times = _grid(behind)
    height, width = behind.shape[1:]
    people = rng.uniform((-0.1, 0.45, -0.06, 60, 0), (1.1, 0.6, 0.06, 230, 6), (9, 5))
    film = behind.copy()
    for frame, time in zip(film, times, strict=True):
        for x, y, speed, gray, phase in people:
            at = (
                round((x + speed * time) * width),
                round((y + 0.012 * np.sin(9 * time + phase)) * height),
            )
            cv2.rectangle(
                frame,
                (at[0] - 6, at[1]),
                (at[0] + 6, at[1] + round(0.3 * height)),
                float(gray) / 2,
                -1,
            )
            cv2.ellipse(
                frame, at, (round(0.09 * width), round(0.11 * height)), 0, 180, 360, float(gray), -1
            )
    return film


def leaves(behind: UInt8Array, rng: np.random.Generator) -> UInt8Array:
    """A tree's crown of leaves that sway, each by itself, on a trunk."""
    _, _, times = _grid(behind)
    height, width = behind.shape[1:]
    crown = rng.normal(
        (0.5 * width, 0.4 * height, 130, 9, 3), (0.1 * width, 0.1 * height, 45, 2, 2), (900, 5)
    )
    film = behind.copy()
    film[:, round(0.5 * height) :, round(0.49 * width) : round(0.51 * width)] = 40
    for frame, time in zip(film, times, strict=True):
        for x, y, gray, beat, phase in crown:
            at = (
                round(x + 1.5 * np.sin(beat * time + phase)),
                round(y + 1.5 * np.cos(1.3 * beat * time + phase)),
            )
            cv2.ellipse(
                frame, at, (3, 2), 40 * float(phase), 0, 360, float(np.clip(gray, 20, 240)), -1
            )
    return film


def palms(behind: UInt8Array, rng: np.random.Generator) -> UInt8Array:
    """A palm in a storm: fronds that stream to one side from the top of a bent trunk, and beat."""
    _, _, times = _grid(behind)
    height, width = behind.shape[1:]
    fronds = rng.uniform((-0.5, 0.25, 6, 0, 60), (0.9, 0.5, 16, 6, 130), (22, 5))
    trunk = np.array(
        [(0.25 * width, height), (0.26 * width, 0.7 * height), (0.32 * width, 0.42 * height)]
    )
    film = behind.copy()
    for frame, time in zip(film, times, strict=True):
        top = trunk[-1] + (2.0 * np.sin(3.1 * time), 0.6 * np.cos(3.1 * time))
        cv2.polylines(
            frame,
            [np.rint([*trunk[:-1], top]).astype(np.int32)],
            isClosed=False,
            color=50.0,
            thickness=7,
        )
        for slope, length, beat, phase, gray in fronds:
            along = np.linspace(0, 1, 9)
            swing = 0.12 * np.sin(beat * time + phase - 3 * along) * along
            x = top[0] + length * width * along * np.cos(slope)
            y = top[1] + length * height * (along * np.sin(slope) + 0.5 * along**2 + swing)
            leaf = np.rint(np.stack([x, y], axis=1)).astype(np.int32)
            cv2.polylines(frame, [leaf], isClosed=False, color=float(gray), thickness=5)
    return film


def water(behind: UInt8Array, rng: np.random.Generator) -> UInt8Array:
    """Waves that run across each other between two shores."""
    rows, columns, times = _grid(behind)
    height, width = behind.shape[1:]
    waves = [rng.uniform((0.05, -0.3, 3, 0), (0.25, 0.3, 9, 6)) for _ in range(8)]
    bed = (
        (rows > 0.4 * height)
        & (rows < 0.92 * height)
        & (columns > 0.06 * width)
        & (columns < 0.94 * width)
    )
    film = behind.copy()
    for frame, time in zip(film, times, strict=True):
        level = sum(
            np.sin(a * columns + b * rows - rate * time + phase) for a, b, rate, phase in waves
        )
        frame[bed] = np.clip(110 + 18 * np.asarray(level), 0, 255)[bed]
    return film


def crowd(behind: UInt8Array, rng: np.random.Generator) -> UInt8Array:
    """Heads that sway, each by itself."""
    _, _, times = _grid(behind)
    height, width = behind.shape[1:]
    low, high = (0.29 * width, 0.33 * height, 4, 0, 40), (0.71 * width, 0.72 * height, 9, 6, 220)
    heads = rng.uniform(low, high, (18, 5))
    film = behind.copy()
    for frame, time in zip(film, times, strict=True):
        for x, y, rate, phase, gray in heads:
            at = (
                round(x + 7 * np.sin(rate * time + phase)),
                round(y + 3 * np.cos(1.3 * rate * time)),
            )
            cv2.ellipse(frame, at, (5, 9), 0, 0, 360, float(gray), -1)
    return film


def rotor(behind: UInt8Array, rng: np.random.Generator) -> UInt8Array:
    """Three blades that turn on a tower, at no simple share of a turn a frame."""
    _, _, times = _grid(behind)
    height, width = behind.shape[1:]
    x, y, blade, first = width // 2, round(0.44 * height), 0.25 * height, rng.uniform(0, 2 * np.pi)
    film = behind.copy()
    film[:, y:, x - 2 : x + 2] = 20
    for frame, time in zip(film, times, strict=True):
        for angle in first + 5.3 * time + 0.4 * time**2 + np.array([0, 2, 4]) * np.pi / 3:
            cv2.line(
                frame,
                (x, y),
                (round(x + blade * np.cos(angle)), round(y + blade * np.sin(angle))),
                230.0,
                4,
            )
    return film


def hung(behind: UInt8Array, rng: np.random.Generator) -> UInt8Array:
    """Cloth below a bar on two posts, whose lower part swings."""
    rows, columns, times = _grid(behind)
    height, width = behind.shape[1:]
    top, low, left, right = round(0.22 * height), 0.72 * height, 0.355 * width, 0.605 * width
    dark = rng.uniform(50, 70)
    film = behind.copy()
    film[:, top - 4 : top, round(0.125 * width) : round(0.917 * width)] = 20
    for post in (round(left) - 9, round(right) + 9):
        film[:, top - 4 : round(0.61 * height), post : post + 3] = 20
    down = (rows - top) / (low - top)
    for frame, time in zip(film, times, strict=True):
        swing = 0.058 * width * down**2 * (np.sin(5.1 * time) + 0.6 * np.sin(8.3 * time + 1))
        along = (columns - left - swing) / (right - left)
        cloth = np.where((along * 5).astype(int) % 2, 200, dark) + 15 * np.cos(9 * time - 6 * down)
        own = (along >= 0) & (along < 1) & (down >= 0) & (down < 1)
        frame[own] = np.clip(cloth, 0, 255)[own]
    return film


def traffic(behind: UInt8Array, rng: np.random.Generator) -> UInt8Array:
    """Cars on a street, in both directions."""
    _, _, times = _grid(behind)
    height, width = behind.shape[1:]
    cars = rng.uniform((-1.2, 0.3, 40, 0.09), (1.2, 0.6, 230, 0.16), (12, 4))
    film = behind.copy()
    for frame, time in zip(film, times, strict=True):
        for number, (start, speed, gray, length) in enumerate(cars):
            x = (start + (speed if number % 2 else -speed) * time) % 2.4 - 0.7
            y = (0.62 if number % 2 else 0.74) * height
            left, right = round(x * width), round((x + length) * width)
            cv2.rectangle(
                frame, (left, round(y)), (right, round(y + 0.06 * height)), float(gray), -1
            )
            roof = round(0.2 * length * width)
            cv2.rectangle(
                frame,
                (left + roof, round(y - 0.04 * height)),
                (right - roof, round(y)),
                float(gray) / 2,
                -1,
            )
    return film
