"""Real flags beside published measurements: the whole study, its page and its picture for the documentation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.validation.real_flags.page import page, picture
from tests.validation.real_flags.published import PUBLISHED, STREAMING
from tests.validation.real_flags.study import CANDIDATES, NAMED, TWO, Bench, judged, on_all, with_errors

KEEP = Path(__file__).parents[3] / "out" / "real-flags"


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Every number with its errors, before and after; the page and the picture go to docs/cases."""
    bench = Bench(keep=KEEP, seed=seed)
    fit = bench.fit(NAMED)
    controls = [bench.fit(name) for name in CANDIDATES if name != NAMED]
    base, after = bench.predictions({}), bench.predictions(fit.effects)
    unfitted = on_all(bench.run(STREAMING, {}, TWO).mean(1))
    folder = out.parent / "cases"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "real-flags.md").write_text(page(base, after, fit, controls, unfitted), encoding="utf-8")
    picture(base, after, folder / "real-flags.png")
    numbers = [
        {
            "name": one.name, "of": name, "band": list(band), "role": one.role.value,
            "base": first[0], "base_error": first[1], "base_verdict": judged(*first, band),
            "after": second[0], "after_error": second[1], "after_verdict": judged(*second, band),
        }
        for one in PUBLISHED
        for (name, band), first, second in zip(
            one.bands.items(), with_errors(one, base), with_errors(one, after), strict=False
        )
    ]  # fmt: skip
    fits = (fit, *controls)
    return {
        "fits": [{"effect": one.name, "strength": one.strength, "refits": list(one.interval)} for one in fits],
        "numbers": numbers,
    }
