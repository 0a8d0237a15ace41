"""The one door to the studies: each name leads somewhere, and nothing is imported before it is asked for."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec

import click
import pytest

from flagdata.cli import VERBS, main
from tests.contract.imports import ROOT
from tests.studies import __main__ as door


def test_each_name_leads_to_a_study_with_a_help_of_its_own() -> None:
    context = click.Context(door.studies, info_name="studies")
    for name, (target, about) in door.Studies.verbs.items():
        command = door.studies.get_command(context, name)
        assert isinstance(command, click.Command), name
        assert command.help, name
        assert about.endswith("."), name
        assert find_spec(target.partition(":")[0]) is not None, name
    assert not set(door.Studies.verbs) & set(VERBS)


def test_all_that_follows_a_folders_name_is_passed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[list[str]] = []

    def start(program: str, words: list[str]) -> None:
        started.append(words)
        raise SystemExit(0)

    monkeypatch.setattr(door.os, "execv", start)
    with pytest.raises(SystemExit):
        main(["validation", "flags", "--out", "x", "--seed", "3", "--help"], command=door.studies, name="studies")
    assert started == [[sys.executable, "-m", "tests.validation", "flags", "--out", "x", "--seed", "3", "--help"]]


def test_from_the_root_of_a_checkout_it_helps_and_refuses_as_the_program_does() -> None:
    def run(*words: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "tests.studies", *words]
        return subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)

    shown = run("--help")
    assert (shown.returncode, shown.stderr) == (0, "")
    assert "Usage: python -m tests.studies" in shown.stdout
    for name in door.Studies.verbs:
        assert f"\n  {name} " in shown.stdout
    wrong = run("chalenge")
    assert wrong.returncode == 2
    assert "unknown study 'chalenge'" in wrong.stderr
    assert "did you mean 'challenge'?" in wrong.stderr
    assert "usage:" in run("benchmarks", "--help").stdout.lower()


def test_its_help_imports_no_study() -> None:
    code = (
        "import sys\nfrom flagdata.cli import main\nfrom tests.studies.__main__ import studies\n"
        "try:\n    main(['--help'], command=studies, name='studies')\nexcept SystemExit:\n    pass\n"
        "print('LOADED', sorted(n for n in sys.modules if n == 'torch' or n.startswith('tests.studies.')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.splitlines()[-1] == "LOADED ['tests.studies.__main__']"
