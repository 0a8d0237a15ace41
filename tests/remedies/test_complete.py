"""Every remedy of the product is typed by a test, or stands in a list with the reason why not."""

from __future__ import annotations

import ast
from pathlib import Path

import click

from docs.generate_cli import commands
from tests.contract.imports import tree
from tests.remedies.templates import OPTION, Remedy, remedies, texts, verbs
from tests.remedies.unexecuted import UNEXECUTED
from tests.remedies.user import found

HERE = Path(__file__).parent
EXECUTED = 250
"""Remedies at least that tests type."""
OPTIONS = {
    name: {
        word
        for parameter in command.params
        for word in (*parameter.opts, *parameter.secondary_opts)
    }
    for name, command in commands()
}
OF_PARTS = {
    "flagdata/ingest": ("ingest",),
    "flagdata/align": ("align", "realign", "ingest"),
    "flagdata/export": ("export",),
    "measure/estimate": ("measure",),
    "measure/film": ("measure", "observe", "calibrate"),
    "measure/commands/measur": ("measure",),
    "measure/commands/calibrate": ("calibrate", "observe"),
    "measure/commands/observe": ("observe",),
    "measure/commands/close_loop": ("close-loop",),
    "measure/gate": ("measure",),
    "measure/cloth": ("calibrate", "observe", "close-loop"),
    "measure/drape": ("calibrate",),
    "measure/anemometer": ("calibrate", "measure"),
    "measure/measuring_model": ("calibrate", "measure"),
    "measure/observables": ("observe",),
    "measure/closing": ("close-loop",),
    "measure/trajectories": ("close-loop",),
    "models/training/stated_films": ("evaluate", "train"),
    "models/training": ("train",),
    "models/evaluation": ("evaluate",),
    "sim/blender": ("blender-setup", "build"),
}
"""The commands that print the remedies of a part of the product."""


def claimed() -> set[Remedy]:
    """The remedies that tests of this folder type; each checks when it runs that this is what was
    printed."""
    claims: set[Remedy] = set()
    for path in HERE.glob("test_*.py"):
        source = tree(path)
        names = {
            target.id: node.value.value
            for node in source.body
            if isinstance(node, ast.Assign) and isinstance(node.value, ast.Constant)
            for target in node.targets
            if isinstance(target, ast.Name)
        }
        for node in ast.walk(source):
            if (
                isinstance(node, ast.Call)
                and _callee(node) in ("Case", "meets")
                and len(node.args) > 2
            ):
                module, words = (
                    names[a.id] if isinstance(a, ast.Name) else ast.literal_eval(a)
                    for a in node.args[:2]
                )
                claims.add(found(str(module), str(words)))
    return claims


def _callee(node: ast.Call) -> str:
    return node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")


def test_every_remedy_is_typed_by_a_test_or_listed_with_its_reason() -> None:
    typed = claimed()
    listed = {found(module, words): reason for module, words, reason in UNEXECUTED}
    assert [str(one) for one in remedies() if one not in typed and one not in listed] == []
    assert [str(one) for one in listed if one in typed] == [], "typed by now: take it off the list"
    assert len(typed) >= EXECUTED
    assert all(reason for reason in listed.values())


def test_every_command_and_option_of_a_remedy_exists() -> None:
    wrong = []
    for remedy in texts():
        own = next((OF_PARTS[part] for part in OF_PARTS if remedy.module.startswith(part)), None)
        allowed = verbs(remedy.text) | set(
            own or [name.removeprefix("flagdata ") for name in OPTIONS]
        )
        options = {"--help", "--debug"}.union(*(OPTIONS[f"flagdata {verb}"] for verb in allowed))
        wrong += [
            f"{remedy}: --{name}"
            for name in OPTION.findall(remedy.text)
            if f"--{name}" not in options
        ]
    assert wrong == []


def test_no_remedy_names_an_option_as_a_variable() -> None:
    """As true_fps for --true-fps: a user types what is printed."""
    columns = {"area_weight", "date_order"}
    variables = {
        str(parameter.name)
        for _, command in commands()
        for parameter in command.params
        if isinstance(parameter, click.Option) and "_" in str(parameter.name)
    } - columns
    words = {remedy: {word.strip("(),.;:") for word in remedy.text.split()} for remedy in texts()}
    assert [str(remedy) for remedy, used in words.items() if used & variables] == []
