"""Every key of a data set's recipe has a row on the page of data sets, and every row is a key."""

from __future__ import annotations

import re
from dataclasses import fields

from sim.datasets import AnemometerSpec, CameraSpec
from sim.datasets.dataset_recipe import GroupSpec, SessionSpec
from sim.datasets.dataset_toml import SIDES, _DatasetTables, _Render, _Scene, _SessionsSide
from tests.docs.pages import DOCS

TABLES = {
    "[simulation]": _Scene,
    "[render]": _Render,
    **{f"[sides.{side}]": _SessionsSide for side in SIDES},
    "[sessions]": SessionSpec,
    "[groups]": GroupSpec,
    "[camera]": CameraSpec,
    "[anemometer]": AnemometerSpec,
}


def keys(form: type) -> set[str]:
    return {field.name.replace("_", "-") for field in fields(form)}


def test_every_key_of_a_recipe_is_on_the_page_under_its_table() -> None:
    section = (
        (DOCS / "datasets.md").read_text(encoding="utf-8").partition("## A data set of your own")[2]
    )
    listed: dict[str, set[str]] = {}
    tables: list[str] = []
    for line in section.partition("\n## ")[0].splitlines():
        if line.startswith("| ") and not line.startswith("| table"):
            table, names = (re.findall(r"`([^`]+)`", cell) for cell in line.split("|")[1:3])
            tables = table or tables or [""]
            for name in tables:
                listed.setdefault(name, set()).update(names)
    of_effects = listed.pop("[anemometer.effects.NAME]")
    assert not of_effects  # those of `flagdata catalog sensor-effects`
    top = {key for key in keys(_DatasetTables) if f"[{key}]" not in TABLES and key != "sides"}
    wanted = {"": top, **{name: keys(form) for name, form in TABLES.items()}}
    wanted["[anemometer]"] -= {"effects"}
    assert listed == wanted
