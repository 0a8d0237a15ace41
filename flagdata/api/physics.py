"""The physics from Python: cloth simulated, filmed, measured, calibrated, and judged.

Each call is a door to what the command of its name does. The packages behind them are named by strings: flagdata
imports none of those that rest on it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flagdata.arguments import checked
from flagdata.parts import call

if TYPE_CHECKING:
    from flagdata.film_array import Frames
    from flagdata.lake.meshes import MeshSequence, RaggedMeshSequence
    from flagdata.simulated import Simulated

_TABLES = ("scene", "material", "wind", "contact", "limits", "integrator", "time", "effects")


@checked
def simulate(
    recipe: str | Path | Mapping[str, Any] | None = None,
    *,
    scene: Mapping[str, Any] | None = None,
    material: Mapping[str, Any] | None = None,
    wind: Mapping[str, Any] | None = None,
    time: Mapping[str, Any] | None = None,
    effects: Mapping[str, Mapping[str, Any]] | None = None,
    contact: Mapping[str, Any] | None = None,
    limits: Mapping[str, Any] | None = None,
    integrator: Mapping[str, Any] | None = None,
    count: int | None = None,
    seed: int | None = None,
    batch: int | None = None,
    precision: str | None = None,
    device: str = "cpu",
    workers: int = 1,
) -> Simulated:
    """Cloth in the wind as arrays; nothing is written. `flagdata simulate` keeps the same members in a lake.

    ```python
    flags = flagdata.simulate(wind={"speed": 5.0}, time={"frames": 50}, effects={"lift": {"coefficient": 1.0}})
    flags.positions, flags.time  # (member, frame, vertex, 3) m with z up, (frame,) s
    ```

    Args:
        recipe: name of a recipe of the catalog, path of a TOML file, or its content as a dict; None for what is given
            beside it alone, and defaults: a flag of 1.5 m × 1 m on two corners, of the knit "camel-ponte-roma".
        scene, material, wind, time, effects, contact, limits, integrator: tables of a recipe with its keys, SI and
            radians, in place of those of `recipe`: `wind={"speed": 5.0}`. A value may be a range that each member
            draws from, `{"low": 2.0, "high": 8.0}`. `docs/simulator.md` lists the keys.
        count: of members.
        seed: of all that is drawn.
        batch: members that are simulated together.
        precision: "float32" or "float64".
        device: "cpu" or "cuda".
        workers: batches at a time.

    Raises:
        MissingExtraError: torch is not installed.
        UnknownNameError: a recipe, key, material or effect that is not known.
        InputError: a value that does not fit, or no member that was simulated to the end.
        LimitError: more than a recipe may ask for.
    """
    tables = dict(zip(_TABLES, (scene, material, wind, contact, limits, integrator, time, effects), strict=True))
    whole = {"count": count, "seed": seed, "batch": batch, "precision": precision}
    given = {name: value for name, value in {**tables, **whole}.items() if value is not None}
    source = str(recipe) if isinstance(recipe, Path) else recipe
    return call("sim.run.arrays:simulated", source, given, device=device, workers=workers)


@checked
def render(
    sequence: MeshSequence | RaggedMeshSequence,
    *,
    look: str = "outdoor",
    seed: int = 0,
    width: int = 300,
    height: int = 300,
    parameters: Mapping[str, float] | None = None,
    cloth: str = "flag",
    heading: float | None = None,
    renderer: str = "raster",
    photos: Path | str | None = None,
) -> Frames:
    """A moving mesh as a camera sees it, in colour.

    ```python
    film = flagdata.render(flagdata.simulate(wind={"speed": 5.0})[0])
    film.images  # (frame, height, width, 3) uint8 sRGB
    ```

    Args:
        sequence: a member of what `simulate` returns, or what `meshes` does.
        look: what light, camera, texture and background are drawn from: a name of catalogs/renders.
        seed: of these draws.
        width, height: of the picture [px].
        parameters: render parameters in place of those drawn, by name, SI and radians: `{"camera_radius": 8.0}`.
        cloth: "flag", or "hanging-cloth".
        heading: where the air goes to, counter-clockwise from +x [rad]; None for what the sequence states, else 0.
        renderer: "raster"; "cycles" or "workbench" where `flagdata blender-setup` was run.
        photos: folder of photographs as backgrounds.

    Raises:
        MissingExtraError: torch is not installed.
        UnknownNameError: a look, renderer or parameter that is not known.
        InputError: a value that is not admissible, or cloth behind the camera.
    """
    own = {"width": width, "height": height, **(parameters or {})}
    return call(
        "sim.render.film:rendered",
        sequence,
        look=look,
        parameters=own,
        cloth=cloth,
        heading=heading,
        renderer=renderer,
        photos=None if photos is None else Path(photos),
        seed=seed,
    )
