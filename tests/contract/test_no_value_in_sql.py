"""No value is pasted into SQL: programs select by values (`flagdata.lake.matching`), and only the
user writes SQL."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from flagdata.lake.selection import COLUMNS
from tests.contract.imports import ROOT, modules

TAKES_SQL = {
    "rows",
    "pairs",
    "sides",
    "sql",
    "execute",
    "query",
    "select",
    "Request",
    "ExplicitSplit",
    "_clips",
}
"""Functions of this project and of DuckDB that take SQL as their first argument or by a keyword of
`SQL_KEYWORDS`."""
SQL_KEYWORDS = {"where", "sql", "order", "query"}
COLUMN = rf"(?:(?<![\w.\"])(?:{'|'.join(COLUMNS)})|\"(?:{'|'.join(COLUMNS)})\")"
COMPARED = r"\s+(?:like|between)\s+'?%?|\s+in\s*\('?|\s*(?:=|<>|!=|<=|>=|<|>)\s*'"
AMONG_OTHERS = rf"\b(?:and|or|where|not)\s+{COLUMN}\s*(?:=|<>|!=|<=|>=|<|>)\s*"
BEFORE_A_VALUE = re.compile(rf"(?:{COLUMN}(?:{COMPARED})|{AMONG_OTHERS})$", re.IGNORECASE)
"""A column and an operator at the end of a piece of text, behind which a value is pasted."""
OPERATOR = r"(?:\s+(?:like|between|in)\s*|\s*(?:=|<>|!=|<=|>=|<|>)\s*)"
SUSPECT = re.compile(
    rf"\b(?:{'|'.join(TAKES_SQL)})\(|\b(?:{'|'.join(COLUMNS)})\b\\?\"?{OPERATOR}\(?\\?['{{%]",
    re.IGNORECASE,
)
"""What is in each module that has anything to do with SQL; parsing the others takes a second."""
NAMES_ALONE = {
    "flagdata/lake/catalog_sql.py": "names of the schema's columns",
    "flagdata/ingest/anemometer/documents/sqlite.py": "names of another file's tables, quoted",
}
"""Modules that make SQL out of names, which cannot be parameters."""


def pasted(source: str) -> Iterator[int]:
    """Lines of a module at which a value is put into SQL."""
    if not SUSPECT.search(source):
        return
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.JoinedStr | ast.BinOp | ast.Call):
            if any(BEFORE_A_VALUE.search(text) for text in _pieces(node)):
                yield node.lineno
        elif isinstance(node, ast.FunctionDef):
            yield from _into_calls(node)


def _pieces(node: ast.AST) -> Iterator[str]:
    """Texts directly before a value, in an f-string, a sum of texts, `text % values` or
    `text.format(values)`."""
    if isinstance(node, ast.JoinedStr):
        for one, other in zip(node.values, node.values[1:], strict=False):
            if isinstance(one, ast.Constant) and isinstance(other, ast.FormattedValue):
                yield str(one.value)
    elif (
        isinstance(node, ast.BinOp)
        and isinstance(node.op, ast.Add)
        and isinstance(node.left, ast.Constant)
    ):
        yield str(node.left.value)
    elif (
        isinstance(node, ast.BinOp)
        and isinstance(node.op, ast.Add)
        and isinstance(node.left, ast.BinOp)
    ):
        if isinstance(node.left.right, ast.Constant):
            yield str(node.left.right.value)
    elif (
        isinstance(node, ast.BinOp)
        and isinstance(node.op, ast.Mod)
        and isinstance(node.left, ast.Constant)
    ):
        yield from re.split(r"(?<=%)[sdrf]", str(node.left.value))[:-1]
    elif isinstance(node, ast.Call) and _name(node.func) == "format":
        for text in ast.walk(node.func):
            if isinstance(text, ast.Constant):
                yield from re.split(r"\{[^}]*\}", str(text.value))[:-1]


def _into_calls(scope: ast.FunctionDef) -> Iterator[int]:
    """Calls that take SQL and are given text that is put together, there or in a variable of the
    same function."""
    made = {
        target.id
        for node in ast.walk(scope)
        if isinstance(node, ast.Assign) and _put_together(node.value)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    for node in ast.walk(scope):
        if isinstance(node, ast.Call) and _name(node.func) in TAKES_SQL:
            given = [
                *node.args[:2],
                *(word.value for word in node.keywords if word.arg in SQL_KEYWORDS),
            ]
            for one in ast.walk(ast.List(elts=given, ctx=ast.Load())):
                if _put_together(one) or (isinstance(one, ast.Name) and one.id in made):
                    yield node.lineno


def _put_together(node: ast.AST) -> bool:
    """Whether a text is made of others that are not all written out."""
    if isinstance(node, ast.JoinedStr):
        return any(isinstance(value, ast.FormattedValue) for value in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Mod):
        return any(
            isinstance(side, ast.JoinedStr) or _is_text(side) for side in (node.left, node.right)
        )
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        return node.func.attr in {"format", "join"} and _is_text(node.func.value)
    return False


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _name(function: ast.AST) -> str:
    if isinstance(function, ast.Attribute):
        return function.attr
    return function.id if isinstance(function, ast.Name) else ""


PASTED = (
    "lake.rows(f\"kind = '{kind}'\")",
    "lake.rows('name = ' + name)",
    "lake.rows(where='name = %s' % name)",
    "source.pairs('name = {}'.format(name))",
    "where = f'{column} > 3'; lake.rows(where)",
    "lake.rows(' and '.join(conditions))",
    "return f\"name like '{dataset}-{side}-%'\"",
    "return 'kind = \\'' + kind + '\\''",
    "return f'seed is not null and frame_count >= {count}'",
)
BESIDE = (
    "lake.rows({'kind': kind})",
    "lake.rows(query)",
    "lake.rows('seed is not null')",
    "say(f'name = {name}')",
)


def test_a_value_that_is_put_into_sql_is_found_and_values_beside_it_are_let_through() -> None:
    assert [
        line for line in PASTED + BESIDE if list(pasted(f"def of(lake):\n    {line}\n"))
    ] == list(PASTED)


def test_no_module_puts_a_value_into_sql() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for path in modules("flagdata", "sim", "models", "measure", "tests/studies/validation")
        if str(path.relative_to(ROOT)) not in NAMES_ALONE
        for line in pasted(path.read_text(encoding="utf-8"))
    ]
    assert found == []
