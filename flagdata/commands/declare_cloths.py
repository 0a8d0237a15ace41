"""`flagdata declare-cloths`: films of cloths whose material was measured, as a table names them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from flagdata.core.console import LocalPath, echo, in_steps, progress
from flagdata.core.files.addresses import local_path
from flagdata.core.json_values import json_values
from flagdata.verbs.shared_options import OnBranch, OnLake
from flagdata.verbs.verb_options import Result, argument, option, options, verb


@options
class DeclaringCloths(OnBranch, OnLake):
    """Which films show which cloths."""

    table: Path | str = argument("A CSV file, one row a film.", "TABLE", type=LocalPath())
    crop: str = option(
        "Region of all films: x,y,width,height [px] of upright images; whole, square, or auto.",
        default="square",
        metavar="BOX",
    )


@verb(
    DeclaringCloths,
    example='flagdata.declare_cloths("fabrics.csv", lake="field.lake")["recordings"]',
)
def declare_cloths(chosen: DeclaringCloths) -> Iterator[Result]:
    """Ingest the films that TABLE names, with the area weight and stiffness that were measured of
    their cloths.

    TABLE is a CSV file, one row a film: film (a path from the table's folder on), fabric,
    area_weight [kg/m²], and as far as they are known bending_stiffness [N·m], wind_level,
    wind_speed and wind_sigma [m/s]. The whole table is checked before the first film is read. Clips
    know their cloth as simulated ones do, as parameters of the catalog; where no wind is stated
    they have none. Films of one fabric are one session.

    \b
      flagdata declare-cloths fabrics.csv --lake lake
      flagdata query --where "kind = 'clip' and session = 'felt'" --lake lake
    """
    from flagdata.align.cloth_recording import cloth_recording
    from flagdata.ingest.artifacts_present import Labels
    from flagdata.ingest.camera import CameraOptions, parse_crop
    from flagdata.ingest.camera.recording_start import UNKNOWN
    from flagdata.ingest.cloth_films import read_cloths
    from flagdata.ingest.source_artifacts import CameraIngest, ingest_camera
    from flagdata.lake.merging import added_since

    box, branch = parse_crop(chosen.crop), chosen.branch
    lake = chosen.opened()
    lake.check_writable()
    cloths = read_cloths(local_path(chosen.table))
    made = []
    with (
        in_steps(added_since(lake, branch)),
        progress(len(cloths), label="films", unit="film") as advance,
    ):
        for cloth in cloths:
            options = CameraIngest(camera=CameraOptions(start=UNKNOWN, crop=box))
            film = ingest_camera(
                lake, cloth.film, options, labels=Labels(session=cloth.fabric), branch=branch
            )
            made.append((cloth, cloth_recording(lake, film.artifact, cloth, branch=branch)))
            advance(1)
    recordings = [
        {**json_values(one), "parameters": cloth.parameters, "wind": cloth.wind}
        for cloth, one in made
    ]
    yield Result("declare-cloths", {"recordings": recordings})
    for cloth, one in made:
        healed = "" if one.healed is None else f"; {one.healed.sentence}"
        echo(
            f"{one.recording.id}  {cloth.fabric}, {cloth.area_weight:g} kg/m², {len(one.clips)} "
            f"clips{healed}"
        )
