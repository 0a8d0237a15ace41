"""What render parameters are drawn from: a catalog file of ranges with their sources, one named
stream a parameter."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from flagdata.core.json_values import json_values
from flagdata.core.rng import stream
from flagdata.errors import InputError, UnknownNameError
from flagdata.recipes.shelves import Shelf, parse_recipe
from flagdata.recipes.typed_tables import (
    DEGREES,
    NotNegative,
    Quantity,
    Range,
    ends,
    entries,
    in_radians,
)
from sim.assets import Assets
from sim.render.parameters import RenderParameters

PRIORS = Shelf(folder="renders", noun="render prior")


@dataclass(frozen=True, kw_only=True)
class RenderPrior:
    """Ranges of ζ.

    Attributes:
        name: of the catalog file.
        quantities: parameter → fixed value or range, in the parameter's own unit; the others keep
            their default.
        sources: parameter → where its range is from.
        textures, backgrounds: kinds of which each draw takes one with equal chance, then one of
            that kind.
        least_angle: between the heading and the camera's axis, taken as lines [rad]; draws below it
            are drawn again. The camera does not look from upwind or downwind.

    Raises:
        InputError: a range outside of what is admissible, camera angles that all break the rule, no
            kinds.
        UnknownNameError: a quantity that ζ does not have.
    """

    name: str
    quantities: Mapping[str, Quantity]
    sources: Mapping[str, str]
    textures: tuple[str, ...]
    backgrounds: tuple[str, ...]
    least_angle: float = 0.0

    def __post_init__(self) -> None:
        where = f"render prior {self.name!r}"
        described = RenderParameters.described()
        for name, quantity in self.quantities.items():
            if name not in described:
                raise UnknownNameError.of("render parameter", name, described, where=where)
            low, high = ends(quantity)
            if low < described[name].least or high > described[name].most:
                raise InputError(
                    f"{name} ranges from {low:g} to {high:g} {described[name].unit}",
                    where=where,
                    fix=f"stay within {described[name].least:g} to {described[name].most:g}",
                )
        low, high = ends(self.quantities.get("camera_angle", RenderParameters.camera_angle))
        across = math.floor(high / math.pi - 0.5) >= math.ceil(low / math.pi - 0.5)
        widest = math.pi / 2 if across else max(_to_line(low), _to_line(high))
        if widest < self.least_angle or (widest == self.least_angle > 0 and low < high):
            raise InputError(
                f"no camera angle is {math.degrees(self.least_angle):g}° or more from the heading",
                where=where,
                fix="widen the range of camera-angle, or lower least-angle",
            )
        for noun, kinds in (("textures", self.textures), ("backgrounds", self.backgrounds)):
            if not kinds:
                raise InputError(
                    f"the prior has no {noun}", where=where, fix="name at least one kind"
                )

    def draw(self, seed: int, assets: Assets) -> RenderParameters:
        """Draws one ζ. Each parameter has a stream of its own, so that changing one range moves no
        other parameter.

        Raises:
            UnknownNameError: a kind of texture or background that the assets do not have.
        """
        numbers: dict[str, Any] = {}
        for name, quantity in self.quantities.items():
            rng = stream(seed, "render", name)
            value = _at(quantity, rng.random())
            while (
                name == "camera_angle"
                and _to_line(value) < self.least_angle
                and isinstance(quantity, Range)
            ):
                value = _at(quantity, rng.random())
            is_integer = isinstance(getattr(RenderParameters, name), int)
            numbers[name] = round(value) if is_integer else value
        texture, background = (
            stream(seed, "render", "texture"),
            stream(seed, "render", "background"),
        )
        return RenderParameters(
            texture=assets.draw_texture(self.textures, texture),
            background=assets.draw_background(self.backgrounds, background),
            **numbers,
        )

    def with_quantities(self, changes: Mapping[str, Quantity], *, source: str) -> RenderPrior:
        """Replaces some quantities of this prior, and where the new ones are from.

        Raises:
            InputError, UnknownNameError: as the class.
        """
        return replace(
            self,
            quantities={**self.quantities, **changes},
            sources={**self.sources, **dict.fromkeys(changes, source)},
        )

    def identity(self) -> dict[str, Any]:
        """Returns all that shapes a draw beside its seed and the assets, as JSON."""
        return {
            "quantities": json_values(self.quantities),
            "textures": list(self.textures),
            "backgrounds": list(self.backgrounds),
            "least_angle": self.least_angle,
        }


def named_prior(name: str) -> RenderPrior:
    """Reads a render prior of the catalog.

    Raises:
        UnknownNameError: with the nearest name that is there.
    """
    entry = PRIORS.named(name)
    return read(parse_recipe(entry.text, where=entry.where), name=name)


def read(content: Mapping[str, Any], *, name: str) -> RenderPrior:
    """Makes a prior from a parsed file: `title`, `least-angle-deg`, `textures`, `backgrounds`, and
    any number of tables of quantities, each with the `source` of its ranges. Keys are ζ's names in
    kebab-case; angles end in `-deg`.

    Raises:
        InputError: missing, unknown or ill-typed entries, or a parameter that is given twice.
    """
    where = f"render prior {name!r}"
    sections = {key: section for key, section in content.items() if key not in _GENERAL}
    general = entries(
        _GENERAL, {key: value for key, value in content.items() if key in _GENERAL}, where=where
    )
    described = RenderParameters.described()
    keys = {
        key: key.replace("_", "-") + (DEGREES if entry.unit == "rad" else "")
        for key, entry in described.items()
    }
    quantities: dict[str, Quantity] = {}
    sources: dict[str, str] = {}
    for section, part in sections.items():
        inside = f"{where} [{section}]"
        values = entries(
            {"source": str, **dict.fromkeys(keys.values(), Quantity)}, part, where=inside
        )
        source = values.pop("source", None)
        if not source:
            raise InputError(
                "no source is given",
                where=inside,
                fix='say where the ranges are from: source = "…"',
            )
        for parameter, key in keys.items():
            if key not in values:
                continue
            if parameter in quantities:
                raise InputError(f"{key} is given twice", where=inside, fix="keep one")
            quantities[parameter] = (
                in_radians(values[key]) if key.endswith(DEGREES) else values[key]
            )
            sources[parameter] = source
    return RenderPrior(
        name=name,
        quantities=quantities,
        sources=sources,
        textures=general.get("textures", ()),
        backgrounds=general.get("backgrounds", ()),
        least_angle=math.radians(general.get("least-angle-deg", 0.0)),
    )


_GENERAL = {
    "title": str,
    "least-angle-deg": NotNegative,
    "textures": tuple[str, ...],
    "backgrounds": tuple[str, ...],
}
"""Keys of a prior beside its tables of quantities."""


def _at(quantity: Quantity, share: float) -> float:
    return quantity.at(share) if isinstance(quantity, Range) else quantity


def _to_line(angle: float) -> float:
    """Computes the angle to the nearest multiple of π, in [0, π/2]."""
    return abs(math.remainder(angle, math.pi))
