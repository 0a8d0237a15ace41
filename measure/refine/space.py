"""The 17 parameters of the paper's search space, normalised to [−1, 1], and what is reported of
them.

Runia et al. 2020, table 1: 15 bending coefficients, each a tenth to ten times its material's, area
weight and wind speed. Bending is searched in logarithms, so that the centre is the material itself;
its prior is what the scene's recipe draws, which may be uniform in the factor, or a mixture of what
several draw. Single bending coefficients can hardly be separated, so that three combinations of
their logarithms are reported: scale, anisotropy and nonlinearity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.core.json_values import json_values
from flagdata.core.provenance import canonical, digest
from flagdata.errors import InputError
from flagdata.recipes.typed_tables import Range, Scale
from sim.cloth.material import BENDING_SHAPE, Material
from sim.run.simulation_recipe import Recipe, Shape

BENDING = BENDING_SHAPE[0] * BENDING_SHAPE[1]
AREA_WEIGHT_COLUMN, WIND_COLUMN = BENDING, BENDING + 1
"""Columns of θ."""
DIMENSION = BENDING + 2
"""Length of θ: bending coefficients 0 to 14 (three directions of five curvatures), area weight,
wind speed."""


@dataclass(frozen=True, kw_only=True)
class ReportedQuantity:
    """A quantity that is reported.

    Attributes:
        name: as in tables.
        unit: SI; log10(…) for a logarithm.
        about: in words.
        digits: shown after the decimal point.
    """

    name: str
    unit: str
    about: str
    digits: int


QUANTITIES = (
    ReportedQuantity(name="wind_speed", unit="m/s", about="wind speed", digits=2),
    ReportedQuantity(name="area_weight", unit="kg/m²", about="area weight", digits=3),
    ReportedQuantity(
        name="bending_scale",
        unit="log10(N·m)",
        about="mean logarithm of the bending coefficients",
        digits=2,
    ),
    ReportedQuantity(
        name="anisotropy",
        unit="1",
        digits=2,
        about="mean logarithm of the coefficients along the warp less that of those along the weft",
    ),
    ReportedQuantity(
        name="nonlinearity",
        unit="1",
        digits=2,
        about="mean logarithm of the coefficients at the two largest curvatures less that at the "
        "two smallest",
    ),
)
"""What a refinement reports; the first two have the paper's ranges."""
_ROWS, _COLUMNS = BENDING_SHAPE
_REACH = 6.5
_SHARES = (np.arange(10_000) + 0.5) / 10_000


@dataclass(frozen=True, kw_only=True, eq=False)
class Space:
    """The box that is searched.

    Attributes:
        material: whose bending coefficients are multiplied.
        factor: range of each bending coefficient's factor. Its scale is that of the prior; the
            search is always logarithmic.
        common: of all bending coefficients together, likewise; None where there is none.
        area_weight: [kg/m²].
        wind: [m/s].
        parts: the prior as a mixture of the priors of smaller boxes, each with its weight; without
            any it is what the ranges say. What is searched is the whole box either way.
    """

    material: Material
    factor: Range
    area_weight: Range
    wind: Range
    common: Range | None = None
    parts: tuple[tuple[Space, float], ...] = ()

    @classmethod
    def of(cls, recipe: Recipe) -> Space:
        """Makes the space of a scene's recipe.

        Raises:
            InputError: a recipe that has no such ranges, or ranges of anything else but the
                damping; several materials, effects, or another scene than a flag.
        """
        spec, speed = recipe.material, recipe.wind.speed
        factor, area_weight, wind = spec.bending_each, spec.area_weight, speed
        common = spec.bending if isinstance(spec.bending, Range) else None
        alone = len(spec.bases) == 1 and not recipe.effects and recipe.scene.shape is Shape.FLAG
        alone &= not any(
            isinstance(q, Range)
            for q in (spec.area_weight_factor, spec.stretching, recipe.wind.toward)
        )
        if not (
            isinstance(factor, Range)
            and isinstance(area_weight, Range)
            and isinstance(wind, Range)
            and alone
            and ((common is not None and common.low > 0) or spec.bending == 1.0)
            and factor.low > 0
        ):
            raise InputError(
                "the scene is no flag of one material with ranges of bending factors (above 0), "
                "area weight and wind",
                where=f"recipe {recipe.name!r}",
                fix='take "flag-wide", or a recipe of the same form',
            )
        return cls(
            material=spec.bases[0], factor=factor, area_weight=area_weight, wind=wind, common=common
        )

    def learned(self, parts: Sequence[tuple[Space, float]]) -> Space:
        """Returns the same box under the prior that a model learned from data sets of several
        scenes.

        Args:
            parts: of each scene its box, and how much of the data shows it.

        Raises:
            InputError: a part that reaches out of this box, or weights that are not positive.
        """
        for part, weight in parts:
            inner = all(
                box_range.low <= part_range.low * (1 + 1e-9)
                and part_range.high * (1 - 1e-9) <= box_range.high
                for part_range, box_range in zip(part.ranges, self.ranges, strict=True)
            )
            if weight <= 0 or not inner:
                raise InputError(
                    f"a part of the prior with the weight {weight:g}"
                    + ("" if inner else " reaches out of the box"),
                    fix="give positive weights, and as the box a scene whose ranges include those "
                    "of all others",
                )
        return replace(self, parts=tuple(parts))

    @property
    def ranges(self) -> tuple[Range, ...]:
        """The range of each of the 17 parameters, in SI."""
        table = self.material.bending.ravel().tolist()
        low, high = self._factors
        bending = [Range(low=k * low, high=k * high, scale=Scale.LOG) for k in table]
        return (*bending, self.area_weight, self.wind)

    @property
    def _factors(self) -> tuple[float, float]:
        """Smallest and largest factor of a bending coefficient."""
        low, high = self.factor.low, self.factor.high
        return (
            (low, high) if self.common is None else (low * self.common.low, high * self.common.high)
        )

    @property
    def start_ranges(self) -> tuple[Range, Range, Range, Range]:
        """Returns ranges of wind, area weight, bending scale and anisotropy: of the latter two the
        prior's mean and `_REACH` of its standard deviations either way, within the box."""
        table = np.log10(self.material.bending)
        logs = np.log10(_drawn(self.factor, _SHARES))
        common = np.zeros(1) if self.common is None else np.log10(_drawn(self.common, _SHARES))
        scale = _REACH * float(np.sqrt(logs.var() / BENDING + common.var()))
        slope = _REACH * float(np.sqrt(2 * logs.var() / _COLUMNS))
        middle, tilt = (
            float(table.mean() + logs.mean() + common.mean()),
            float(table[0].mean() - table[-1].mean()),
        )
        low, high = (float(end) for end in np.log10(self._factors))
        least, most = float(table.mean()) + low, float(table.mean()) + high
        slope = min(slope, high - low)
        return (
            self.wind,
            self.area_weight,
            Range(low=max(middle - scale, least), high=min(middle + scale, most)),
            Range(low=tilt - slope, high=tilt + slope),
        )

    def values(self, unit: FloatArray) -> FloatArray:
        """Converts points (n, 17) of [−1, 1]¹⁷ to SI values.

        Raises:
            InputError: points of another shape, or outside.
        """
        if unit.ndim != 2 or unit.shape[1] != DIMENSION or not (np.abs(unit) <= 1 + 1e-9).all():
            raise InputError(
                f"the points have the shape {unit.shape}, or lie outside of [-1, 1]",
                fix=f"give (n, {DIMENSION}) within [-1, 1]",
            )
        share = np.clip((unit + 1) / 2, 0.0, 1.0)
        columns = [
            [entry.at(float(value)) for value in share[:, i]] for i, entry in enumerate(self.ranges)
        ]
        return np.array(columns, dtype=np.float64).T.reshape(len(unit), DIMENSION)

    def unit(self, values: FloatArray) -> FloatArray:
        """Converts SI values to points (n, 17) of [−1, 1]¹⁷; those outside of the box are moved to
        its edge."""
        out = np.empty_like(values, dtype=np.float64)
        for i, entry in enumerate(self.ranges):
            low, high, column = entry.low, entry.high, values[:, i]
            if entry.scale is Scale.LOG:
                low, high, column = np.log(low), np.log(high), np.log(column)
            out[:, i] = 2 * (column - low) / (high - low) - 1
        return np.clip(out, -1.0, 1.0)

    def prior(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Points (count, 17) of the prior: what the scenes' recipes draw."""
        if self.parts:
            weight = np.array([weight for _, weight in self.parts])
            chosen = rng.choice(len(self.parts), size=count, p=weight / weight.sum())
            out = np.empty((count, DIMENSION))
            for number, (part, _) in enumerate(self.parts):
                rows = np.flatnonzero(chosen == number)
                out[rows] = self.unit(part.values(part.prior(rng, len(rows))))
            return out
        shares = rng.random((count, DIMENSION))
        drawn = np.log(_drawn(self.factor, shares[:, :BENDING]))
        if self.common is not None:
            drawn += np.log(_drawn(self.common, rng.random((count, 1))))
        low, high = np.log(self._factors)
        shares[:, :BENDING] = (drawn - low) / (high - low)
        return np.clip(2 * shares - 1, -1.0, 1.0)

    def reported_quantities(self, unit: FloatArray) -> FloatArray:
        """Computes the `QUANTITIES` of points (n, 17): (n, quantity), in their units."""
        values = self.values(unit)
        logs = np.log10(values[:, :BENDING]).reshape(-1, _ROWS, _COLUMNS)
        return np.stack(
            [
                values[:, WIND_COLUMN],
                values[:, AREA_WEIGHT_COLUMN],
                logs.mean(axis=(1, 2)),
                logs[:, 0].mean(axis=1) - logs[:, -1].mean(axis=1),
                logs[:, :, -2:].mean(axis=(1, 2)) - logs[:, :, :2].mean(axis=(1, 2)),
            ],
            axis=1,
        )

    @property
    def identity(self) -> str:
        """A hash of the box; the prior within it changes no evaluation."""
        ranges = [json_values(entry) for entry in (self.factor, self.area_weight, self.wind)]
        ranges += [] if self.common is None else [json_values(self.common)]
        return digest(canonical({"material": self.material.fingerprint, "ranges": ranges}))


def _drawn(entry: Range, shares: FloatArray) -> FloatArray:
    """Values of a range at shares of it."""
    if entry.scale is Scale.LINEAR:
        return entry.low + shares * (entry.high - entry.low)
    return np.exp(np.log(entry.low) + shares * (np.log(entry.high) - np.log(entry.low)))
