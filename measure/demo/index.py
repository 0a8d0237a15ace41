"""The demonstration's first page: a card a step, and the truth beside what was found."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from flagdata.pages.render import render
from flagdata.provenance import code_version
from measure.demo.cards import Card


def write_index(folder: Path, cards: Sequence[Card], *, seconds: float) -> Path:
    """Write `index.html` into `folder`; it links to the other pages there."""
    target = folder / "index.html"
    values = {"cards": cards, "seconds": seconds, "version": f"flagdata {code_version()}"}
    target.write_text(render("measure.demo", "index.html.j2", values), encoding="utf-8")
    return target
