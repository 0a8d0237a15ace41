"""What reads a log exactly knows nothing of drafts, and nothing branches on the wording of a message."""

from __future__ import annotations

import ast
from pathlib import Path

from tests.contract.imports import imported_names

HOUSE = Path(__file__).resolve().parents[2] / "flagdata" / "ingest" / "anemometer"
PACKAGE = "flagdata.ingest.anemometer"
EXACT = ("formats", "samples", "instants", "text", "containers")


def modules(part: str) -> list[Path]:
    return sorted((HOUSE / part).rglob("*.py"))


def test_exact_parts_import_nothing_of_drafts() -> None:
    offenders = [
        str(path.relative_to(HOUSE)) for part in EXACT for path in modules(part)
        if any(name.startswith(f"{PACKAGE}.draft") for name in imported_names(path.read_text(encoding="utf-8")))
    ]  # fmt: skip
    assert not offenders


def test_every_part_says_what_it_holds() -> None:
    folders = [path for path in HOUSE.iterdir() if path.is_dir() and any(path.glob("*.py"))]
    texts = {path.name: (path / "__init__.py").read_text(encoding="utf-8") for path in folders}
    assert not [name for name, text in texts.items() if not ast.get_docstring(ast.parse(text))]


def test_nothing_branches_on_the_wording_of_a_message() -> None:
    offenders: list[str] = []
    for path in HOUSE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Compare) and any(isinstance(op, ast.In | ast.NotIn) for op in node.ops):
                words = [one for one in node.comparators if isinstance(one, ast.Attribute)]
                if any(one.attr in ("what", "fix") for one in words):
                    offenders.append(f"{path.relative_to(HOUSE)}:{node.lineno}")
    assert not offenders
