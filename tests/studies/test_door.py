"""The one door to the studies: each name leads somewhere, and nothing is imported before it is
asked for."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import click
import pytest

from flagdata.cli import main
from tests import evidence
from tests.contract.imports import ROOT, tree
from tests.studies import __main__ as door


def command(name: str) -> click.Command:
    found = door.studies.get_command(click.Context(door.studies, info_name="studies"), name)
    assert isinstance(found, click.Command), name
    return found


def test_each_name_leads_to_a_study_with_a_help_of_its_own() -> None:
    assert len(door.Studies.verbs) == sum(len(studies) for _, studies in door.GROUPS.values()), (
        "a name twice"
    )
    for name, (target, about) in door.Studies.verbs.items():
        assert command(name).help, name
        assert about.endswith("."), name
        assert find_spec(target.partition(":")[0]) is not None, name


def test_each_module_of_evidence_has_a_function_that_runs_it() -> None:
    for group in door.KINDS:
        for name, (module, _) in door.GROUPS[group][1].items():
            spec = find_spec(module)
            assert spec is not None, name
            functions = {getattr(node, "name", "") for node in tree(Path(spec.origin or "")).body}
            assert "run" in functions, name


def test_each_module_with_a_command_line_is_one() -> None:
    for name, (module, _) in door.GROUPS["runs"][1].items():
        spec = find_spec(module)
        spec = find_spec(f"{module}.__main__") if spec and spec.submodule_search_locations else spec
        assert spec is not None, name
        assert '__name__ == "__main__"' in Path(spec.origin or "").read_text(encoding="utf-8"), name


def test_all_that_follows_a_modules_name_is_passed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[list[str]] = []

    def start(program: str, words: list[str]) -> None:
        started.append(words)
        raise SystemExit(0)

    monkeypatch.setattr(door.os, "execv", start)
    with pytest.raises(SystemExit):
        main(["failing", "export", "--out", "x", "--help"], command=door.studies, name="studies")
    assert started == [
        [sys.executable, "-m", "tests.studies.failing.campaign", "export", "--out", "x", "--help"]
    ]


@pytest.mark.parametrize(
    ("name", "files"),
    [
        ("gate-clips", ["validate-gate.json"]),
        ("sim-gpu", ["bench-sim-gpu.json"]),
        ("bench", sorted(f"bench-{name}.json" for name in door.GROUPS["speed"][1])),
        (
            "validate",
            sorted(
                f"validate-{door.FILES.get(name, name)}.json" for name in door.GROUPS["evidence"][1]
            ),
        ),
    ],
)
def test_evidence_is_kept_by_kind_and_name_with_its_circumstances(
    name: str, files: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Study:
        """Stands for a module of evidence."""

        @staticmethod
        def run(*, seed: int, out: Path) -> dict[str, int]:
            assert out == tmp_path / "kept"
            return {"drawn by": seed}

    monkeypatch.setattr(evidence, "import_module", lambda module: Study)
    monkeypatch.setattr(evidence, "circumstances", lambda seed: {"seed": seed})
    with pytest.raises(SystemExit) as ended:
        main(
            [name, "--out", str(tmp_path / "kept"), "--seed", "3"],
            command=door.studies,
            name="studies",
        )
    assert ended.value.code == 0
    assert sorted(path.name for path in (tmp_path / "kept").iterdir()) == files
    for path in (tmp_path / "kept").iterdir():
        document = json.loads(path.read_text())
        assert document == {
            "name": path.stem.partition("-")[2],
            "circumstances": {"seed": 3},
            "result": {"drawn by": 3},
        }


def test_from_the_root_of_a_checkout_it_helps_and_refuses_as_the_program_does() -> None:
    def run(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "tests.studies", *words],
            capture_output=True,
            text=True,
            check=False,
            cwd=ROOT,
        )

    shown = run("--help")
    assert (shown.returncode, shown.stderr) == (0, "")
    assert "Usage: python -m tests.studies" in shown.stdout
    for name in door.Studies.verbs:
        assert f"\n  {name} " in shown.stdout
    wrong = run("chalenge")
    assert wrong.returncode == 2
    assert "unknown study 'chalenge'" in wrong.stderr
    assert "did you mean 'challenge'?" in wrong.stderr
    assert "usage:" in run("failing", "--help").stdout.lower()


def test_its_help_imports_no_study() -> None:
    code = (
        "import sys\nfrom flagdata.cli import main\nfrom tests.studies.__main__ import studies\n"
        "try:\n    main(['--help'], command=studies, name='studies')\nexcept SystemExit:\n    "
        "pass\n"
        "print('LOADED', sorted(n for n in sys.modules if n == 'torch' or "
        "n.startswith('tests.studies.')))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert done.stdout.splitlines()[-1] == "LOADED ['tests.studies.__main__']"
