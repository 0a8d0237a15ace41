"""What holds for every command: its group, `--json` before or after it, sections of a long help."""

from __future__ import annotations

import json
from collections.abc import Iterator

import click
import pytest

from docs.generate_cli import commands
from flagdata import cli
from flagdata.core.console import say
from flagdata.verbs.verb_options import REST, LongCommand
from tests.program import invoke

LONG = 14
"""Options from which on a help is in sections."""


def ends() -> Iterator[tuple[str, click.Command]]:
    """Commands that do something: no groups."""
    yield from (
        (name, command) for name, command in commands() if not isinstance(command, click.Group)
    )


def test_every_command_takes_json() -> None:
    without = [
        name for name, command in ends() if "as_json" not in {one.name for one in command.params}
    ]
    assert len(list(ends())) > 40
    assert without == []


def test_json_before_a_command_is_json_after_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parsed only: what each command does is not what is tested."""
    wrong = []
    for name, command in ends():
        given: dict[str, object] = {}
        words = name.removeprefix("flagdata ").split()
        monkeypatch.setattr(
            command, "invoke", lambda context, given=given: given.update(context.params)
        )
        for parameter in command.params:
            monkeypatch.setattr(parameter, "required", False)
        cli.root.main(["--json", *words], "flagdata", standalone_mode=False)
        wrong += [name] if given.get("as_json") is not True else []
    assert wrong == []


def test_the_help_lists_every_command_once_in_its_group() -> None:
    grouped = [verb for _, verbs in cli.GROUPS.values() for verb in verbs]
    assert sorted(grouped) == sorted(set(grouped)) == sorted(cli.VERBS)
    assert list(cli.GROUPS) == ["field", "look", "physics", "learn", "lake", "project"]
    ended = invoke("--help")
    order = [
        line.split()[0]
        for line in ended.out.splitlines()
        if line[:2] == "  " and line.split()[0] in cli.VERBS
    ]
    assert order == grouped
    assert "Physics (" in ended.out


def test_without_arguments_and_after_help_the_help_is_the_result() -> None:
    wanted = invoke("--help").out
    assert wanted.startswith("Usage: flagdata ")
    assert invoke() == (0, wanted, "")
    assert invoke("help") == (0, wanted, "")
    assert invoke("help", "measure") == (0, invoke("measure", "--help").out, "")
    wrong = invoke("--json", "help", "mesure")
    assert (wrong.code, wrong.document["fix"]) == (2, "did you mean 'measure'?")


def test_a_long_help_is_in_sections_that_hold_each_option_once() -> None:
    long = {
        name: c for name, c in ends() if sum(isinstance(p, click.Option) for p in c.params) >= LONG
    }
    assert len(long) > 6
    for name, command in long.items():
        assert isinstance(command, LongCommand), name
        assert len(command.sections()) > 1, name
        shown = [option.name for options in command.sections().values() for option in options]
        assert sorted(shown) == sorted(
            str(p.name) for p in command.params if isinstance(p, click.Option)
        ), name
        assert len(command.sections()[REST]) <= LONG, name


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_a_shell_gets_its_completion_by_one_command(shell: str) -> None:
    ended = invoke("completion", shell)
    assert ended.code == 0
    assert f"_FLAGDATA_COMPLETE={shell}_complete" in ended.out


def test_verbs_are_completed_without_importing_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cli.LazyGroup, "get_command", lambda *_: pytest.fail("imported"))
    found = cli.root.shell_complete(click.Context(cli.root), "cal")
    assert [(item.value, item.help) for item in found] == [("calibrate", cli.VERBS["calibrate"][1])]


def test_every_name_of_the_catalog_has_a_line() -> None:
    ended = invoke("catalog", "--json")
    kinds = {kind["kind"]: kind["names"] for kind in ended.document["kinds"]}
    assert sorted(kinds) == sorted(cli.NAMES)
    assert kinds["materials"]["paper"] == "Paper"
    assert (
        kinds["models"]["flow"] == "Optical flow to a distribution of wind, area weight and bending"
    )
    assert [
        (kind, name)
        for kind, names in kinds.items()
        for name, line in names.items()
        if len(line) < 4
    ] == []
    assert [
        line for names in kinds.values() for line in names.values() if "functools" in line
    ] == []
    alone = invoke("catalog", "effects").out
    assert "Lift of the faces as thin plates" in alone
    assert "paper" not in alone.split()
    assert json.loads(invoke("--json", "catalog", "scene").out)["fix"] == "did you mean 'scenes'?"


def test_names_whose_library_is_not_installed_are_left_out_with_the_extra_that_brings_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def absent(target: str) -> dict[str, str]:
        if target.startswith("flagdata."):
            return {"one": "it"}
        raise ModuleNotFoundError("No module named 'torch'", name="torch")

    monkeypatch.setattr("flagdata.commands.catalog_names.titles", absent)
    ended = invoke("catalog")
    assert ended.code == 0
    assert ended.out.count("  one") == 3
    assert "effects are left out" in ended.err
    assert "flagdata[physics]" in ended.err
    assert invoke("catalog", "effects").code == 1


def test_a_warning_is_coloured_on_a_terminal_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    printed: list[str] = []
    monkeypatch.setattr(click, "echo", lambda text, **_: printed.append(text))
    monkeypatch.delenv("NO_COLOR", raising=False)
    say("gaps", mark="warning")
    monkeypatch.setenv("NO_COLOR", "1")
    say("gaps", mark="warning")
    assert printed == ["\x1b[33m\x1b[1mwarning:\x1b[0m gaps", "warning: gaps"]
