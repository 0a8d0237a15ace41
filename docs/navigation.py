"""A hook of MkDocs: the decisions, as many as there are, at the end of the navigation."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def on_config(config: Any) -> None:
    """Append the pages of docs/decisions, the index first."""
    folder = Path(config.docs_dir)
    pages = [str(path.relative_to(folder)) for path in sorted(folder.glob("decisions/[0-9]*.md"))]
    config.nav.append({"Decisions": ["decisions/index.md", *pages]})
