"""The words of messages, help, docstrings, names of tests, pages and catalogs: none that only this
project uses so."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from tests.contract.imports import ROOT, modules, statements, tree

PRODUCT = ("flagdata", "sim", "models", "measure")
FORBIDDEN = {
    r"(?<![-\w])(un)?told\b": "a file states, the program infers, the user gives, a message reports",
    r"\btells?\b": "a file states, the program infers, the user gives, a message reports",
    r"\b(re)?stated again\b": "converted",
    r"\bstrangers?\b": "other users",
    r"\bstood up\b": "transposed",
    r"\blying\b": "transposed",
    r"\b(nothing|something|little|what|all that) is known of\b": "unknown, or the properties of",
    r"\brooms\b": "stages of",
    r"\b(is|are|was|were) doubted\b": "is reported with a warning",
    r"\b(is|are|was|were) said\b": "is reported, is given",
    r"\bwhoever\b": "the user, the caller",
    r"\bheld against\b": "compared with",
    r"\bintervals? (of [^.;,]{1,30} )?(that )?(hold|holds|held)\b": "contain, include, cover",
}
"""Pattern → what a colleague from another laboratory would say."""
ANY = re.compile("|".join(FORBIDDEN), re.IGNORECASE)


def strings(source: ast.Module) -> list[tuple[int, str]]:
    """(line, text) of all string constants: docstrings, messages, help, the constant parts of
    f-strings."""
    return [
        (node.lineno, node.value)
        for node in ast.walk(source)
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    ]


def comments(text: str) -> list[tuple[int, str]]:
    """(line, text) of what follows a `#` and a blank."""
    return [(number, line.split("# ", 1)[1]) for number, line in lines(text) if "# " in line]


def laws(source: ast.Module) -> list[tuple[int, str]]:
    """(line, text) of what a module of tests says of itself: its docstrings, and the names of its
    tests as words."""
    found = [(1, ast.get_docstring(source) or "")]
    for node in statements(source):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.append((node.lineno, ast.get_docstring(node) or ""))
            if node.name.startswith("test_"):
                found.append((node.lineno, node.name.replace("_", " ")))
    return found


def written() -> list[Path]:
    """The pages of the documentation, templates and catalogs."""
    return sorted(
        [ROOT / "README.md", ROOT / "ARCHITECTURE.md", *(ROOT / "docs").rglob("*.md")]
        + [path for folder in (*PRODUCT, "tests") for path in (ROOT / folder).rglob("*.j2")]
        + list((ROOT / "catalogs").rglob("*.toml"))
    )


def lines(text: str) -> list[tuple[int, str]]:
    """(number from 1, text) of each line."""
    return list(enumerate(text.splitlines(), 1))


def offences(texts: list[tuple[int, str]]) -> list[str]:
    return [
        f"{line}: {found.group()!r}: {plain}"
        for line, text in texts
        if ANY.search(text)
        for pattern, plain in FORBIDDEN.items()
        if (found := re.search(pattern, text, re.IGNORECASE))
    ]


def test_strings_and_comments_of_the_product_use_plain_words() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for path in modules(*PRODUCT)
        for line in offences([*strings(tree(path)), *comments(path.read_text())])
    ]
    assert found == []


def test_pages_templates_and_catalogs_use_plain_words() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for path in written()
        for line in offences(lines(path.read_text()))
    ]
    assert found == []


def test_names_and_docstrings_of_tests_use_plain_words() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for path in modules("tests")
        for line in offences([(1, path.stem.replace("_", " ")), *laws(tree(path))])
    ]
    assert found == []


def test_docstrings_and_parts_of_f_strings_count_and_other_names_do_not() -> None:
    assert len(offences(strings(ast.parse('"""What is told."""\nx = f"it {y} tells"\n')))) == 2
    assert offences(strings(ast.parse("told = file.tell()\n"))) == []
    assert offences(laws(ast.parse('def tell() -> None:\n    print("told")\n'))) == []
    assert len(offences(lines("a wind\nWhoever reads it\nit tells"))) == 2
    assert len(offences(comments("told = 1  # as told\ntold = 2"))) == 1
    assert len(offences(laws(ast.parse('def test_rooms() -> None:\n    """Strangers."""\n')))) == 2
