"""The generated pages are those of the code as it is, and nothing in them is without words."""

from __future__ import annotations

import inspect
import re
from dataclasses import fields
from importlib import import_module

import click
import pytest

import flagdata
from docs import generate_cli, generate_effects, generate_glossary
from flagdata.answer import Answer, Quantity
from flagdata.cli import VERBS
from flagdata.ingest import FileLayout, QualityRules
from flagdata.ingest.anemometer.sensor_recipe import (
    MATCH,
    ChannelLayout,
    CheckLayout,
    Recipe,
    TimeLayout,
)
from flagdata.record.signals import Sensor
from sim.effects import EFFECTS, SENSOR_EFFECTS
from tests.docs.calls import lines, undocumented
from tests.docs.pages import DOCS
from tests.flagdata.ingest.anemometer.test_silent_errors import KINDS


@pytest.mark.parametrize(
    "module",
    [generate_cli, generate_effects, generate_glossary],
    ids=["cli", "effects", "glossary"],
)
def test_a_generated_page_is_that_of_the_code(module: object) -> None:
    name = module.__name__  # type: ignore[attr-defined]
    pages = module.pages()  # type: ignore[attr-defined]
    stale = [path for path, text in pages.items() if path.read_text(encoding="utf-8") != text]
    assert stale == [], f"write them anew: python -m {name}"
    folders = {path.parent for path in pages} - {DOCS}
    assert {path for folder in folders for path in folder.iterdir()} <= set(pages)


def test_every_call_has_an_example_of_ten_lines_at_most_and_words_for_every_argument() -> None:
    assert [(name, found) for name in flagdata.__all__ if (found := undocumented(name))] == []
    assert [name for name in flagdata.__all__ if not 2 <= lines(name) <= 10] == []


def test_every_call_has_a_row_with_its_lines_and_a_section() -> None:
    page = (DOCS / "api.md").read_text(encoding="utf-8")
    rows = dict(
        re.findall(r"^\| [^|]+ \| \[`\w+`\]\(#(\w+)\) \| (\d+) \|$", page, flags=re.MULTILINE)
    )
    assert rows == {name: str(lines(name)) for name in flagdata.__all__}
    assert re.findall(
        r"^## (\w+)\n\n::: flagdata\.(?:api\.\w+\.)?(\w+)$", page, flags=re.MULTILINE
    ) == [(n, n) for n in rows]


def test_each_page_of_the_commands_answers_one_question() -> None:
    pages = generate_cli.pages()
    assert max(text.count("\n") for text in pages.values()) <= 200
    assert sorted(verb for _, verbs in generate_cli.PAGES.values() for verb in verbs) == sorted(
        VERBS
    )


def test_every_command_and_every_option_has_a_sentence() -> None:
    commands = dict(generate_cli.commands())
    assert len(commands) > 30
    assert [name for name, command in commands.items() if not command.help] == []
    options = [
        (name, p)
        for name, command in commands.items()
        for p in command.params
        if isinstance(p, click.Option)
    ]
    assert [
        (name, option.name) for name, option in options if not (option.help or "").strip()
    ] == []


def test_every_effect_and_each_of_its_parameters_is_on_the_page() -> None:
    page = "".join(path.read_text(encoding="utf-8") for path in (DOCS / "effects").glob("*.md"))
    for name in (*EFFECTS, *SENSOR_EFFECTS):
        effect = EFFECTS[name] if name in EFFECTS else SENSOR_EFFECTS[name]
        _, section = page.split(f"\n## {name}\n")
        section = section.split("\n## ")[0]
        for label, entry in effect.parameters().items():
            (row,) = [line for line in section.splitlines() if line.startswith(f"| `{label}` |")]
            cells = [cell.strip() for cell in row.strip("|").split(" | ")]
            assert cells[2] == entry.unit, (name, label)
            assert all(cells), (name, label)
            (item,) = [line for line in section.splitlines() if line.startswith(f"- `{label}`: ")]
            meaning, _, source = item.removeprefix(f"- `{label}`: ").partition(" Prior: ")
            assert meaning, (name, label)
            assert source.strip(" ."), (name, label)


def test_every_key_of_a_sensor_recipe_is_on_the_page() -> None:
    page = (DOCS / "wind-recipes.md").read_text(encoding="utf-8")
    rows = [line.split("|")[1] for line in page.splitlines() if line.startswith("| `")]
    keys = {key.strip(" `") for row in rows for key in row.split(",")}
    tables = (FileLayout, TimeLayout, ChannelLayout, Sensor, QualityRules, CheckLayout)
    assert {field.name.replace("_", "-") for table in tables for field in fields(table)} <= keys


def test_every_key_of_a_recipes_match_is_on_the_page() -> None:
    page = (
        (DOCS / "wind-recipes.md")
        .read_text(encoding="utf-8")
        .split("Keys of `[match]`")[1]
        .split("\n## ")[0]
    )
    rows = [line.split("|")[1] for line in page.splitlines() if line.startswith("| `")]
    assert sorted(key.strip(" `") for row in rows for key in row.split(",")) == sorted(
        MATCH.split()
    )


def test_every_table_of_a_sensor_recipe_is_on_the_page() -> None:
    page = (DOCS / "wind-recipes.md").read_text(encoding="utf-8")
    tables = {
        "file": "[file]",
        "time": "[time]",
        "channels": "[channels.NAME]",
        "sensor": "[sensor]",
        "rows": "[rows]",
        "quality": "[quality]",
        "checks": "[[check]]",
        "expect": "[expect]",
    }
    for field in fields(Recipe):
        shown = f"## `{tables[field.name]}`" if field.name in tables else f"| `{field.name}` |"
        assert shown in page, field.name


def test_every_kind_of_silent_error_is_on_its_page() -> None:
    page = " ".join((DOCS / "results" / "wind-logs-unseen.md").read_text(encoding="utf-8").split())
    assert [name for name in KINDS if name not in page] == []


def test_the_page_of_python_describes_what_an_answer_has() -> None:
    page = (DOCS / "api.md").read_text(encoding="utf-8")
    section = page.split("\n## Answers\n")[1].split("\n## ")[0]
    first, _, table = section.partition("return an answer")
    names = re.findall(r"`(\w+)`", first)
    assert len(names) >= 4
    for name in names:
        kind = str(inspect.signature(getattr(flagdata, name)).return_annotation)
        assert issubclass(getattr(import_module(f"flagdata.answer.{kind.lower()}"), kind), Answer)
    rows = re.findall(r"^\| (`.*) \| (.*) \|$", table, re.MULTILINE)
    attributes = {one for cell, _ in rows for one in re.findall(r"`(\w+)", cell)}
    private = {"question", "subject", "head", "make_sections"}
    assert {one.name for one in fields(Answer)} - private <= attributes
    assert [one for one in attributes if one not in Answer.__annotations__ | vars(Answer)] == []
    (of_quantity,) = (text for cell, text in rows if cell == "`quantities`")
    known = Quantity.__annotations__ | vars(Quantity)
    assert [one for one in re.findall(r"`(\w+)`", of_quantity) if one not in known] == []
