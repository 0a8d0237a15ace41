"""The physics from Python: cloth simulated and filmed.

Each call's options are a class here. The work is done in sim, which flagdata must not import: it is
called by its name, "module:attribute".
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flagdata.core.parts import call
from flagdata.verbs.option_types import POSITIVE
from flagdata.verbs.shared_options import Computed
from flagdata.verbs.verb_options import argument, make_call, option, options

if TYPE_CHECKING:
    from flagdata.answer.simulated import Simulated
    from flagdata.ingest.films.film_array import Frames
    from flagdata.lake.mesh_sequences import MeshSequence, RaggedMeshSequence

_TABLES = (
    "scene",
    "material",
    "wind",
    "contact",
    "limits",
    "remeshing",
    "integrator",
    "time",
    "effects",
)
_TABLE = (
    "Entries of the recipe's table [{}], SI and radians; each replaces the recipe's entry of the "
    "same key."
)


@options
class Members:
    """How many members of a recipe are simulated: a member is one simulation, with values drawn
    from the recipe's ranges."""

    count: int | None = option(
        "How many members, instead of the recipe's.", default=None, type=POSITIVE, metavar="N"
    )
    batch: int | None = option(
        "How many at a time, instead of the recipe's.", default=None, type=POSITIVE, metavar="N"
    )


@options
class Simulating(Members, Computed):
    """What is simulated."""

    recipe: str | Path | Mapping[str, Any] | None = argument(
        "Name of a recipe of the catalog, path of a TOML file, or its content as a dict; None for "
        "what is given beside "
        "it alone, and defaults: a flag of 1.5 m × 1 m on two corners, of the knit "
        '"camel-ponte-roma".',
        "RECIPE",
        default=None,
    )
    scene: Mapping[str, Any] | None = option(_TABLE.format("scene"), default=None)
    material: Mapping[str, Any] | None = option(_TABLE.format("material"), default=None)
    wind: Mapping[str, Any] | None = option(
        f"{_TABLE.format('wind')} As in every table, a value may be a range that each member draws "
        "from, "
        '{"low": 2.0, "high": 8.0}; `docs/simulator.md` lists the keys.',
        default=None,
    )
    time: Mapping[str, Any] | None = option(_TABLE.format("time"), default=None)
    effects: Mapping[str, Mapping[str, Any]] | None = option(_TABLE.format("effects"), default=None)
    contact: Mapping[str, Any] | None = option(_TABLE.format("contact"), default=None)
    limits: Mapping[str, Any] | None = option(_TABLE.format("limits"), default=None)
    remeshing: Mapping[str, Any] | None = option(_TABLE.format("remeshing"), default=None)
    integrator: Mapping[str, Any] | None = option(_TABLE.format("integrator"), default=None)
    seed: int | None = option("Seed of all that is drawn.", default=None)
    precision: str | None = option("float32 or float64.", default=None)
    workers: int | None = option(
        "How many batches are simulated at the same time; None for one for each core.", default=1
    )


@make_call(Simulating)
def simulate(chosen: Simulating) -> Simulated:
    """Cloth in the wind as arrays; nothing is written. `flagdata simulate` keeps the same members
    in a lake.

    ```python
    flags = flagdata.simulate(
        wind={"speed": 5.0}, time={"frames": 50}, effects={"lift": {"coefficient": 1.0}}
    )
    flags.positions, flags.time  # (member, frame, vertex, 3) m with z up, (frame,) s
    ```

    Raises:
        MissingExtraError: torch is not installed.
        UnknownNameError: a recipe, key, material or effect that is not known.
        InputError: a value that does not fit, or no member that was simulated to the end.
        LimitError: more than a recipe may ask for.
    """
    names = (*_TABLES, "count", "seed", "batch", "precision")
    given = {name: value for name in names if (value := getattr(chosen, name)) is not None}
    source = str(chosen.recipe) if isinstance(chosen.recipe, Path) else chosen.recipe
    workers = chosen.processes if chosen.workers is None else chosen.workers
    return call(
        "sim.run.simulate_call:simulate_members",
        source,
        given,
        device=chosen.device,
        workers=workers,
    )


@options
class Rendering:
    """What is filmed, and how."""

    sequence: MeshSequence | RaggedMeshSequence = argument(
        "A member of what `simulate` returns, or what `meshes` does.", "SEQUENCE"
    )
    look: str = option(
        "What light, camera, texture and background are drawn from: a name of catalogs/renders.",
        default="outdoor",
    )
    seed: int = option("Seed of these draws.", default=0)
    width: int = option("Width of the picture [px].", default=300)
    height: int = option("Height of the picture [px].", default=300)
    parameters: Mapping[str, float] | None = option(
        'Render parameters in place of those drawn, by name, SI and radians: `{"camera_radius": '
        "8.0}`.",
        default=None,
    )
    cloth: str = option("flag, or hanging-cloth.", default="flag")
    heading: float | None = option(
        "Where the air goes to, counter-clockwise from +x [rad]; None for what the sequence "
        "states, else 0.",
        default=None,
    )
    renderer: str = option(
        "raster; cycles or workbench where `flagdata blender-setup` was run.", default="raster"
    )
    photos: Path | str | None = option("Folder of photographs as backgrounds.", default=None)


@make_call(Rendering)
def render(chosen: Rendering) -> Frames:
    """A moving mesh as a camera sees it, in colour.

    ```python
    film = flagdata.render(flagdata.simulate(wind={"speed": 5.0})[0])
    film.images  # (frame, height, width, 3) uint8 sRGB
    ```

    Raises:
        MissingExtraError: torch is not installed.
        UnknownNameError: a look, renderer or parameter that is not known.
        InputError: a value that is not admissible, or cloth behind the camera.
    """
    size = {"width": chosen.width, "height": chosen.height}
    return call(
        "sim.render.render_call:render_film",
        chosen.sequence,
        look=chosen.look,
        parameters={**size, **(chosen.parameters or {})},
        cloth=chosen.cloth,
        heading=chosen.heading,
        renderer=chosen.renderer,
        photos=None if chosen.photos is None else Path(chosen.photos),
        seed=chosen.seed,
    )
