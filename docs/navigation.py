"""A hook of MkDocs: the decisions, as many as there are, at the end of the navigation."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def on_config(config: Any) -> None:
    """Append the pages of docs/decisions."""
    folder = Path(config.docs_dir)
    pages = [str(path.relative_to(folder)) for path in sorted(folder.glob("decisions/*.md"))]
    if pages:
        config.nav.append({"Decisions": pages})
