"""How the measured tables are read: stiffness between, beyond and below their entries, the entries
over it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import torch
from matplotlib.figure import Figure

from flagdata.core.arrays import FloatArray
from sim.cloth.stiffness_tables import (
    CURVATURE_SPACING,
    GRIDS,
    Evaluation,
    bending_segments,
    bending_stiffness,
    direction_rows,
    sample_stretching,
    stretching_stiffness,
)
from tests.studies.validation.flags_runs import CAMEL

_LINES = {Evaluation.ARCSIM: "-", Evaluation.CORRECTED: "--"}
_COLOURS = ("#b5541c", "#444444", "#1f5f8b", "#6a8f3c")
_NAMES = ("k0, uu·uu", "k1, uu·vv", "k2, vv·vv", "k3, uv·uv")
_FULL = 7 / 6
"""Principal stretch of the tables' rows 1 to 5."""
_CURVES = np.linspace(-45, 35, 641)


def stretching(stretch: FloatArray, angle: FloatArray, evaluation: Evaluation) -> FloatArray:
    """Stiffness of the camel ponte roma pulled along a direction, its width kept.

    Args:
        stretch: (n,) principal stretch along the direction.
        angle: (n,) from u [rad].

    Returns:
        (n, 4) k0 to k3 as they act [N/m].
    """
    c, s = np.cos(angle), np.sin(angle)
    green = (stretch**2 - 1) / 2
    strain = [
        torch.tensor(value)[:, None] for value in (green * c * c, green * s * s, green * s * c)
    ]
    samples = torch.tensor(sample_stretching(CAMEL.stretching, evaluation)[None])
    values = stretching_stiffness(*strain, samples, torch.tensor([0]), GRIDS[evaluation])
    return torch.cat(values, dim=1).numpy()


def tabulated(stretch: FloatArray, angle: FloatArray) -> FloatArray:
    """What the table says there, by its definition alone: linear in the stretch up to 7/6 and
    between its directions, doubled; negative entries as they stand."""
    weight = np.clip((stretch - 1) / (_FULL - 1), 0, 1)[:, None]
    rows = np.stack(
        [np.interp(angle * 8 / math.pi, np.arange(5), column) for column in CAMEL.stretching[1:].T],
        axis=1,
    )
    return 2 * (CAMEL.stretching[0] * (1 - weight) + rows * weight)


def bending(curvature: FloatArray, degrees: float, evaluation: Evaluation) -> FloatArray:
    """(n,) bending stiffness [N·m] of edges in a direction from u, at curvatures [1/m]."""
    rows = torch.tensor(direction_rows(np.full(len(curvature), math.radians(degrees))))
    column = torch.tensor(curvature / CURVATURE_SPACING)[:, None]
    return bending_stiffness(
        column, torch.tensor(bending_segments([CAMEL])), rows, evaluation
    ).numpy()[:, 0]


def check() -> dict[str, Any]:
    """Largest deviations from the table, relative to its largest entry: at its nodes and on the way
    between them."""
    stretch, angle = (
        v.ravel() for v in np.meshgrid(np.linspace(1, 1.3, 61), np.linspace(0, math.pi / 2, 33))
    )
    expected = np.maximum(tabulated(stretch, angle), [0, -np.inf, 0, 0])
    result: dict[str, Any] = {}
    for evaluation in Evaluation:
        goal = np.maximum(expected, 0) if evaluation is Evaluation.ARCSIM else expected
        gap = np.abs(stretching(stretch, angle, evaluation) - goal)
        result[f"stretching_{evaluation.value}_mean"] = float(gap.mean() / expected.max())
        result[f"stretching_{evaluation.value}_largest"] = float(gap.max() / expected.max())
        nodes = [
            bending(np.arange(5) * CURVATURE_SPACING, 45.0 * row, evaluation) / CAMEL.bending[row]
            - 1
            for row in range(3)
        ]
        result[f"bending_{evaluation.value}_at_nodes"] = float(np.abs(nodes).max())
    return result


def draw_tables(path: Path) -> None:
    """Stretching along u and v, around the directions, and bending across the sign of the
    curvature."""
    figure = Figure(figsize=(13, 7.2), layout="constrained")
    panels = figure.subplots(2, 3)
    stretch = np.linspace(0.8, 1.35, 441)
    for axes, degrees in zip(panels[0], (0.0, 45.0, 90.0), strict=True):
        angle = np.full(len(stretch), math.radians(degrees))
        _draw_stiffness(axes, stretch, stretch, angle)
        row = 1 + round(degrees / 22.5)
        for entry, colour in zip(range(4), _COLOURS, strict=True):
            axes.plot(
                [1, _FULL],
                2 * CAMEL.stretching[[0, row], entry],
                "o",
                color=colour,
                ms=5,
                mfc="none",
            )
        axes.set(
            xlabel=f"principal stretch at {degrees:g}° from u, none across",
            ylabel="stiffness as it acts [N/m]",
        )
        axes.axvline(_FULL, color="#999999", lw=0.8, ls=":")
    panels[0, 0].legend(frameon=False, fontsize=8, loc="upper left")
    angle = np.linspace(0, math.pi / 2, 181)
    _draw_stiffness(panels[1, 0], np.degrees(angle), np.full(len(angle), 1.3), angle)
    for entry, colour in zip(range(4), _COLOURS, strict=True):
        panels[1, 0].plot(
            22.5 * np.arange(5),
            2 * CAMEL.stretching[1:, entry],
            "o",
            color=colour,
            ms=5,
            mfc="none",
        )
    panels[1, 0].set(
        xlabel="direction of the larger strain from u [°], stretch 1.3",
        ylabel="stiffness as it acts [N/m]",
    )
    for evaluation, axes in zip(Evaluation, panels[1, 1:], strict=True):
        for row, colour in zip(range(3), (_COLOURS[0], _COLOURS[2], _COLOURS[3]), strict=True):
            values = bending(_CURVES, 45.0 * row, evaluation)
            axes.plot(
                _CURVES,
                1e6 * values,
                _LINES[evaluation],
                color=colour,
                lw=1.2,
                label=f"edge at {45 * row}° from u",
            )
            nodes = np.arange(5) * CURVATURE_SPACING
            axes.plot(nodes, 1e6 * CAMEL.bending[row], "o", color=colour, ms=5, mfc="none")
        axes.axvline(0, color="#999999", lw=0.8, ls=":")
        axes.set(
            xlabel="curvature α [1/m], positive for valleys",
            ylabel="bending stiffness k [µN·m]",
            ylim=(-3, 80),
        )
        axes.set_title(f"bending, {evaluation.value}", fontsize=10)
        axes.legend(frameon=False, fontsize=8)
    figure.suptitle(
        "6  Camel Ponte Roma: circles the measured tables (doubled for stretching, as ArcSim "
        "applies them; it cuts "
        "what is negative to 0),\nsolid ArcSim's evaluation, dashed the corrected one",
        fontsize=10,
    )
    figure.savefig(path, dpi=90)


def _draw_stiffness(axes: Any, x: FloatArray, stretch: FloatArray, angle: FloatArray) -> None:
    for evaluation, style in _LINES.items():
        for values, colour, name in zip(
            stretching(stretch, angle, evaluation).T, _COLOURS, _NAMES, strict=True
        ):
            axes.plot(x, values, style, color=colour, lw=1.2, label=name if style == "-" else None)
    axes.axhline(0, color="#999999", lw=0.5)
