"""Real flags beside published measurements: the whole study, its page and its picture for the
documentation."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from tests.studies.validation.paper_flag.recipe import load_case
from tests.studies.validation.real_flags.page import page, picture
from tests.studies.validation.real_flags.paper import study
from tests.studies.validation.real_flags.published import PUBLISHED, STREAMING
from tests.studies.validation.real_flags.study import (
    CANDIDATES,
    NAMED,
    TWO,
    Bench,
    judged,
    on_all,
    with_errors,
)

KEEP = Path(__file__).parents[4] / "out" / "real-flags"


def known(value: float) -> float | None:
    """As JSON has it: None where there is none."""
    return value if math.isfinite(value) else None


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Every number with its errors, before and after; the page and the picture go to docs/cases."""
    bench = Bench(keep=KEEP, seed=seed)
    fit = bench.fit(NAMED)
    controls = [bench.fit(name) for name in CANDIDATES if name != NAMED]
    base, after = bench.predictions({}), bench.predictions(fit.effects)
    unfitted = on_all(bench.run(STREAMING, {}, TWO).mean(1))
    paper = study(load_case(), fit.strength, KEEP)
    folder = out.parent / "cases"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "real-flags.md").write_text(
        page(base, after, fit, controls, unfitted, paper), encoding="utf-8"
    )
    picture(base, after, folder / "real-flags.png")
    numbers = [
        {
            "name": one.name,
            "of": name,
            "band": list(band),
            "role": one.role.value,
            "base": known(first[0]),
            "base_error": known(first[1]),
            "base_verdict": judged(*first, band),
            "after": known(second[0]),
            "after_error": known(second[1]),
            "after_verdict": judged(*second, band),
        }
        for one in PUBLISHED
        for (name, band), first, second in zip(
            one.bands.items(), with_errors(one, base), with_errors(one, after), strict=False
        )
    ]
    fits = (fit, *controls)
    return {
        "fits": [
            {"effect": one.name, "strength": one.strength, "refits": list(one.interval)}
            for one in fits
        ],
        "numbers": numbers,
        "paper_flag": {
            name: {
                "share": model.share,
                "factor": known(model.factor),
                "errors": {n: known(e) for n, (e, _) in model.errors.items()},
            }
            for name, model in (("base", paper.base), ("found", paper.found), ("free", paper.free))
        }
        | {
            "numerics": paper.numerics,
            "stops": [
                [length, seen, known(found)] for length, (seen, found) in paper.stops.items()
            ],
        },
    }
