"""How meshes become pictures: the renderers' contract, and the renderers by name.

A renderer turns meshes and render parameters ζ into frames. What all renderers share is one
function each: `stage` places camera, sun, cloth and pole; `Camera.project` maps the world to
pixels; `plate` fits the background; `develop` turns linear light into sRGB bytes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports
from flagdata.recipes.registry import Registry
from sim.render.parameters import RenderParameters
from sim.render.rendered_meshes import Meshes
from sim.render.renderer import Renderer

if TYPE_CHECKING:
    from sim.render.cycles import Cycles, Workbench
    from sim.render.develop import plate, to_bytes, to_linear
    from sim.render.parameters import RenderParameters
    from sim.render.pinhole_camera import Camera
    from sim.render.raster import Raster
    from sim.render.render_prior import RenderPrior, named_prior
    from sim.render.rendered_meshes import Meshes
    from sim.render.renderer import Renderer
    from sim.render.staging import stage


__all__ = ["RENDERERS", "Meshes", "RenderParameters", "Renderer"]

RENDERERS = Registry(
    "renderer",
    {
        "raster": "sim.render.raster:Raster",
        "cycles": "sim.render.cycles:Cycles",
        "workbench": "sim.render.cycles:Workbench",
    },
    group="flagdata.renderers",
    accepts=lambda entry: isinstance(entry, type) and callable(getattr(entry, "render", None)),
)
"""Name → class, made with the assets it takes backgrounds and textures from:
`RENDERERS["raster"](assets=Assets())`. Installed packages add renderers by entry points of the
group `flagdata.renderers`."""

__getattr__ = lazy_exports(__name__, __file__)
