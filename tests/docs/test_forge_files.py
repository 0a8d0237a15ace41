"""What a forge and an editor read: it names commands that there are, and asks what a developer
would ask."""

from __future__ import annotations

import configparser
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[2]
TEMPLATES = sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml"))


def content(path: Path) -> Any:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def targets() -> set[str]:
    """Targets of the Makefile."""
    return set(
        re.findall(
            r"^([a-z][\w-]*):", (ROOT / "Makefile").read_text(encoding="utf-8"), flags=re.MULTILINE
        )
    )


def test_a_change_is_tried_by_the_commands_that_a_developer_types() -> None:
    jobs = content(ROOT / ".github" / "workflows" / "test.yml")["jobs"]
    typed = [step["run"] for job in jobs.values() for step in job["steps"] if "run" in step]
    assert {"make lint", "make test"} <= set(typed)
    assert [command for command in typed if command.removeprefix("make ") not in targets()] == []


def test_hooks_are_the_tools_of_make_lint() -> None:
    (repository,) = content(ROOT / ".pre-commit-config.yaml")["repos"]
    entries = [hook["entry"].split()[0] for hook in repository["hooks"]]
    assert {Path(entry).name for entry in entries} == {"ruff", "pyright"}
    assert all(entry.startswith(".venv/bin/") for entry in entries)


@pytest.mark.parametrize("path", TEMPLATES, ids=lambda path: path.stem)
def test_a_template_asks_for_what_is_needed_to_answer(path: Path) -> None:
    form = content(path)
    assert form["name"]
    assert form["description"]
    fields = [part for part in form["body"] if part["type"] != "markdown"]
    assert len({field["id"] for field in fields}) == len(fields) >= 3
    assert any(field.get("validations", {}).get("required") for field in fields)


def test_an_editor_writes_lines_as_ruff_wants_them() -> None:
    editor = configparser.ConfigParser()
    editor.read_string("[top]\n" + (ROOT / ".editorconfig").read_text(encoding="utf-8"))
    ruff = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["ruff"]
    assert int(editor["*.py"]["max_line_length"]) == ruff["line-length"]
    assert int(editor["*"]["indent_size"]) == 4
