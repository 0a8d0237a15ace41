"""Render parameters ζ: everything that decides how a mesh is drawn, one value each, with unit and
admissible range.

The names are those of Runia et al. 2020, "Exhaustive overview of the render parameters ζ"
(appendix); parameters that table leaves open are marked in the catalog of priors
(`catalogs/renders`), which says where each range is from.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Annotated, Any, get_type_hints

from flagdata.core.schema import FRAME_SIZE
from flagdata.errors import InputError


@dataclass(frozen=True, kw_only=True)
class RenderQuantity:
    """A parameter's unit, and the least and the greatest value that make sense at all."""

    unit: str
    least: float
    most: float


_POSITIVE = 1e-6
_TURN = RenderQuantity(unit="rad", least=-2 * math.pi, most=2 * math.pi)


@dataclass(frozen=True, kw_only=True)
class RenderParameters:
    """One draw of ζ. Lengths in metres, angles in radians, image distances in pixels.

    The world has its origin on the ground beneath the meshes' anchor (foot of the pole), z up. The
    *heading* is the meshes' own horizontal reference direction: where the air goes to for a flag,
    the normal of a hanging cloth.

    Attributes:
        background: name of the background image, see `sim.assets`.
        background_offset_x, background_offset_y: how far it is moved to the right and down, in
            pixels of an image whose longer side has 300.
        background_scale: 0.6 shows its whole shorter side along the frame's longer one, 1.0
            enlarges it by 1/0.6.
        sun_height, sun_radius, sun_azimuth: the sun is a directional light; it comes from the point
            at this height above the ground, at this horizontal distance from the origin, in this
            direction counter-clockwise from the heading, towards the origin.
        sun_strength: irradiance of a surface that faces the sun.
        sun_softness: tangent of the sun's angular radius (Blender's `shadow_soft_size` of a sun;
            the real one: 0.0047).
        sky_strength: radiance of the sky, the same from all directions.
        exposure_bias: stops above the exposure at which white cloth that faces the sun is just
            white.
        camera_height: of the camera above the ground.
        camera_radius: horizontal distance from the camera to the point it aims at, the middle of
            the cloth's bounding box over all frames.
        camera_angle: horizontal angle from the heading to the camera's axis, counter-clockwise from
            above. π/2: the camera looks across the heading, and sees the air go to the right.
        view_angle: angle of view of the frame's longer side.
        frame_offset_x, frame_offset_y: how far the picture is moved to the right and down; shares
            of its longer side.
        exposure_time: of a frame; the frame's instant is its middle.
        mesh_height: of the anchor (a flag's upper hoist corner, the middle of a hanging cloth's
            upper edge).
        texture: name of the cloth's texture, see `sim.assets`.
        translucency: share t of the diffuse light that leaves on the far side.
        pole_radius: of the pole; 0 for none.
        width, height: of the image.
        cycles_samples, cycles_bounces: paths a pixel and their bounces, where the renderer traces
            paths.
        raster_samples: sub-pixel and sub-exposure samples of a pixel, where the renderer
            rasterises.

    Raises:
        InputError: a value that is not admissible, with what is.
    """

    background: str
    background_offset_x: Annotated[float, RenderQuantity(unit="px", least=-1000.0, most=1000.0)] = (
        0.0
    )
    background_offset_y: Annotated[float, RenderQuantity(unit="px", least=-1000.0, most=1000.0)] = (
        0.0
    )
    background_scale: Annotated[float, RenderQuantity(unit="1", least=0.1, most=10.0)] = 0.8
    sun_height: Annotated[float, RenderQuantity(unit="m", least=_POSITIVE, most=1e6)] = 7.0
    sun_radius: Annotated[float, RenderQuantity(unit="m", least=0.0, most=1e6)] = 2.5
    sun_azimuth: Annotated[float, _TURN] = 0.0
    sun_strength: Annotated[float, RenderQuantity(unit="W/m²", least=0.0, most=1e4)] = 6.0
    sun_softness: Annotated[float, RenderQuantity(unit="1", least=0.0, most=100.0)] = 6.0
    sky_strength: Annotated[float, RenderQuantity(unit="W/(m² sr)", least=0.0, most=1e4)] = 0.5
    exposure_bias: Annotated[float, RenderQuantity(unit="EV", least=-10.0, most=10.0)] = 0.0
    camera_height: Annotated[float, RenderQuantity(unit="m", least=-1000.0, most=1000.0)] = 1.6
    camera_radius: Annotated[float, RenderQuantity(unit="m", least=0.05, most=1e4)] = 5.0
    camera_angle: Annotated[float, _TURN] = math.pi / 2
    view_angle: Annotated[float, RenderQuantity(unit="rad", least=1e-3, most=0.95 * math.pi)] = (
        math.radians(27.0)
    )
    frame_offset_x: Annotated[float, RenderQuantity(unit="1", least=-1.0, most=1.0)] = 0.0
    frame_offset_y: Annotated[float, RenderQuantity(unit="1", least=-1.0, most=1.0)] = 0.0
    exposure_time: Annotated[float, RenderQuantity(unit="s", least=0.0, most=1.0)] = 0.0
    mesh_height: Annotated[float, RenderQuantity(unit="m", least=-1000.0, most=1000.0)] = 4.6
    texture: str
    translucency: Annotated[float, RenderQuantity(unit="1", least=0.0, most=1.0)] = 0.0
    pole_radius: Annotated[float, RenderQuantity(unit="m", least=0.0, most=1.0)] = 0.03
    width: Annotated[int, RenderQuantity(unit="px", least=1, most=8192)] = FRAME_SIZE
    height: Annotated[int, RenderQuantity(unit="px", least=1, most=8192)] = FRAME_SIZE
    cycles_samples: Annotated[int, RenderQuantity(unit="1", least=1, most=65536)] = 50
    cycles_bounces: Annotated[int, RenderQuantity(unit="1", least=0, most=1024)] = 6
    raster_samples: Annotated[int, RenderQuantity(unit="1", least=1, most=1024)] = 8

    def __post_init__(self) -> None:
        for name, entry in self.described().items():
            value = getattr(self, name)
            is_integer = self._types()[name] is int
            typed = isinstance(value, int if is_integer else (int, float)) and not isinstance(
                value, bool
            )
            if not typed or not entry.least <= value <= entry.most:
                noun = "a whole number" if is_integer else "a number"
                unit = "" if entry.unit == "1" else f" {entry.unit}"
                raise InputError(
                    f"{name} is {value!r}",
                    where="render parameters",
                    fix=f"give {noun} from {entry.least:g} to {entry.most:g}{unit}",
                )
        for name in ("background", "texture"):
            if not isinstance(getattr(self, name), str) or not getattr(self, name):
                raise InputError(
                    f"{name} is {getattr(self, name)!r}",
                    where="render parameters",
                    fix="give a name",
                )

    @property
    def gain(self) -> float:
        """Image value, linear, of a radiance of 1 W/(m² sr)."""
        white = self.sun_strength / math.pi + self.sky_strength
        return 2.0**self.exposure_bias / white if white > 0 else 0.0

    @property
    def sun_angular_radius(self) -> float:
        """[rad], below π/2."""
        return math.atan(self.sun_softness)

    @classmethod
    def described(cls) -> Mapping[str, RenderQuantity]:
        """Names → unit and bounds of every number, in the order of the fields."""
        return _described_quantities(cls)

    @classmethod
    def _types(cls) -> Mapping[str, type]:
        return _number_types(cls)


@functools.cache
def _described_quantities(cls: type[Any]) -> Mapping[str, RenderQuantity]:
    hints = get_type_hints(cls, include_extras=True)
    notes = {entry.name: getattr(hints[entry.name], "__metadata__", ()) for entry in fields(cls)}
    return {
        name: note
        for name, described in notes.items()
        for note in described
        if isinstance(note, RenderQuantity)
    }


@functools.cache
def _number_types(cls: type[Any]) -> Mapping[str, type]:
    hints = get_type_hints(cls)
    return {name: hints[name] for name in _described_quantities(cls)}
