"""The 17 parameters of the paper's search space, normalised to [−1, 1], and what is reported of them.

Runia et al. 2020, table 1: 15 bending coefficients, each a tenth to ten times its material's, area weight and wind
speed. Bending is searched in logarithms, so that the centre is the material itself; its prior is what the scene's
recipe draws, which may be uniform in the factor. Single bending coefficients can hardly be told apart, so that three
combinations of their logarithms are reported: scale, anisotropy and nonlinearity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import InputError
from flagdata.provenance import canonical, digest
from flagdata.tables import Range, Scale, plain
from sim.material import BENDING_SHAPE, Material
from sim.run.recipe import Recipe, Shape

BENDING = BENDING_SHAPE[0] * BENDING_SHAPE[1]
DENSITY, WIND = BENDING, BENDING + 1
DIMENSION = BENDING + 2
"""Of θ: bending coefficients 0 to 14 (three directions of five curvatures), density, wind speed."""


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A quantity that is reported.

    Attributes:
        name: as in tables.
        unit: SI.
        about: in words.
        digits: that are shown behind the point.
    """

    name: str
    unit: str
    about: str
    digits: int


QUANTITIES = (
    Quantity(name="wind_speed", unit="m/s", about="wind speed", digits=2),
    Quantity(name="density", unit="kg/m²", about="area weight", digits=3),
    Quantity(name="bending_scale", unit="log10(N·m)", about="mean logarithm of the bending coefficients", digits=2),
    Quantity(
        name="anisotropy", unit="1", digits=2,
        about="mean logarithm of the coefficients along the warp less that of those along the weft",
    ),
    Quantity(
        name="nonlinearity", unit="1", digits=2,
        about="mean logarithm of the coefficients at the two largest curvatures less that at the two smallest",
    ),
)  # fmt: skip
"""What a refinement reports; the first two have the paper's ranges."""
_ROWS, _COLUMNS = BENDING_SHAPE


@dataclass(frozen=True, kw_only=True, eq=False)
class Space:
    """The box that is searched.

    Attributes:
        material: whose bending coefficients are multiplied.
        factor: of each bending coefficient; the scale is the prior's, coordinates are logarithmic.
        density: [kg/m²].
        wind: [m/s].
    """

    material: Material
    factor: Range
    density: Range
    wind: Range

    @classmethod
    def of(cls, recipe: Recipe) -> Space:
        """The ranges of a scene's recipe.

        Raises:
            InputError: a recipe that has no such ranges, several materials, effects, or another scene than a flag.
        """
        spec, speed = recipe.material, recipe.wind.speed
        factor, density, wind = spec.bending_each, spec.density, speed
        alone = len(spec.bases) == 1 and not recipe.effects and recipe.scene.shape is Shape.FLAG
        if not (
            isinstance(factor, Range) and isinstance(density, Range) and isinstance(wind, Range)
            and alone and spec.bending == 1.0 and factor.low > 0
        ):  # fmt: skip
            raise InputError(
                "the scene is not a flag of one material with ranges of bending factors (above 0), density and wind",
                where=f"recipe {recipe.name!r}", fix='take "flag-wide", or a recipe of the same form',
            )  # fmt: skip
        return cls(material=spec.bases[0], factor=factor, density=density, wind=wind)

    @property
    def ranges(self) -> tuple[Range, ...]:
        """Of each of the 17 parameters, in SI."""
        table = self.material.bending.ravel().tolist()
        bending = [Range(low=k * self.factor.low, high=k * self.factor.high, scale=Scale.LOG) for k in table]
        return (*bending, self.density, self.wind)

    def values(self, unit: NDArray[np.float64]) -> NDArray[np.float64]:
        """SI values of points (n, 17) of [−1, 1]¹⁷.

        Raises:
            InputError: points of another shape, or outside.
        """
        if unit.ndim != 2 or unit.shape[1] != DIMENSION or not (np.abs(unit) <= 1 + 1e-9).all():
            raise InputError(
                f"points of shape {unit.shape}, or outside of [-1, 1]", fix=f"give (n, {DIMENSION}) within [-1, 1]"
            )
        share = np.clip((unit + 1) / 2, 0.0, 1.0)
        columns = [[entry.at(float(value)) for value in share[:, i]] for i, entry in enumerate(self.ranges)]
        return np.array(columns, dtype=np.float64).T.reshape(len(unit), DIMENSION)

    def unit(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (n, 17) of [−1, 1]¹⁷ of SI values; those outside of the box are moved to its edge."""
        out = np.empty_like(values, dtype=np.float64)
        for i, entry in enumerate(self.ranges):
            low, high, own = entry.low, entry.high, values[:, i]
            if entry.scale is Scale.LOG:
                low, high, own = np.log(low), np.log(high), np.log(own)
            out[:, i] = 2 * (own - low) / (high - low) - 1
        return np.clip(out, -1.0, 1.0)

    def prior(self, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Points (count, 17) of the prior: what the scene's recipe draws."""
        shares = rng.random((count, DIMENSION))
        if self.factor.scale is Scale.LINEAR:
            low, high = self.factor.low, self.factor.high
            drawn = np.log(low + shares[:, :BENDING] * (high - low))
            shares[:, :BENDING] = (drawn - np.log(low)) / (np.log(high) - np.log(low))
        return 2 * shares - 1

    def reported(self, unit: NDArray[np.float64]) -> NDArray[np.float64]:
        """The `QUANTITIES` of points (n, 17): (n, quantity), in their units."""
        values = self.values(unit)
        logs = np.log10(values[:, :BENDING]).reshape(-1, _ROWS, _COLUMNS)
        return np.stack(
            [
                values[:, WIND],
                values[:, DENSITY],
                logs.mean(axis=(1, 2)),
                logs[:, 0].mean(axis=1) - logs[:, -1].mean(axis=1),
                logs[:, :, -2:].mean(axis=(1, 2)) - logs[:, :, :2].mean(axis=(1, 2)),
            ],
            axis=1,
        )

    @property
    def identity(self) -> str:
        """A hash of all of it."""
        ranges = [plain(entry) for entry in (self.factor, self.density, self.wind)]
        return digest(canonical({"material": self.material.fingerprint, "ranges": ranges}))
