"""`flagdata catalog`: the names that other commands take, with a line on each."""

from __future__ import annotations

import json
import sys
import textwrap
from collections.abc import Iterator, Mapping
from functools import partial
from importlib import import_module
from pathlib import Path

from flagdata.answer.answer import Answer, Table
from flagdata.core.console import LocalPath, echo, echo_lines, say, table
from flagdata.core.extras import explaining_missing
from flagdata.core.files.outputs import check_file
from flagdata.core.parts import attribute
from flagdata.core.shell import command_line
from flagdata.errors import MissingExtraError, UnknownNameError, UsageError
from flagdata.recipes.registry import PlugInError, Registry
from flagdata.recipes.shelves import Shelf
from flagdata.verbs.verb_options import Result, argument, option, options, verb


@options
class Named:
    """Names of which kind are listed."""

    kind: str | None = argument("Of the names; all kinds by default.", "[KIND]", default=None)
    name: str | None = argument(
        "The one whose recipe is printed; of effects, what it is.", "[NAME]", default=None
    )
    report: Path | None = option(
        "Write the page of an effect, which shows where on a flag it acts.",
        default=None,
        type=LocalPath(),
        metavar="FILE",
    )


@verb(Named, example='flagdata.catalog("effects")["kinds"]')
def catalog(chosen: Named) -> Iterator[Result]:
    """List the names that come with flagdata: scenes, materials, effects, sensors, data sets,
    models and more.

    With KIND that kind alone, a line on each name. With NAME its recipe, as TOML to copy and
    change: of scenes, data sets, trainings, materials and sensors; of an effect its equation,
    parameters, and how verdicts weigh it. What a lake holds is listed by `flagdata ls`.

    \b
      flagdata catalog datasets flagsim-small > mine.toml
      flagdata catalog effects lift --report lift.html
    """
    from flagdata.cli import ANSWERED, NAMES

    kind = chosen.kind
    if kind is not None and kind not in NAMES:
        raise UnknownNameError.of("kind of name", kind, NAMES)
    if chosen.report is not None:
        if kind not in ANSWERED or chosen.name is None:
            raise UsageError(
                "a page is written of one effect alone",
                where="--report",
                fix="give effects and the name of one, or leave it out",
            )
        check_file(chosen.report, command="catalog")
    if kind in ANSWERED and chosen.name is not None:
        with explaining_missing():
            answer: Answer = attribute(ANSWERED[kind])(chosen.name)
        yield Result("catalog-effect", answer.document)
        _print_answer(answer)
        if chosen.report is not None:
            say(f"report: {answer.save(chosen.report)}")
        return
    if kind is not None and chosen.name is not None:
        found_recipe = recipe_of(kind, chosen.name)
        yield Result("catalog-recipe", {"kind": kind, "name": chosen.name, "recipe": found_recipe})
        echo_lines(found_recipe)
        return
    kinds = NAMES if kind is None else {kind: NAMES[kind]}
    found: dict[str, Mapping[str, str]] = {}
    for name, (target, _) in kinds.items():
        try:
            with explaining_missing():
                found[name] = titles(target)
        except MissingExtraError as error:
            if kind is not None:
                raise
            say(f"{name} are left out: {error.what}; {error.fix}", mark="note")
    listed = [
        {"kind": name, "taken_by": kinds[name][1], "names": names} for name, names in found.items()
    ]
    yield Result("catalog", {"kinds": listed})
    if kind is not None:
        table((kind, "what it is"), found[kind].items())
    else:
        for name, names in found.items():
            echo(f"{name} ({kinds[name][1]})")
            echo_lines(
                textwrap.fill(
                    ", ".join(names),
                    initial_indent="  ",
                    subsequent_indent="  ",
                    break_on_hyphens=False,
                    width=80,
                )
            )


def _print_answer(answer: Answer) -> None:
    """Prints an answer's sentence, facts and tables."""
    facts = [f"{name}: {text}" for name, text in answer.head.facts.items()]
    for text in (f"{answer.subject}: {answer.sentence}", *answer.head.remarks, *facts):
        for paragraph in str(text).split("\n\n"):
            echo_lines(textwrap.fill(" ".join(paragraph.split()), width=100))
        echo()
    for section in answer.make_sections():
        for part in section.parts:
            if isinstance(part, Table) and part.columns:
                table(part.columns, part.rows)
                echo()
            elif isinstance(part, Table):
                for name, text in part.rows:
                    echo_lines(textwrap.fill(f"{name}: {text}", width=100, subsequent_indent="  "))


def recipe_of(kind: str, name: str) -> str:
    """Returns the text of a recipe.

    Raises:
        MissingExtraError: its kind needs a package that is not installed.
        UnknownNameError: no such name.
        UsageError: names of this kind have no recipes.
    """
    from flagdata.cli import NAMES

    shelf = attribute(NAMES[kind][0])
    if not isinstance(shelf, Shelf):
        raise UsageError(
            f"{kind} have no recipes: each is code",
            where=f"{kind}: {name}",
            fix=f"{command_line('flagdata', 'catalog', kind)} says what each is",
        )
    return shelf.named(name).text.rstrip("\n")


def titles(target: str) -> Mapping[str, str]:
    """Name → what it is, of a shelf of recipes, a registry, or a folder of networks.

    Args:
        target: "module:attribute".
    """
    module, _, attribute = target.partition(":")
    held = getattr(import_module(module), attribute)
    if isinstance(held, Path):
        cards = {
            path.parent.name: json.loads(path.read_text(encoding="utf-8"))
            for path in held.glob("*/card.json")
        }
        return {name: str(cards[name]["title"]) for name in sorted(cards)}
    registry = held.registry if isinstance(held, Shelf) else held
    found: dict[str, str] = {}
    for name in registry:
        try:
            found[name] = held.title(name) if isinstance(held, Shelf) else _line(held[name])
        except Exception as error:
            package = registry.package(name) if isinstance(registry, Registry) else None
            if package is None:
                raise
            what = (
                error.what
                if isinstance(error, PlugInError)
                else f"{name!r} of {package} cannot be described: {error}"
            )
            say(f"left out: {what}", mark="warning")
    return found


def _line(entry: object) -> str:
    """What an entry of a registry says of itself, or the first line of its module or of itself."""
    if isinstance(entry, partial):
        entry = entry()
    module = sys.modules.get(
        entry.__module__ if isinstance(entry, type) else type(entry).__module__
    )
    texts = (getattr(entry, "about", None), getattr(module, "__doc__", None), entry.__doc__)
    lines = [line for text in texts if text for line in str(text).strip().splitlines()[:1]]
    return lines[0].rstrip(".") if lines else "says nothing of itself"
