"""A quantity has the one name of docs/glossary.md in options, recipes, columns, JSON and code."""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

import flagdata
from docs import generate_cli
from docs.generate_glossary import QUANTITIES
from flagdata.core.schema import CATALOG
from flagdata.recipes.retired_names import KEYS, NAMES

ROOT = Path(flagdata.__file__).parent.parent
PRODUCT = ("flagdata", "sim", "models", "measure")
RECIPES = ("sim/run/simulation_toml.py", "measure/trajectories/experiment_recipe.py")
"""Modules whose dataclasses and tables are the keys of recipes."""
RETIRED = {*NAMES, *KEYS, "density_uncertainty", "density-uncertainty"}
OF_THE_AIR = {
    "measure/trajectories/checks/inertia_check.py",
    "measure/trajectories/checks/surroundings.py",
    "measure/trajectories/describing.py",
    "measure/trajectories/experiment_recipe.py",
    "measure/report/verdict_statement.py",
    "sim/cloth/air.py",
    "sim/run/cusick_drape.py",
    "sim/run/simulation_toml.py",
    *(
        f"sim/{part}/{name}.py"
        for part, name in (("kernel", "fused"), ("kernel_warp", "warp_batch"))
    ),
    "sim/kernel_warp/leapfrog.py",
}
"""Modules in which a density is the air's, beside those of effects."""
OF_ARCSIM = {"sim/arcsim/arcsim_reading.py", "sim/arcsim/writing.py"}
"""Modules in which `density` is a key of another program's files."""
OF_STATISTICS = {
    "measure/cloth/model_evidence.py",
    "measure/cloth/cloth_posterior.py",
    "measure/loop/residuals.py",
    "models/trained/restriction.py",
    "sim/cloth/membrane.py",  # of energy
    "sim/wind/spectral_wind.py",
}
"""Modules in which a density is that of a probability, a spectrum or an energy."""
OF_THE_LAST_VERSION = {
    "flagdata/recipes/retired_names.py",
    "flagdata/api/measuring_verbs.py",
    "measure/closing/close_loop_call.py",
    "measure/cloth/film_options.py",
    "measure/commands/close_loop.py",
    "measure/nulls/null_simulation.py",  # a hash
    "measure/trajectories/experiment_recipe.py",
    "measure/trajectories/trajectory.py",  # a hash
}
"""Modules that read names of the last version, or hash under them."""


def words(source: str) -> Iterator[str]:
    """The names and whole texts of a module."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.Attribute):
            yield node.attr
        elif isinstance(node, ast.arg | ast.keyword):
            yield str(node.arg)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


@pytest.fixture(scope="module")
def texts() -> dict[str, str]:
    """Module of the product → its source."""
    paths = (path for part in PRODUCT for path in (ROOT / part).rglob("*.py"))
    return {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in paths}


@pytest.fixture(scope="module")
def options() -> list[click.Option]:
    return [
        p
        for _, command in generate_cli.commands()
        for p in command.params
        if isinstance(p, click.Option)
    ]


def test_no_module_calls_an_area_weight_by_a_former_name(texts: dict[str, str]) -> None:
    wrong = {}
    for name, text in texts.items():
        if name in OF_THE_LAST_VERSION or not any(former in text for former in RETIRED):
            continue
        former = RETIRED & set(words(text))
        if name in OF_THE_AIR | OF_ARCSIM | OF_STATISTICS or name.startswith("sim/effects/"):
            former -= {"density"}
        if former:
            wrong[name] = former
    assert wrong == {}


def test_the_lists_of_exceptions_name_modules_that_need_them(texts: dict[str, str]) -> None:
    listed = OF_THE_AIR | OF_ARCSIM | OF_STATISTICS | OF_THE_LAST_VERSION
    assert [name for name in sorted(listed) if not RETIRED & set(words(texts[name]))] == []


def test_no_column_option_or_catalogued_recipe_has_a_former_name(
    options: list[click.Option],
) -> None:
    assert not RETIRED & set(CATALOG)
    former = {
        "--pins",
        "--size",
        "--offset",
        *(f"--{key}" for key in KEYS),
        "--density-uncertainty",
    }
    assert {name for one in options if not one.hidden for name in one.opts} & former == set()
    for path in (ROOT / "catalogs").rglob("*.toml"):
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
        for table in (tables, tables.get("material", {})):
            assert not RETIRED & set(table), path.name
        assert not RETIRED & set(tables.get("loss", {}).get("targets", ())), path.name


def test_each_quantity_is_met_where_the_glossary_says(
    texts: dict[str, str], options: list[click.Option]
) -> None:
    opts = {name for one in options if not one.hidden for name in one.opts}
    parameters = {one.name for one in options}
    keys = {word.replace("_", "-") for name in RECIPES for word in words(texts[name])}
    product = "\n".join(texts.values())
    for quantity in QUANTITIES:
        assert set(quantity.options) <= opts, quantity.name
        assert set(quantity.calls) <= parameters, quantity.name
        assert set(quantity.keys) <= keys, quantity.name
        assert all(f'"{column}"' in product for column in quantity.columns), quantity.name
