"""Procedural backgrounds: skies, clouds, hills, foliage, buildings; weather, light, colours and
focus of their own.

They are no likenesses. They vary in what a picture's statistics have (brightness, colour, contrast,
spectral slope, edges, horizons), so that the background carries no information about a scene.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from flagdata.core.arrays import FloatArray
from sim.assets.colour import Hue, hue
from sim.assets.seeded import Seeded
from sim.assets.smooth_fields import Picture, Plane, defocus, fractal, over, ridge, smoothstep

_ROWS, _COLUMNS = 400, 512  # px
_HEIGHT: Plane = np.linspace(1.0, 0.0, _ROWS)[:, None] * np.ones(
    (1, _COLUMNS)
)  # 1 at the upper edge
_X: Plane = np.linspace(0.0, _COLUMNS / _ROWS, _COLUMNS)[None, :] * np.ones((_ROWS, 1))


# Weather → (hue, saturation, brightness) at the zenith and at the horizon.
_SKIES: Mapping[str, tuple[Hue, Hue]] = {
    "clear": (((0.55, 0.62), (0.4, 0.85), (0.5, 0.95)), ((0.52, 0.6), (0.05, 0.35), (0.75, 1.0))),
    "clouds": (((0.55, 0.62), (0.4, 0.85), (0.5, 0.95)), ((0.52, 0.6), (0.05, 0.35), (0.75, 1.0))),
    "overcast": (((0.5, 0.68), (0.0, 0.15), (0.4, 0.9)), ((0.5, 0.68), (0.0, 0.1), (0.55, 1.0))),
    "dusk": (((0.58, 0.72), (0.2, 0.55), (0.25, 0.6)), ((0.0, 0.13), (0.15, 0.55), (0.65, 1.0))),
}
_GROUNDS: tuple[Hue, ...] = (
    ((0.18, 0.36), (0.3, 0.7), (0.2, 0.6)),  # grass
    ((0.08, 0.13), (0.2, 0.5), (0.5, 0.9)),  # sand
    ((0.0, 1.0), (0.0, 0.1), (0.25, 0.55)),  # asphalt
    ((0.48, 0.62), (0.2, 0.6), (0.25, 0.7)),  # water
    ((0.55, 0.65), (0.0, 0.1), (0.8, 1.0)),  # snow
)
_WALLS: tuple[Hue, ...] = (
    ((0.0, 0.15), (0.0, 0.45), (0.3, 0.95)),
    ((0.5, 0.7), (0.0, 0.3), (0.2, 0.9)),
)


def _weather(rng: np.random.Generator) -> Picture:
    """Paints a sky from zenith to horizon, with clouds of some cover, or fog, or dusk."""
    kind = rng.choice(["clear", "clouds", "overcast", "dusk"], p=[0.2, 0.4, 0.25, 0.15])
    above, below = _SKIES[kind]
    zenith, horizon = hue(rng, *above), hue(rng, *below)
    sky = over(
        np.broadcast_to(horizon, (_ROWS, _COLUMNS, 3)), zenith, _HEIGHT ** rng.uniform(0.5, 1.6)
    )
    haze = fractal(rng, _ROWS, _COLUMNS, slope=2.0, stretch=4.0)[:, :, None]
    sky = sky * (1 + rng.uniform(0.005, 0.04) * haze)
    if kind == "clear":
        return sky
    stretch = rng.uniform(1.2, 3.0)
    form = fractal(rng, _ROWS, _COLUMNS, slope=rng.uniform(1.4, 2.0), stretch=stretch)
    cover, edge = (
        (rng.uniform(-1.3, 0.9), rng.uniform(0.2, 1.5)) if kind != "overcast" else (-3.0, 3.0)
    )
    lit = rng.uniform(0.75, 1.05) - rng.uniform(0.05, 0.2) * np.roll(
        form, -int(rng.integers(4, 14)), axis=0
    )
    tint = hue(rng, (0.0, 1.0), (0.0, 0.08), (0.85, 1.0)) if kind != "dusk" else horizon
    cloud = np.clip(lit, 0.25, 1.1)[:, :, None] * tint
    return over(sky, cloud, smoothstep(cover, cover + edge, form) * rng.uniform(0.6, 1.0))


def _ground(rng: np.random.Generator) -> Picture:
    """Grass, sand, asphalt, water or snow, with features that shrink towards the horizon."""
    colour = hue(rng, *_GROUNDS[int(rng.integers(len(_GROUNDS)))])
    coarse = fractal(
        rng, _ROWS, _COLUMNS, slope=rng.uniform(0.9, 1.5), stretch=rng.uniform(2.0, 6.0)
    )
    fine = fractal(rng, _ROWS, _COLUMNS, slope=rng.uniform(0.3, 0.8), stretch=rng.uniform(1.0, 4.0))
    light = 1 + rng.uniform(0.05, 0.25) * coarse + rng.uniform(0.03, 0.15) * fine
    return light[:, :, None] * colour


def _sky(rng: np.random.Generator) -> Picture:
    return _weather(rng)


def _clouds(rng: np.random.Generator) -> Picture:
    """Paints broken clouds before a clear sky: bright towards the sun, gray beneath, some with a
    thin veil above."""
    above, below = _SKIES["clear"]
    zenith, horizon = hue(rng, *above), hue(rng, *below)
    sky = over(
        np.broadcast_to(horizon, (_ROWS, _COLUMNS, 3)), zenith, _HEIGHT ** rng.uniform(0.5, 1.6)
    )
    veil = fractal(rng, _ROWS, _COLUMNS, slope=1.3, stretch=rng.uniform(2.0, 5.0))
    sky = over(sky, np.ones(3), smoothstep(-1.0, 2.5, veil) * rng.uniform(0.0, 0.4))
    form = fractal(rng, _ROWS, _COLUMNS, slope=rng.uniform(1.3, 1.7), stretch=rng.uniform(1.2, 2.5))
    cover, edge = rng.uniform(-0.9, 0.5), rng.uniform(0.15, 0.7)
    reach, side = int(rng.integers(6, 24)), int(rng.integers(-16, 17))
    thicker_towards_sun = np.roll(form, (reach, side), axis=(0, 1)) - form
    depth = smoothstep(cover, cover + rng.uniform(1.0, 2.5), form)
    lit = 0.96 - rng.uniform(0.1, 0.35) * thicker_towards_sun - rng.uniform(0.05, 0.45) * depth
    cloud = np.clip(lit, 0.3, 1.05)[:, :, None] * hue(rng, (0.0, 1.0), (0.0, 0.04), (0.92, 1.0))
    return over(sky, cloud, smoothstep(cover, cover + edge, form) * rng.uniform(0.85, 1.0))


def _hills(rng: np.random.Generator) -> Picture:
    picture, horizon = _weather(rng), rng.uniform(0.2, 0.7)
    haze = picture[-1].mean(axis=0)
    layers = int(rng.integers(1, 6))
    for layer in range(layers):
        nearness = (layer + 1) / layers
        line = horizon * (1 - 0.75 * (layer / layers)) + rng.uniform(0.01, 0.08) * ridge(
            rng, _COLUMNS, slope=rng.uniform(0.9, 1.8)
        )
        colour = hue(rng, (0.15, 0.45), (0.15, 0.6), (0.2, 0.5)) * (
            0.3 + 0.7 * nearness
        ) + haze * 0.7 * (1 - nearness)
        grain = fractal(rng, _ROWS, _COLUMNS, slope=rng.uniform(0.4, 1.2))
        body = (1 + 0.18 * nearness * grain)[:, :, None] * colour
        picture = over(picture, body, smoothstep(-0.004, 0.004, line - _HEIGHT))
    floor = rng.uniform(0.0, horizon * 0.6)
    return over(picture, _ground(rng), smoothstep(-0.005, 0.005, floor - _HEIGHT))


def _foliage(rng: np.random.Generator) -> Picture:
    picture = _weather(rng)
    floor = rng.uniform(-0.1, 0.25)
    picture = over(picture, _ground(rng), smoothstep(-0.005, 0.005, floor - _HEIGHT))
    season = [(0.2, 0.38), (0.05, 0.18), (0.22, 0.3)][int(rng.integers(3))]
    for _ in range(int(rng.integers(2, 9))):
        picture = _tree(rng, picture, season, floor)
    return picture


def _tree(
    rng: np.random.Generator, picture: Picture, season: tuple[float, float], floor: float
) -> Picture:
    """Paints a crown of leaves on a trunk, lit from above, in front of a picture."""
    x, z, size = rng.uniform(-0.1, 1.4), rng.uniform(floor + 0.15, 0.9), rng.uniform(0.15, 0.45)
    trunk = (
        np.abs(_X - x - 0.02 * np.sin(8 * _HEIGHT)) < 0.05 * size + 0.03 * size * (z - _HEIGHT)
    ) & (z > _HEIGHT)
    bark = hue(rng, (0.04, 0.12), (0.1, 0.5), (0.1, 0.4))
    picture = over(picture, bark, (trunk & (floor - 0.05 < _HEIGHT)).astype(np.float64))
    rough = fractal(rng, _ROWS, _COLUMNS, slope=rng.uniform(0.8, 1.2))
    leaves = fractal(rng, _ROWS, _COLUMNS, slope=rng.uniform(0.2, 0.6))
    reach = np.hypot((_X - x) / size, (_HEIGHT - z) / (size * rng.uniform(0.7, 1.5)))
    crown = smoothstep(-0.05, 0.05, 1 - reach + 0.22 * rough + 0.1 * leaves)
    light = np.clip(0.75 + 0.35 * (_HEIGHT - z) / size + 0.2 * rough + 0.22 * leaves, 0.1, 1.6)
    return over(picture, light[:, :, None] * hue(rng, season, (0.3, 0.8), (0.25, 0.6)), crown)


def _buildings(rng: np.random.Generator) -> Picture:
    picture, street = _weather(rng), rng.uniform(-0.1, 0.25)
    haze = picture[-1].mean(axis=0)
    count = int(rng.integers(3, 14))
    for index in range(count):
        distance = 0.6 * (1 - (index + 1) / count)
        picture = _house(rng, picture, distance, haze)
    return over(picture, _ground(rng), smoothstep(-0.004, 0.004, street - _HEIGHT))


def _house(
    rng: np.random.Generator, picture: Picture, distance: float, haze: FloatArray
) -> Picture:
    """Paints a façade with rows of windows, some lit, some mirroring the sky, in front of a
    picture."""
    left, width, top = (
        rng.uniform(-0.2, 1.2),
        rng.uniform(0.12, 0.6),
        rng.uniform(0.25, 1.05) * (1 - 0.4 * distance),
    )
    first, last = np.searchsorted(_X[0], [left, left + width])
    highest = int(np.searchsorted(-_HEIGHT[:, 0], -top))
    part = (slice(highest, None), slice(int(first), int(last)))
    if last <= first or highest >= _ROWS:
        return picture
    x, height = _X[part], _HEIGHT[part]
    wall = hue(rng, *_WALLS[int(rng.random() < 0.3)])
    storey, bay = rng.uniform(0.03, 0.1), rng.uniform(0.025, 0.1)
    row, column = np.floor((top - height) / storey), np.floor((x - left) / bay)
    down, along = (top - height) / storey - row, (x - left) / bay - column
    high, wide = rng.uniform(0.3, 0.8), rng.uniform(0.3, 0.85)
    pane = (np.abs(down - 0.5) < high / 2) & (np.abs(along - 0.5) < wide / 2)
    states = rng.uniform(0.0, 1.0, (64, 64))[
        row.astype(np.int64) % 64, column.astype(np.int64) % 64
    ]
    glass = over(
        np.broadcast_to(hue(rng, (0.5, 0.65), (0.05, 0.4), (0.1, 0.5)), (*x.shape, 3)),
        haze,
        0.8 * smoothstep(0.55, 0.95, states),
    )
    shade = (
        1 + 0.05 * fractal(rng, *x.shape, slope=rng.uniform(0.5, 1.2))
        if min(x.shape) > 1
        else np.ones(x.shape)
    )
    shade *= 1 - rng.uniform(0.0, 0.25) * (down < 0.08)
    shade *= 1 - rng.uniform(0.0, 0.4) * (x > left + width * 0.97)
    front = over(shade[:, :, None] * wall, glass, pane.astype(np.float64))
    result = picture.copy()
    result[part] = front * (1 - distance) + haze * distance
    return result


def _photograph(
    paint: Callable[[np.random.Generator], Picture],
) -> Callable[[np.random.Generator], Picture]:
    """Wraps a painter so that its picture gets a focus, a tint, a contrast and a side of its
    own."""

    def paint_and_expose(rng: np.random.Generator) -> Picture:
        picture = np.clip(paint(rng), 0.0, 1.2)
        if rng.random() < 0.6:
            picture = defocus(picture, rng.uniform(0.3, 3.0))
        picture = picture * (1 + rng.uniform(-0.06, 0.06, 3)) * rng.uniform(0.8, 1.15)
        picture = 0.5 + (picture - 0.5) * rng.uniform(0.75, 1.2)
        return picture[:, ::-1] if rng.random() < 0.5 else picture

    return paint_and_expose


SKY = Seeded(kind="sky", paint=_photograph(_sky))
CLOUDS = Seeded(kind="clouds", paint=_photograph(_clouds))
HILLS = Seeded(kind="hills", paint=_photograph(_hills))
FOLIAGE = Seeded(kind="foliage", paint=_photograph(_foliage))
BUILDINGS = Seeded(kind="buildings", paint=_photograph(_buildings))
