"""What questions with fixed inputs were answered, beside what they are answered now: words and
places may move, figures not.

The tests of each question compare its document, number by number, with the one that was kept; keys
may have another name since. Simulations are known functions there, so that no figure hangs on a
processor's rounding of a flag in turbulent air.
"""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

KEPT = Path(__file__).parent / "golden"
WRITING = bool(os.environ.get("FLAGDATA_WRITE_GOLDEN"))
"""Whether documents are written anew instead of compared: `FLAGDATA_WRITE_GOLDEN=1 pytest
FILES`."""
RENAMED = {r"((?:cloth|place)\.\w+)\.determined$": r"\1.constrained"}
"""Pattern of a path in a kept document → its path today. Items of a list are numbered:
`windows.0.wind`."""
NEW = (
    r"(?:cloth|place)\.\w+\.given$",
    r"\b(?:unweighed|copied)(?:\.|$)",
    r"test\.(?:directed|course|course_share)$",
    r"provenance\.criteria\.(?:course_share|passing|alike_scores)$",
)
"""Patterns of paths that kept documents lack."""
_OF_A_RUN = {"seconds", "code", "code_version", "created", "version", "milliseconds"}
"""Keys of what another run has otherwise."""


def values(document: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Lists each number, text, null and empty container of a document by its path."""
    if isinstance(document, Mapping) and document:
        for key, value in document.items():
            if key not in _OF_A_RUN:
                yield from values(value, f"{path}.{key}" if path else str(key))
    elif isinstance(document, list) and document:
        for number, value in enumerate(document):
            yield from values(value, f"{path}.{number}" if path else str(number))
    else:
        yield path, document


def today(path: str) -> str:
    """Returns the path that a value has today."""
    for former, present in RENAMED.items():
        path = re.sub(former, present, path)
    return path


def changes(name: str, document: Any, *, relative: float) -> list[str]:
    """Lists what a document says otherwise than the kept one of that name; writes it instead if
    that is asked for.

    Args:
        relative: by how much numbers may differ, of their size.
    """
    file = KEPT / f"{name}.json"
    found = dict(values(json.loads(json.dumps(document))))
    if WRITING:
        file.parent.mkdir(exist_ok=True)
        file.write_text(json.dumps(found, indent=0, ensure_ascii=False) + "\n", encoding="utf-8")
        return []
    kept = {
        today(path): value for path, value in json.loads(file.read_text(encoding="utf-8")).items()
    }
    missing = [f"{path} is gone" for path in kept.keys() - found.keys()]
    added = [
        f"{path} is new"
        for path in found.keys() - kept.keys()
        if not any(re.search(pattern, path) for pattern in NEW)
    ]
    changed = [
        f"{path} was {kept[path]!r}, and is {found[path]!r}"
        for path in kept.keys() & found.keys()
        if not _is_alike(kept[path], found[path], relative)
    ]
    return sorted([*missing, *added, *changed])


def _is_alike(kept: Any, found: Any, relative: float) -> bool:
    if isinstance(kept, float) or isinstance(found, float):
        numbers = isinstance(kept, int | float) and isinstance(found, int | float)
        return numbers and math.isclose(kept, found, rel_tol=relative, abs_tol=1e-9)
    return bool(kept == found)
