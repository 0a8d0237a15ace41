"""Runs of one label are of one training: seeds are shown together, other recipes and data apart."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from models.evaluation.evaluate_command import label_networks


@dataclass(frozen=True, kw_only=True)
class Network:
    name: str
    card: dict[str, Any]


def trained(
    number: int, *, seed: int = 1, rate: float = 1e-3, data: str = "a", sequences: int | None = None
) -> Any:
    recipe = {
        "seed": seed,
        "data": {"dataset": "made", "sequences": sequences},
        "optimiser": {"rate": rate},
    }
    card = {
        "recipe": recipe,
        "data": {"train": data, "validation": "v", "view": [f"main@{number}"]},
    }
    return SimpleNamespace(id=f"{number:08d}" + 56 * "0"), Network(name="wave", card=card)


def labels(*found: Any) -> list[str]:
    return [network.name for _, network in label_networks(found)]


def test_seeds_and_parts_of_one_training_have_its_name() -> None:
    assert labels(trained(1)) == ["wave"]
    assert labels(trained(1), trained(2, seed=2), trained(3, sequences=100)) == ["wave"] * 3


def test_another_recipe_and_other_data_have_the_first_artifact_in_their_label() -> None:
    one, same, changed, more = (
        trained(1),
        trained(2, seed=2),
        trained(3, rate=1e-2),
        trained(4, data="b"),
    )
    assert labels(one, same, changed, more) == [
        "wave 00000001",
        "wave 00000001",
        "wave 00000003",
        "wave 00000004",
    ]
