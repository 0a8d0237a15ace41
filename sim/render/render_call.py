"""A mesh sequence as a camera sees it, as an array: what `flagdata.render` does."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import torch

from flagdata.answer.simulated import Simulated
from flagdata.errors import UsageError
from flagdata.ingest.films.film_array import Frames
from flagdata.lake.mesh_sequences import MeshSequence, RaggedMeshSequence
from flagdata.timebase import NANOSECONDS
from sim.assets import Assets
from sim.render import RENDERERS, Meshes, render_prior


def render_film(
    sequence: MeshSequence | RaggedMeshSequence | Simulated,
    *,
    look: str,
    parameters: Mapping[str, float],
    cloth: str,
    heading: float | None,
    renderer: str,
    photos: Path | None,
    seed: int,
) -> Frames:
    """Renders a film of a moving cloth.

    Raises:
        FlagdataError: see `flagdata.render`.
    """
    if cloth not in ("flag", "hanging-cloth"):
        raise UsageError(
            f"the cloth {cloth!r} is unknown", where="cloth", fix="give 'flag' or 'hanging-cloth'"
        )
    if isinstance(sequence, Simulated):
        raise UsageError(
            f"the simulation has {len(sequence)} cloths",
            where="sequence",
            fix="give one of its members, as in simulated[0]",
        )
    assets = Assets(photos=photos)
    zeta = (
        render_prior.named_prior(look)
        .with_quantities(dict(parameters), source="given")
        .draw(seed, assets)
    )
    toward = _toward(sequence) if heading is None else heading
    meshes = (
        Meshes.flag(sequence, heading=toward)
        if cloth == "flag"
        else Meshes.hanging(sequence, heading=toward)
    )
    with torch.no_grad():
        pictures = RENDERERS[renderer](assets=assets).render(meshes, zeta)
    first = int(sequence.time[0])
    name = str(sequence.attributes.get("recipe", "rendered"))
    return Frames(
        images=pictures.cpu().numpy(), time=(sequence.time - first) / NANOSECONDS, name=name
    )


def _toward(sequence: MeshSequence | RaggedMeshSequence) -> float:
    """Returns where the air goes to, as a simulated sequence states it [rad]; +x for any other."""
    parameters = sequence.attributes.get("parameters")
    return float(parameters.get("wind_toward", 0.0)) if isinstance(parameters, Mapping) else 0.0
