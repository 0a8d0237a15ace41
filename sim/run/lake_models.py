"""Models of a lake as recipes: the parameters of a row of kind "model" are those of a recipe's
TOML."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path

from flagdata.core.files.addresses import local_path
from flagdata.core.printable import SHORT
from flagdata.core.schema import Kind
from flagdata.errors import CorruptError, InputError, NotFoundError, UnknownNameError
from flagdata.lake import Artifact, Lake
from flagdata.lake.naming import COLUMNS, OF_RESULTS, meant
from flagdata.recipes.retired_names import present_recipe
from flagdata.record.parent import open_parent
from flagdata.record.signals import WindSeries
from sim.run import simulation_toml
from sim.run.simulation_recipe import Recipe


def load(source: str, lake: Lake, *, branch: str = "main") -> Recipe:
    """Reads a recipe from a file or the catalog, as `sim.run.simulation_toml.load`, or a model of
    the lake by its name or id.

    Raises:
        UnknownNameError: neither a recipe nor a model has that name.
        NotFoundError: several models have it.
        FlagdataError: as `sim.run.simulation_toml.load`.
    """
    if local_path(source).suffix in (".toml", ".json") or source in simulation_toml.SCENES.names():
        return simulation_toml.load(source, logs=partial(_log, lake, branch))
    rows = lake.rows({"kind": Kind.MODEL}, at=branch, columns=OF_RESULTS).to_pylist()
    ids = [row["artifact"] for row in meant(rows, source)]
    if len(ids) > 1:
        raise NotFoundError(
            f"{len(ids)} models are meant by {source!r}", where=str(lake.path), fix=_one_of(ids)
        )
    if not ids:
        names = [*simulation_toml.SCENES.names(), *(row["name"] for row in rows)]
        raise UnknownNameError.of("recipe or model", source, names)
    return of_artifact(lake.artifact(ids[0], at=branch))


def _log(lake: Lake, branch: str, name: str) -> tuple[str, WindSeries]:
    rows = lake.rows({"kind": [Kind.WIND, Kind.RECORDING]}, at=branch, columns=COLUMNS).to_pylist()
    ids = [row["artifact"] for row in meant(rows, name, kinds=(Kind.WIND,))]
    if len(ids) > 1:
        raise NotFoundError(
            f"{len(ids)} logs are meant by {name!r}", where=str(lake.path), fix=_one_of(ids)
        )
    if not ids:
        raise UnknownNameError.of("log", name, [row["name"] for row in rows], where=str(lake.path))
    artifact = lake.artifact(ids[0], at=branch)
    series = None if artifact.object is None else open_parent(lake, artifact.object).wind()
    if series is None:
        raise InputError(
            "the record has no wind", where=f"artifact {artifact.id}", fix="name a wind artifact"
        )
    return artifact.id, series


def of_artifact(artifact: Artifact) -> Recipe:
    """Returns the recipe of a model.

    Raises:
        CorruptError: a row of another kind, or without parameters.
        FlagdataError: as `sim.run.simulation_toml.load`.
    """
    where = f"artifact {artifact.id}"
    if artifact.kind is not Kind.MODEL or artifact.parameters is None:
        raise CorruptError(
            "no model that can be simulated", where=where, fix="close the loop again"
        )
    content = present_recipe(json.loads(artifact.parameters))
    recipe = simulation_toml.of_content(content, name=artifact.name, folder=Path(), where=where)
    return replace(recipe, model=artifact.id)


def _one_of(ids: Iterable[str]) -> str:
    return f"give one's id: {', '.join(identity[:SHORT] for identity in ids)}"
