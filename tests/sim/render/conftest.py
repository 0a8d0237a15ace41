"""Lights and cameras under which bytes can be worked out by hand."""

from __future__ import annotations

import math

from flagdata.core.arrays import UInt8Array
from sim.render import Raster, RenderParameters
from tests.sim.render.pieces import BLACK, WHITE, Given, plain


def look(**changes: object) -> RenderParameters:
    """White cloth before black, under the sky alone, so exposed that cloth is just white; no pole.

    The camera stands 5 m off, level with the origin's 0 m, and sees 1 m there as 60 px.
    """
    given: dict[str, object] = {
        "background": "black",
        "texture": "white",
        "sun_strength": 0.0,
        "sky_strength": 1.0,
        "pole_radius": 0.0,
        "camera_height": 0.0,
        "mesh_height": 0.0,
        "camera_radius": 5.0,
        "view_angle": 2 * math.atan(0.5),
    } | changes
    return RenderParameters(**given)  # type: ignore[arg-type]


def camera_of(**pictures: UInt8Array) -> Raster:
    """A renderer with black and white, and more pictures by name."""
    return Raster(assets=Given(pictures={"black": plain(BLACK), "white": plain(WHITE), **pictures}))
