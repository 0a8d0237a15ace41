"""Pictures of the sheet of drapes: simulated ones, fabrics predicted, and their bending beside
other fabrics'."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from measure.cloth import TABLES
from measure.drape import DrapeBatch, Surface, mesh
from sim.cloth.material import named_material
from sim.cloth.scene import GRAVITY
from tests.evidence import REFERENCE

LENGTHS = (0.012, 0.016, 0.020, 0.025)
_BLUE, _RUST, _GREY = "#2f6690", "#b5532a", "#b9b9b9"


def draw(result: Mapping[str, Any], surface: Surface, target: Path) -> None:
    """Draws four simulated drapes, predictions of specimens left out, and bending lengths against
    weight."""
    figure = Figure(figsize=(11.0, 6.6), layout="constrained")
    grid = figure.add_gridspec(2, 4, height_ratios=(1.0, 1.25))
    count = len(LENGTHS)
    batch = DrapeBatch(
        values={
            "bending_length": np.array(LENGTHS),
            "anisotropy": np.zeros(count),
            "shear": np.full(count, 300.0),
            "rest_curvature": np.zeros(count),
        },
        seeds=tuple(range(count)),
    )
    made, _ = mesh()
    positions = batch.positions()
    figures = batch.read()
    for place, length in enumerate(LENGTHS):
        axes = figure.add_subplot(grid[0, place], projection="3d")
        x, y, z = positions[..., place].T * 1e3
        axes.plot_trisurf(
            x, y, z, triangles=made.faces, color="#d8c3a5", linewidth=0.1, edgecolor="#8a7a66"
        )
        axes.set(xlim=(-130, 130), ylim=(-130, 130), zlim=(-100, 60), box_aspect=(1, 1, 0.62))
        axes.view_init(elev=28, azim=-60)
        axes.set_axis_off()
        axes.set_title(f"bending length {length * 1e3:.0f} mm: {figures[place, 0]:.2f}", fontsize=9)
    _predictions(figure.add_subplot(grid[1, :2]), result, surface)
    _bank(figure.add_subplot(grid[1, 2:]), result)
    figure.savefig(target, dpi=110)


def _predictions(axes: Any, result: Mapping[str, Any], surface: Surface) -> None:
    length = np.geomspace(0.008, 0.032, 60)
    for shear, style in ((100.0, ":"), (390.0, "-"), (1500.0, "--")):
        values = {
            "bending_length": length,
            "anisotropy": np.zeros(60),
            "shear": np.full(60, shear),
            "rest_curvature": np.zeros(60),
        }
        axes.plot(
            length * 1e3,
            surface.at(values)[0][:, 0],
            style,
            color=_GREY,
            label=f"k3/ρ = {shear:.0f} m²/s²",
        )
    for name, fabric in result["fabrics"].items():
        middle, low, high = fabric["fit"]["bending_length_mm"]
        measured = fabric["measured"]
        axes.errorbar(
            middle,
            measured["drape_coefficient"],
            xerr=[[middle - low], [high - middle]],
            yerr=measured["scatter_of_a_specimen"],
            fmt="o",
            color=_BLUE,
        )
        axes.annotate(
            name.replace("_", " "),
            (middle, measured["drape_coefficient"]),
            fontsize=8,
            xytext=(5, -10),
            textcoords="offset points",
        )
    axes.set(xlabel="bending length [mm]", ylabel="drape coefficient", xscale="log")
    axes.legend(fontsize=7, frameon=False)


def bending_length(rigidity: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Computes (B/(ρ g))^(1/3) [mm]."""
    return np.cbrt(rigidity / (weight * -GRAVITY[2])) * 1e3


def bank() -> dict[str, list[float]]:
    """Returns area weight [kg/m²] and bending length [mm] of the catalog's measured cloths, a
    quarter of the mean coefficient of their tables."""
    cloths = {name: named_material(name) for name in TABLES}
    return {
        name: [
            cloth.area_weight,
            float(bending_length(np.array(cloth.bending.mean() / 4), np.array(cloth.area_weight))),
        ]
        for name, cloth in cloths.items()
    }


def cantilevers() -> np.ndarray:
    """Returns (fabric, 2) area weight and bending length of 618 fabrics by the cantilever, of warp
    and weft."""
    table = np.loadtxt(REFERENCE / "fabric" / "drapetester_fabrics.csv", delimiter=",", skiprows=1)
    rigidity = np.sqrt(np.clip(table[:, 1] * table[:, 2], 1e-30, None)) * 1e-9
    return np.stack([table[:, 0], bending_length(rigidity, table[:, 0])], axis=1)


def _bank(axes: Any, result: Mapping[str, Any]) -> None:
    others = cantilevers()
    axes.plot(
        others[:, 0] * 1e3, others[:, 1], ".", color=_GREY, ms=3, label="618 fabrics, cantilever"
    )
    wang = np.array(list(bank().values()))
    axes.plot(
        wang[:, 0] * 1e3,
        wang[:, 1],
        "s",
        color=_RUST,
        ms=5,
        label="the catalog's tables (Wang et al. 2011)",
    )
    for number, fabric in enumerate(result["fabrics"].values()):
        middle, low, high = fabric["fit"]["bending_length_mm"]
        axes.errorbar(
            fabric["area_weight"] * 1e3,
            middle,
            yerr=[[middle - low], [high - middle]],
            fmt="o",
            color=_BLUE,
            label="five fabrics, drape" if not number else None,
        )
    axes.set(
        xlabel="area weight [g/m²]",
        ylabel="bending length [mm]",
        xlim=(0, 600),
        ylim=(5, 50),
        yscale="log",
    )
    axes.legend(fontsize=7, frameon=False)
