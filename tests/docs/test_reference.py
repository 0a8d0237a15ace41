"""The generated pages are those of the code as it is, and nothing in them is without words."""

from __future__ import annotations

import click
import pytest

from docs import generate_cli, generate_effects
from sim.effects import EFFECTS, SENSOR_EFFECTS

COMMANDS = dict(generate_cli.commands())


@pytest.mark.parametrize("module", [generate_cli, generate_effects], ids=["cli", "effects"])
def test_a_generated_page_is_that_of_the_code(module: object) -> None:
    name = module.__name__  # type: ignore[attr-defined]
    fresh = module.reference() == module.PAGE.read_text(encoding="utf-8")  # type: ignore[attr-defined]
    assert fresh, f"write the page anew: python -m {name}"


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_and_every_option_has_a_sentence(name: str) -> None:
    command = COMMANDS[name]
    assert command.help
    assert [p.name for p in command.params if isinstance(p, click.Option) and not (p.help or "").strip()] == []


@pytest.mark.parametrize("name", [*EFFECTS, *SENSOR_EFFECTS])
def test_every_effect_and_each_of_its_parameters_is_on_the_page(name: str) -> None:
    effect = EFFECTS[name] if name in EFFECTS else SENSOR_EFFECTS[name]
    page = generate_effects.PAGE.read_text(encoding="utf-8")
    section = page.split(f"\n### {name}\n")[1].split("\n### ")[0]
    for label, entry in effect.parameters().items():
        (row,) = [line for line in section.splitlines() if line.startswith(f"| `{label}` |")]
        cells = [cell.strip() for cell in row.strip("|").split(" | ")]
        assert cells[2] == entry.unit
        assert all(cells)
