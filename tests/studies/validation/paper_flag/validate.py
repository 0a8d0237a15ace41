"""The paper flag in the tunnel: the whole study of the case, and its page for the documentation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from tests.evidence import ABSENT, REFERENCE
from tests.studies.validation.paper_flag.observe import observe
from tests.studies.validation.paper_flag.page import as_json, page
from tests.studies.validation.paper_flag.recipe import load_case
from tests.studies.validation.paper_flag.study import study
from tests.studies.validation.paper_flag.verdict import judge

_ROOT = Path(__file__).parents[4]
_WORK = _ROOT / "out" / "paper-flag"


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """The study; the page goes to docs/cases. That it was left out, and why, where the recordings
    are absent."""
    if not REFERENCE.is_dir():
        return dict(ABSENT)
    case = replace(load_case(), seed=seed)
    seen = observe(case, REFERENCE, keep=_WORK / "kept")
    found = study(case, seen, keep=_WORK / "kept")
    verdict = judge(case, seen, found)
    target = out.parent / "cases" / "paper-flag.html"
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(page(case, seen, found, verdict), encoding="utf-8")
    return as_json(case, seen, found, verdict)
