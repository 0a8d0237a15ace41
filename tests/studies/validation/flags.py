"""Flags in the wind: their shapes and motion against wind, damping and method. Writes
`validate-flags-*.png`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.studies.validation.arcsim import folder, motions
from tests.studies.validation.flags_runs import (
    against_damping,
    against_step,
    against_wind,
    against_wind_implicit,
    one_core,
)
from tests.studies.validation.flags_shapes import draw_shapes
from tests.studies.validation.flags_wind import (
    broadside_speed,
    draw_damping,
    draw_energies,
    draw_wind,
    summary,
)


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """The figures, and their pictures."""
    runs = folder()
    measured = motions(runs) if runs else []
    with one_core():
        flags, implicit = against_wind(seed), against_wind_implicit(seed)
        declared, stepped = against_damping(seed), against_step(seed)
    result: dict[str, Any] = {
        "wind": summary(flags),
        "wind_backward_euler_5_ms": summary(implicit),
        "damping": summary(declared),
        "backward_euler_step": summary(stepped),
        "broadside_speed": broadside_speed(),
    }
    draw_shapes(flags, out / "validate-flags-shapes.png")
    result["spectra"] = draw_wind(flags, implicit, measured, out / "validate-flags-wind.png")
    draw_energies(flags, out / "validate-flags-energy.png")
    draw_damping(declared, stepped, measured, out / "validate-flags-damping.png")
    return result
