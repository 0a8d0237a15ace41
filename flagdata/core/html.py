"""What a notebook shows of a result: tables, HTML that refers to no other file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape


def table(title: str, rows: Mapping[str, str]) -> str:
    """Writes a title above rows of a name and a value, all of them text."""
    cells = "".join(
        f'<tr><th style="text-align:left">{escape(name)}</th><td '
        f'style="text-align:left">{escape(value)}</td></tr>'
        for name, value in rows.items()
    )
    return f"<div><b>{escape(title)}</b>" + (f"<table>{cells}</table>" if cells else "") + "</div>"


def grid(title: str, names: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Writes a title above a table with a heading, all cells text."""
    head = "".join(f"<th>{escape(name)}</th>" for name in names)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<div><b>{escape(title)}</b><table><tr>{head}</tr>{body}</table></div>"


def image(address: str) -> str:
    """Writes a picture at an address, which may hold the picture."""
    return f'<img src="{escape(address)}">'
