"""Contact sheets, to be looked at: what the rasteriser makes of simulated flags and hanging cloth, and the assets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image, ImageOps

from flagdata.lake.meshes import MeshSequence
from flagdata.rng import stream
from flagdata.timebase import NANOSECONDS
from sim.assets import BACKGROUNDS, TEXTURES, Assets
from sim.assets.flags import FLAGS
from sim.contact import Contact
from sim.integrate.symplectic import Symplectic
from sim.material import Material
from sim.material import named as material
from sim.render import Meshes
from sim.render.prior import named as prior
from sim.render.raster import Raster
from sim.scene import Scene, assemble, flag, hanging_cloth

FRAME = 0.04  # s
SETTLE = 50  # frames before the first that is shown
ACROSS = 6
TILE = (240, 160)  # px, of the assets


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Writes `raster-flags.jpg`, `raster-cloth.jpg`, `assets.jpg` into the folder `pictures` beside `out`."""
    folder = out.parent / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    rng = stream(seed, "pictures")
    flags = [flag(material=_drawn(rng), wind_speed=float(speed), columns=40) for speed in np.linspace(1.5, 9.0, 8)]
    cloths = [hanging_cloth(material=_drawn(rng), wind=_wind(rng), columns=24) for _ in range(4)]
    moving = {
        "flags": [Meshes.flag(sequence, heading=0.0) for sequence in _simulated(flags)],
        "cloth": [Meshes.hanging(sequence) for sequence in _simulated(cloths)],
    }
    for name, sequences in moving.items():
        count = 4 * ACROSS if name == "flags" else 2 * ACROSS
        zetas = [prior(name).draw(seed * 1000 + index, Assets()) for index in range(count)]
        tiles = [Raster().render(sequences[i % len(sequences)], zeta)[0].numpy() for i, zeta in enumerate(zetas)]
        _sheet(tiles, across=ACROSS).save(folder / f"raster-{name}.jpg", quality=88)
    names = [f"flag/{name}" for name in sorted(FLAGS)]
    names += [f"{kind}/{seed + i}" for kind in TEXTURES if kind != "flag" for i in range(3)]
    backgrounds = [f"{kind}/{seed + i}" for kind in BACKGROUNDS for i in range(ACROSS)]
    tiles = [*map(Assets().texture, names), *map(Assets().background, backgrounds)]
    _sheet([_tile(tile) for tile in tiles], across=ACROSS).save(folder / "assets.jpg", quality=88)
    return {"pictures": ["raster-flags.jpg", "raster-cloth.jpg", "assets.jpg"], "assets": [*names, *backgrounds]}


def _drawn(rng: np.random.Generator) -> Material:
    """Ponte Roma in the paper's search space: 0.10 to 0.17 kg/m², bending times 0.1 to 10."""
    base = material("camel-ponte-roma")
    return base.scaled(density=rng.uniform(0.10, 0.17) / base.density, bending=float(10 ** rng.uniform(-1, 1)))


def _wind(rng: np.random.Generator) -> tuple[float, float]:
    x, y = rng.uniform(-3.0, 3.0, 2)
    return float(x), float(y)


def _simulated(scenes: Sequence[Scene]) -> list[MeshSequence]:
    """Two frames of each scene, after it has settled."""
    mesh, kept = scenes[0].mesh, []
    with torch.no_grad():
        system, state = assemble([_with_contact(scene) for scene in scenes])
        for frame in range(SETTLE + 2):
            state = Symplectic().advance(system, state, FRAME)
            if frame >= SETTLE:
                kept.append(state.position.numpy().copy())
    return [
        MeshSequence(
            time=np.arange(2, dtype=np.int64) * round(FRAME * NANOSECONDS),
            positions=np.stack([frame[..., member] for frame in kept]), faces=mesh.faces.astype(np.int32),
            rest=mesh.rest.astype(np.float32),
        )
        for member in range(len(scenes))
    ]  # fmt: skip


def _with_contact(scene: Scene) -> Scene:
    return replace(scene, contact=Contact(thickness=0.01))


def _tile(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The middle of a picture, as large as fits, in a tile of 3:2."""
    return np.asarray(ImageOps.fit(Image.fromarray(image), TILE, Image.Resampling.LANCZOS))


def _sheet(tiles: Sequence[NDArray[np.uint8]], *, across: int) -> Image.Image:
    rows = [np.concatenate(tiles[i : i + across], axis=1) for i in range(0, len(tiles), across)]
    return Image.fromarray(np.concatenate(rows))
