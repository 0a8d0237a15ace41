"""The simulator on a short page of pictures: flags in the wind, how they move, and what that is checked against.

Writes `validate-flags-*.png` and `validate-flags.html`, which holds them all.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch

from tests.validation import flags_reference as reference
from tests.validation.flags_page import Section, write_page
from tests.validation.flags_runs import (
    SETTLED,
    against_damping,
    against_step,
    against_wind,
    against_wind_implicit,
)
from tests.validation.flags_shapes import draw_shapes
from tests.validation.flags_tables import check, draw_tables
from tests.validation.flags_verification import draw_verification, verify
from tests.validation.flags_wind import broadside_speed, draw_damping, draw_energies, draw_wind, summary

_ABSENT = "The folder of reference data is absent (set FLAGDATA_REFERENCE): no comparison with ArcSim."


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """The page, its pictures, and every figure in them."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with torch.no_grad():
            return _page(seed, out)
    finally:
        torch.set_num_threads(threads)


def _page(seed: int, out: Path) -> dict[str, Any]:
    runs = reference.folder()
    measured = reference.motions(runs) if runs else []
    flags, implicit = against_wind(seed), against_wind_implicit(seed)
    declared, stepped = against_damping(seed), against_step(seed)
    result: dict[str, Any] = {
        "wind": summary(flags),
        "wind_backward_euler_5_ms": summary(implicit),
        "damping": summary(declared),
        "backward_euler_step": summary(stepped),
        "broadside_speed": broadside_speed(),
        "tables": check(),
        "verification": verify(seed),
    }
    pictures = {
        name: out / f"validate-flags-{name}.png"
        for name in ("shapes", "wind", "energy", "damping", "verification", "tables")
    }
    draw_shapes(flags, pictures["shapes"])
    result["spectra"] = draw_wind(flags, implicit, measured, pictures["wind"])
    draw_energies(flags, pictures["energy"])
    draw_damping(declared, stepped, measured, pictures["damping"])
    draw_verification(result["verification"], pictures["verification"])
    draw_tables(pictures["tables"])
    if runs:
        result["reference"] = {
            "mean_vertex_distance_m": reference.distances(runs),
            "settled": reference.settled(runs, seed),
        }
        pictures["reference"] = out / "validate-flags-reference.png"
        reference.draw_reference(*result["reference"].values(), pictures["reference"])
    else:
        result["reference"] = {"absent": _ABSENT}
    write_page(
        out / "validate-flags.html",
        title="Flags in the wind: the simulator checked",
        sections=_sections(result, pictures),
    )
    return result


def _sections(result: dict[str, Any], pictures: dict[str, Path]) -> list[Section]:
    compared = result["reference"]
    return [
        Section(
            title="Shapes", pictures=[pictures["shapes"]],
            text="The flag hangs in light wind and streams in strong. The scale between them is the wind whose push on "
            f"the cloth, spread across it, equals its weight: {result['broadside_speed']:.2f} m/s here.",
        ),
        Section(
            title="Against the wind", pictures=[pictures["wind"], pictures["energy"]],
            table=_wind_table(result["wind"]),
            text=f"Free edge after {SETTLED:g} s. Backward Euler at 5 ms, the paper's step, loses motion as the "
            "reference does at that step. Plus or minus: standard deviation of one replicate.",
        ),
        Section(
            title="Damping", pictures=[pictures["damping"]],
            text="Without damping the sheet heats up with vibrations of its faces: "
            f"{result['damping']['diverged'][0]} of {result['damping']['replicates']} runs diverged and "
            f"{result['damping']['crumpled'][0]} crumpled, which `flagdata simulate` reports and does not store. More "
            "damping takes motion away, declared or by backward "
            "Euler's step.",
        ),
        Section(
            title="Verification", pictures=[pictures["verification"], pictures["tables"]],
            text="Closed forms and conservation laws, numbered as in the specification; blue is theory. Flutter (8) "
            "has pictures of its own.",
        ),
        Section(
            title="ArcSim", pictures=[pictures["reference"]] if "reference" in pictures else [],
            table=_reference_table(compared.get("settled", {})),
            text=compared.get("absent", "Vertex by vertex while motion is predictable, then in its statistics."),
        ),
    ]  # fmt: skip


def _wind_table(summary_: dict[str, Any]) -> list[list[str]]:
    names = ("droop", "downwind", "speed", "frequency")
    head = ["wind [m/s]", "droop [m]", "downwind [m]", "speed [m/s]", "frequency [Hz]"]
    rows = [
        [f"{wind:g}"] + [f"{summary_[n]['mean'][i]:.3f} ± {summary_[n]['deviation'][i]:.3f}" for n in names]
        for i, wind in enumerate(summary_["values"])
    ]
    return [head, *rows]


def _reference_table(compared: dict[str, Any]) -> list[list[str]]:
    if not compared:
        return []
    head = ["ArcSim run", "position off [cm]", "its deviation [cm]", "speed off", "frequency off"]
    return [head] + [
        [
            run_, f"{100 * rows['position_off_m']:.1f}", f"{100 * rows['position_deviation_m']:.1f}",
            f"{100 * rows['speed']['off']:+.0f} % ± {100 * rows['speed']['deviation']:.0f} %",
            f"{100 * rows['frequency']['off']:+.0f} % ± {100 * rows['frequency']['deviation']:.0f} %",
        ]
        for run_, rows in compared.items()
    ]  # fmt: skip
