"""The page says what the figures say."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.studies.validation.real_flags.page import page, picture
from tests.studies.validation.real_flags.paper import Model, Paper, measured
from tests.studies.validation.real_flags.published import FLAGS, PUBLISHED
from tests.studies.validation.real_flags.runs import READINGS
from tests.studies.validation.real_flags.study import PROBED, VARIANTS, Fit, Predictions


def predictions(drag: float) -> Predictions:
    """All readings 0.5 ± 0.01 but for the drag."""
    mean = np.full((len(FLAGS), len(READINGS)), 0.5)
    mean[:, READINGS.index("drag")] = drag
    return Predictions(
        mean=mean,
        error=np.full_like(mean, 0.01),
        changes=dict.fromkeys(VARIANTS, mean[: len(PROBED)]),
    )


def test_the_page_has_every_number_with_its_verdicts_and_what_changed(tmp_path: Path) -> None:
    base, after = predictions(0.05), predictions(0.12)
    fit = Fit(name="finite-span-loading", strength=0.3, interval=(0.2, 0.4), readings=after.mean)
    model = Model(
        share=0.3,
        factor=0.6,
        errors={name: (0.05, group) for name, (_, _, group) in measured().items()},
    )
    paper = Paper(
        base=model,
        found=model,
        free=model,
        numerics={"27 × 14 cells": 0.011},
        stops={0.12: (8.0, 9.0)},
    )
    text = page(base, after, fit, [], base.mean, paper)
    assert all(f"| {one.name} |" in text for one in PUBLISHED)
    # EN 1991-1-4 for 284 g/m²: 0.12 ± 30 %; a change of 0.07 is 4.9 times √2 · 0.01.
    assert "0.0839 to 0.156 | 0.05 ± 0.01 | not held | 0.12 ± 0.01 | held | +4.9 |" in text
    assert "3 of 3 held-out" in text
    assert "27 × 14 cells: 1.1%" in text
    assert "| 120 | 8.0 | 9.0 | +12% |" in text
    picture(base, after, tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 10_000
