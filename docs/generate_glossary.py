"""The glossary of quantities and of the reports' terms, docs/glossary.md: `python -m
docs.generate_glossary`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from flagdata.pages.glossary import GLOSSARY

PAGE = Path(__file__).with_name("glossary.md")
_HEAD = """\
# Glossary

Terms of the reports, pages and messages, as each report has them at its end. This page is generated.
"""
_QUANTITIES = """\
## Quantities

A quantity has one name in options, recipes, columns, JSON and Python calls; options and recipe keys are spelled with
hyphens. Names of the last version are read with a warning. Identities of artifacts are hashes of recipes and keep the
names that they were made with.

| quantity | name | unit | sign or meaning | option | recipe key | column or JSON | Python | was |
|---|---|---|---|---|---|---|---|---|
"""


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A row of the table of quantities.

    Attributes:
        title: what it is.
        name: its one name.
        unit: SI.
        meaning: or its sign.
        options, keys, columns, calls: by which it is met on the command line, in recipes, in the
            catalog's columns, their JSON and results, and as a parameter of Python calls.
        was: its names of the last version.
    """

    title: str
    name: str
    unit: str
    meaning: str
    options: tuple[str, ...] = ()
    keys: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()
    calls: tuple[str, ...] = ()
    was: tuple[str, ...] = ()


QUANTITIES = (
    Quantity(
        title="area weight",
        name="area_weight",
        unit="kg/m²",
        meaning="mass of the cloth per area; in a verdict on markers the factor on the material's",
        options=("--area-weight",),
        keys=("area-weight", "area-weight-factor"),
        columns=("area_weight",),
        calls=("area_weight",),
        was=("density", "density-factor", "fabric_density", "cloth_density", "density-uncertainty"),
    ),
    Quantity(
        title="bending stiffness",
        name="bending",
        unit="N·m",
        meaning="coefficients of the material's table, or their geometric mean; in a verdict on "
        "markers the factor on "
        "the material's. `bending_scale` is the mean of their logarithms (base 10), "
        "`bending-factor` a factor on all, "
        "`bending_stiffness` a measured flexural rigidity per metre of width",
        keys=("bending-factor", "bending-factors"),
        columns=("bending", "bending_scale", "bending_stiffness"),
    ),
    Quantity(
        title="attachment",
        name="attachment",
        unit="–",
        meaning="where the cloth is held: a name, or points (u, v) on the flat cloth [m], which "
        "are its pins",
        options=("--attachment",),
        keys=("attachment",),
        calls=("attachment",),
        was=("--pins", "[pins]"),
    ),
    Quantity(
        title="clock offset",
        name="clock_offset",
        unit="s",
        meaning="added to the clock of the camera, recording or table to reach the wind log's; a "
        "clock without dates "
        "starts at its first sample",
        options=("--clock-offset",),
        keys=("clock-offset",),
        columns=("clock_offset",),
        calls=("clock_offset",),
        was=("--offset", "offset"),
    ),
    Quantity(
        title="flag size",
        name="flag_size",
        unit="m",
        meaning="length along the wind × height of the flat flag; in recipes `width` and `height`",
        options=("--flag-size",),
        keys=("width", "height"),
        columns=("flag_size",),
        calls=("flag_size",),
        was=("--size",),
    ),
    Quantity(
        title="density of the air",
        name="density",
        unit="kg/m³",
        meaning="of the air alone: in `[air]` of an experiment, `[wind]` of a simulation, and of "
        "effects",
        keys=("density",),
    ),
)


def pages() -> dict[Path, str]:
    """The page with its text."""
    terms = [f"**{term}**\n: {meaning}\n" for term, meaning in GLOSSARY.items()]
    parts = [_HEAD, _QUANTITIES + "".join(map(_row, QUANTITIES)), "## Terms\n", *terms]
    return {PAGE: "\n".join(parts)}


def _row(quantity: Quantity) -> str:
    lists = (quantity.options, quantity.keys, quantity.columns, quantity.calls, quantity.was)
    cells = (", ".join(f"`{name}`" for name in names) for names in lists)
    return (
        "| "
        + " | ".join(
            [quantity.title, f"`{quantity.name}`", quantity.unit, quantity.meaning, *cells]
        )
        + " |\n"
    )


if __name__ == "__main__":
    PAGE.write_text(pages()[PAGE], encoding="utf-8")
