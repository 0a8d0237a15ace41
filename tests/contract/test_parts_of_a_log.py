"""What reads a log exactly knows nothing of drafts, and nothing branches on the wording of a
message."""

from __future__ import annotations

import ast
import sys
from pathlib import Path
from types import FrameType

from flagdata.ingest import WindOptions, read_log
from tests.contract.imports import imported_names

HOUSE = Path(__file__).resolve().parents[2] / "flagdata" / "ingest" / "anemometer"
PACKAGE = "flagdata.ingest.anemometer"
EXACT = ("formats", "samples", "instants", "text", "containers")


def modules(part: str) -> list[Path]:
    return sorted((HOUSE / part).rglob("*.py"))


def test_exact_parts_import_nothing_of_drafts() -> None:
    offenders = [
        str(path.relative_to(HOUSE))
        for part in EXACT
        for path in modules(part)
        if any(
            name.startswith(f"{PACKAGE}.draft")
            for name in imported_names(path.read_text(encoding="utf-8"))
        )
    ]
    assert not offenders


def test_every_part_says_what_it_holds() -> None:
    folders = [path for path in HOUSE.iterdir() if path.is_dir() and any(path.glob("*.py"))]
    texts = {path.name: (path / "__init__.py").read_text(encoding="utf-8") for path in folders}
    assert not [name for name, text in texts.items() if not ast.get_docstring(ast.parse(text))]


def test_nothing_branches_on_the_wording_of_a_message() -> None:
    offenders: list[str] = []
    for path in HOUSE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Compare) and any(
                isinstance(op, ast.In | ast.NotIn) for op in node.ops
            ):
                words = [one for one in node.comparators if isinstance(one, ast.Attribute)]
                if any(one.attr in ("what", "fix") for one in words):
                    offenders.append(f"{path.relative_to(HOUSE)}:{node.lineno}")
    assert not offenders


def test_every_kind_of_finding_is_named_by_a_test() -> None:
    tests = "".join(
        path.read_text(encoding="utf-8") for path in (HOUSE.parents[2] / "tests").rglob("test_*.py")
    )
    kinds = {
        one.value: str(path.relative_to(HOUSE))
        for path in HOUSE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name | ast.Attribute)
        for one in (
            *node.args[: 1 if ast.unparse(node.func) == "Finding.of" else 2],
            *(word.value for word in node.keywords if word.arg == "kind"),
        )
        if isinstance(one, ast.Constant)
        and _makes_a_finding(node)
        and isinstance(one.value, str)
        and "-" in one.value
    }
    assert len(kinds) > 20
    assert {kind: place for kind, place in kinds.items() if f'"{kind}"' not in tests} == {}


def _makes_a_finding(call: ast.Call) -> bool:
    """Whether a call is one of Finding, or of a function to which the kind of one is given."""
    name = call.func.id if isinstance(call.func, ast.Name) else getattr(call.func, "attr", "")
    if name == "of" and isinstance(call.func, ast.Attribute):
        name = getattr(call.func.value, "id", "")
    return name in ("Finding", "_of_cells", "note", "marked", "_report")


def test_a_log_that_names_its_format_enters_few_files(tmp_path: Path) -> None:
    path = tmp_path / "mast.dat"
    rows = "".join(f'"2026-05-01 12:00:{s:02d}",{s},{4 + s % 5}.2,{200 + s}\n' for s in range(40))
    path.write_text(
        '"TOA5","mast","CR1000X","1","Std.05","CPU:mast.CR1X","1","wind"\n"TIMESTAMP","RECORD","WS","WindDir"\n'
        f'"TS","RN","m/s","Deg"\n"","","Smp","Smp"\n{rows}'
    )
    entered: set[str] = set()

    def called(frame: FrameType, event: str, _: object) -> None:
        if event == "call" and frame.f_code.co_name != "<module>":
            entered.add(frame.f_code.co_filename)

    sys.setprofile(called)
    try:
        log = read_log(path, WindOptions(zone="UTC"))
    finally:
        sys.setprofile(None)
    assert len(log.series) == 40
    # Opening a log is a module of its own: beside the text's it would import the containers, which
    # import the text's.
    assert len([name for name in entered if Path(name).is_relative_to(HOUSE)]) <= 24
    formats = {Path(name).stem for name in entered if Path(name).is_relative_to(HOUSE / "formats")}
    assert formats <= {"described", "recipe_headings", "toa5"}
