"""One page that holds its pictures in itself."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 1180px; margin: 2em auto; padding: 0 1em; color: #222; }
h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin-top: 2.2em; }
img { max-width: 100%; } table { border-collapse: collapse; margin: 1em 0; }
td, th { padding: 0.2em 0.9em 0.2em 0; text-align: right; border-bottom: 1px solid #ddd; }
td:first-child, th:first-child { text-align: left; }
"""


@dataclass(frozen=True, kw_only=True)
class Section:
    """A heading, what is to be seen and how to read it, pictures, and a table whose first row is its head."""

    title: str
    text: str
    pictures: Sequence[Path] = ()
    table: Sequence[Sequence[str]] = ()


def write_page(path: Path, *, title: str, sections: Sequence[Section]) -> None:
    """Write the page; it refers to no other file."""
    parts = [
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(title)}</title>',
        f"<style>{_STYLE}</style><h1>{html.escape(title)}</h1>",
    ]
    for section in sections:
        parts.append(f"<h2>{html.escape(section.title)}</h2><p>{html.escape(section.text)}</p>")
        parts += [_picture(picture) for picture in section.pictures]
        if section.table:
            parts.append(_table(section.table))
    path.write_text("\n".join(parts) + "\n", encoding="utf-8")


def _picture(picture: Path) -> str:
    data = base64.b64encode(picture.read_bytes()).decode("ascii")
    return f'<img alt="{html.escape(picture.stem)}" src="data:image/png;base64,{data}">'


def _table(rows: Sequence[Sequence[str]]) -> str:
    head, *body = ("".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in row) for tag, row in _tagged(rows))
    return f"<table><tr>{head}</tr>" + "".join(f"<tr>{row}</tr>" for row in body) + "</table>"


def _tagged(rows: Sequence[Sequence[str]]) -> list[tuple[str, Sequence[str]]]:
    return [("th" if not index else "td", row) for index, row in enumerate(rows)]
