"""The area weight of a cloth by its name: a material of the catalog, or a fabric that a lake's
films declare."""

from __future__ import annotations

from collections.abc import Mapping

from flagdata.core.schema import Kind
from flagdata.core.stated import Stated
from flagdata.errors import UnknownNameError, UsageError
from flagdata.lake import Lake
from flagdata.recipes.documents import from_stored_json
from flagdata.recipes.retired_names import hashed_name
from sim.cloth.material import MATERIALS, named_material


def weight_of(name: str, *, lake: Lake | None, at: str | None) -> tuple[Stated, str]:
    """Returns the area weight of a material [kg/m²] and its source in words.

    Nothing else of the material is used: its stiffness stays what the film and the network's prior
    say.

    Args:
        lake: whose declared cloths (`flagdata declare-cloths`) are looked at where the catalog has
            no such material; None for none.
        at: tag, branch or version of the lake.

    Raises:
        UnknownNameError: none of that name.
        UsageError: films of the lake declare several weights for it.
    """
    if name in MATERIALS.names():
        material = named_material(name)
        return Stated.of(material.area_weight), material.source
    fabrics = {} if lake is None else _declared_weights(lake, at)
    weights = fabrics.get(name, set())
    if not weights:
        raise UnknownNameError.of(
            "material", name, {*MATERIALS.names(), *fabrics}, where="--material"
        )
    if len(weights) > 1:
        raise UsageError(
            f"films of {name!r} declare {len(weights)} area weights, {min(weights):g} to "
            f"{max(weights):g} kg/m²",
            where="--material",
            fix="give --area-weight",
        )
    return Stated.of(next(iter(weights))), "declared by films of the lake"


def _declared_weights(lake: Lake, at: str | None) -> Mapping[str, set[float]]:
    """Collects the area weights of the fabrics that films declare, by name."""
    weights: dict[str, set[float]] = {}
    rows = lake.rows({"kind": Kind.RECORDING}, at=at, columns=["session", "recipe"]).to_pylist()
    for row in rows:
        cloth = from_stored_json(row["recipe"]).get("cloth") if row["recipe"] else None
        if cloth is not None and row["session"] is not None:
            weights.setdefault(row["session"], set()).add(float(cloth[hashed_name("area_weight")]))
    return weights
