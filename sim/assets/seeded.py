"""Procedural pictures: a kind draws its members from seeds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.core.numbered import read_bounded
from flagdata.core.rng import stream
from flagdata.errors import InputError
from flagdata.recipes.typed_tables import SEED_LIMIT


@dataclass(frozen=True, kw_only=True)
class Seeded:
    """Pictures that follow from a seed.

    Attributes:
        kind: the name of the kind, which is part of the stream's.
        paint: makes linear-free sRGB values (height, width, 3) in [0, 1] from a generator.
    """

    kind: str
    paint: Callable[[np.random.Generator], FloatArray]

    def draw(self, rng: np.random.Generator) -> str:
        return str(int(rng.integers(2**31)))

    def image(self, member: str) -> UInt8Array:
        """Paints the picture of a seed.

        Raises:
            InputError: the member is no seed.
        """
        seed = read_bounded(member, most=SEED_LIMIT)
        if seed is None:
            raise InputError(
                f"{member!r} is no seed",
                where=f"{self.kind}/…",
                fix=f"write {self.kind}/ and a number",
            )
        values = self.paint(stream(seed, "assets", self.kind))
        return np.rint(np.clip(values, 0.0, 1.0) * 255).astype(np.uint8)
