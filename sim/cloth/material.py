"""Cloth materials: area weight, measured stretching and bending tables, internal damping.

The tables are those of Wang, O'Brien and Ramamoorthi (ACM TOG 30(4):71, 2011); how they are
evaluated is in `sim.cloth.stiffness_tables`. Catalog entries are TOML files of
`catalogs/materials`, with their source beside the numbers.
"""

from __future__ import annotations

import functools
import hashlib
import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError
from flagdata.recipes.retired_names import with_present_keys
from flagdata.recipes.shelves import Shelf, parse_recipe

STRETCHING_SHAPE = (6, 4)
BENDING_SHAPE = (3, 5)
HEAVIEST = 20.0
"""Area weight that no cloth has [kg/m²], 2.5 mm of steel: what is above it was meant in g/m²."""
MATERIALS = Shelf(folder="materials", noun="material")


@dataclass(frozen=True, kw_only=True)
class Material:
    """One cloth.

    Attributes:
        name: what errors and reports call it.
        source: where the numbers are from.
        area_weight: mass per rest area [kg/m²].
        stretching: (6, 4) [N/m]; columns k0 (uu·uu), k1 (uu·vv), k2 (vv·vv), k3 (uv·uv); row 0 at
            zero strain, rows 1–5 at full strain with the larger principal strain at 0, 22.5, 45,
            67.5 and 90° from u.
        bending: (3, 5) [N·m]; rows for edges at 0, 45, 90° from u; columns at curvature 0, 5, 10,
            15, 20 1/m.
        damping: d [s], stiffness-proportional (Kelvin–Voigt): the strain E is replaced by E + d
            dE/dt in the elastic forces. The default, 0.25 ms, follows the reference simulator's 0.5
            ms runs to the millimetre over the first frames (backward Euler with step h damps slow
            modes as d = h does).

    Raises:
        InputError: wrong shapes, values that are not finite, an area weight that is not positive,
            negative damping, negative bending stiffness, or a direct stiffness (k0, k2 of a row)
            that is negative.
    """

    name: str
    source: str
    area_weight: float
    stretching: FloatArray
    bending: FloatArray
    damping: float = 0.25e-3

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "stretching", self._table(self.stretching, STRETCHING_SHAPE, "stretching")
        )
        object.__setattr__(self, "bending", self._table(self.bending, BENDING_SHAPE, "bending"))
        if not (math.isfinite(self.area_weight) and self.area_weight > 0):
            raise self._error(
                f"area weight {self.area_weight!r} is not positive",
                "give the mass per area in kg/m²",
            )
        if self.area_weight > HEAVIEST:
            raise self._error(
                f"area weight {self.area_weight:g} kg/m² is above {HEAVIEST:g} kg/m²",
                "give kg/m² (100 g/m² is 0.1)",
            )
        if not (math.isfinite(self.damping) and self.damping >= 0):
            raise self._error(
                f"damping {self.damping!r} is negative or not finite",
                "give d in seconds, 0 for none",
            )
        if self.bending.min() < 0:
            raise self._error("a bending stiffness is negative", "give N·m, all at least 0")
        if self.stretching[:, [0, 2]].min() < 0:
            raise self._error(
                "a direct stretching stiffness (k0 or k2) is negative", "give N/m, all at least 0"
            )

    def _error(self, message: str, fix: str) -> InputError:
        return InputError(message, where=f"material {self.name!r}", fix=fix)

    def _table(self, values: ArrayLike, shape: tuple[int, int], table_name: str) -> FloatArray:
        try:
            table = np.array(values, dtype=np.float64)
        except (TypeError, ValueError, OverflowError) as error:
            raise self._error(
                f"{table_name} is not a table of numbers", f"give {shape[0]} rows of {shape[1]}"
            ) from error
        if table.shape != shape:
            raise self._error(
                f"{table_name} has shape {table.shape}", f"give {shape[0]} rows of {shape[1]}"
            )
        if not np.isfinite(table).all():
            raise self._error(
                f"{table_name} holds a value that is not finite", "give finite numbers"
            )
        table.setflags(write=False)
        return table

    @classmethod
    def from_mapping(cls, content: Mapping[str, Any], *, name: str) -> Material:
        """Makes a material from a parsed catalog file.

        Raises:
            InputError: missing, unknown or ill-typed keys.
        """
        where = f"material {name!r}"
        content = with_present_keys(content, where=where)
        keys = {"title", "source", "area-weight", "stretching", "bending", "damping"}
        unknown = sorted(set(content) - keys)
        missing = sorted({"source", "area-weight", "stretching", "bending"} - set(content))
        if unknown:
            raise InputError(
                f"these keys are unknown: {', '.join(unknown)}",
                where=where,
                fix=f"known: {', '.join(sorted(keys))}",
            )
        if missing:
            raise InputError(
                f"these keys are missing: {', '.join(missing)}", where=where, fix="add them"
            )
        numbers = {key: content[key] for key in ("area-weight", "damping") if key in content}
        wrong = [key for key, value in numbers.items() if not _is_number(value)]
        if wrong:
            raise InputError(
                f"{', '.join(wrong)} must be a number", where=where, fix="write it without quotes"
            )
        return cls(
            name=name,
            source=str(content["source"]),
            stretching=content["stretching"],
            bending=content["bending"],
            **{key.replace("-", "_"): float(value) for key, value in numbers.items()},
        )

    @functools.cached_property
    def fingerprint(self) -> str:
        """SHA-256 of area weight and tables: the same of materials that differ by damping and names
        alone."""
        numbers = [np.array([self.area_weight]), self.stretching, self.bending]
        return hashlib.sha256(b"".join(n.astype("<f8").tobytes() for n in numbers)).hexdigest()

    def scaled(
        self, *, area_weight: float = 1.0, stretching: float = 1.0, bending: float = 1.0
    ) -> Material:
        """Multiplies this material's area weight and tables."""
        return replace(
            self,
            area_weight=self.area_weight * area_weight,
            stretching=self.stretching * stretching,
            bending=self.bending * bending,
        )


def _is_number(value: Any) -> bool:
    return (
        isinstance(value, int | float)
        and not isinstance(value, bool)
        and abs(value) <= sys.float_info.max
    )


def isotropic(
    *,
    name: str,
    area_weight: float,
    stretching: float,
    shear: float,
    bending: float,
    damping: float = 0.0,
) -> Material:
    """Makes a sheet of constant stiffness without Poisson effect, for comparison with closed forms.

    Args:
        area_weight: [kg/m²].
        stretching: membrane stiffness Y h of the force per width [N/m], as it acts (the tables'
            factor 2 is taken out).
        shear: coefficient k3 of the shear term 2 k3 G01², as it acts [N/m].
        bending: flexural rigidity B of the tables [N·m].
        damping: d [s].
    """
    row = [stretching / 2, 0.0, stretching / 2, shear / 2]
    return Material(
        name=name,
        source="constant stiffness",
        area_weight=area_weight,
        damping=damping,
        stretching=np.tile(row, (6, 1)),
        bending=np.full(BENDING_SHAPE, bending),
    )


@functools.cache
def named_material(name: str, *, where: str | None = None) -> Material:
    """Reads a material of the catalog.

    Args:
        where: the name stands, for the error message.

    Raises:
        UnknownNameError: with the nearest name that is there.
    """
    entry = MATERIALS.named(name, where=where)
    return Material.from_mapping(parse_recipe(entry.text, where=entry.where), name=name)
