"""The verification curves: simulated points, theory over them, and the observed order of
convergence.

Numbered as in the specification; flutter (8) has a set of its own.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from scipy.special import jn_zeros

from flagdata.core.arrays import FloatArray
from tests.studies.validation.flags_runs import one_core
from tests.studies.validation.verification_tables import check, draw_tables
from tests.verification.cases import (
    FRAME,
    OCTAVES,
    SWING_SLOWING,
    G,
    drooped_tips,
    edge_statistics,
    elastica_tip,
    energy_drift,
    fall,
    hung_strip,
    mesh_differences,
    step_errors,
    swing,
    terminal_velocity,
)

MEASURED, THEORY, MARK = "#b5541c", "#1f5f8b", "#777777"
_STRIP, _DENSITY = 0.15, 0.2
_TABLES = (2e-4, 4e-4, 1e-3, 2e-3, 4e-3, 8e-3, 1.5e-2, 4e-2)
_CELLS = (10, 15, 20, 30, 40)
_NESTED = (6, 12, 24, 48)
_MEMBERS = 16
_STATISTICS = ("droop [m]", "downwind [m]", "speed [m/s]", "frequency [Hz]")
_BANDS = tuple(f"{low:g} to {high:g} Hz" for low, high in OCTAVES)
_ORDERS_TRIED = np.linspace(0.25, 5.0, 96)


def rates(sizes: list[float] | tuple[float, ...], errors: list[float]) -> list[float]:
    """Observed orders: slopes of log error against log size between neighbours."""
    pairs = itertools.pairwise(zip(sizes, errors, strict=True))
    return [math.log(b[1] / a[1]) / math.log(b[0] / a[0]) for a, b in pairs]


def _converging(sizes: list[float], errors: list[float]) -> dict[str, Any]:
    return {"size": sizes, "error": errors, "rates": rates(sizes, errors)}


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """The curves, the tables, and their pictures."""
    with one_core():
        result = {**verify(seed), "tables": check()}
        draw_verification(result, out / "validate-verification.png")
        draw_tables(out / "validate-verification-tables.png")
    return result


def verify(seed: int) -> dict[str, Any]:
    """All figures of the verification problems with closed forms, and of convergence."""
    energy = [0.4, 0.2, 0.1, 0.05]
    drift = {share: energy_drift(duration=0.5, share=share) for share in energy}
    rows = [4, 8, 16]
    strips = [hung_strip(n) for n in rows]
    counts = [100, 200, 400, 800]
    falls = [fall(0.3, steps=n)[-1] for n in counts]
    return {
        "energy": {
            "drift_largest_step": energy_drift(duration=3.0, share=energy[0]).tolist(),
            "drift_smallest_step": energy_drift(duration=3.0, share=energy[-1]).tolist(),
            **_converging(energy, [float(np.abs(drift[share]).max()) for share in energy]),
        },
        "hung_strip": {
            "length": strips[0][1],
            **_converging(
                [1 / n for n in rows], [abs(length - expected) for length, expected in strips]
            ),
        },
        "elastica": _elastica(),
        "pendulum": _pendulum(),
        "fall": {
            "terminal": terminal_velocity(),
            "curve": fall(0.6, steps=1200, looks=30).tolist(),
            **_converging([0.3 / n for n in counts], [float(abs(f[2] - f[4])) for f in falls]),
        },
        "step": _converging(
            [FRAME / n for n in (80, 160, 320, 640)],
            step_errors((80, 160, 320, 640), finest=5120).tolist(),
        ),
        "mesh_early": _converging(
            [1.5 / n for n in _NESTED[:-1]], mesh_differences(_NESTED).tolist()
        ),
        "mesh": _mesh(seed),
        "statistics_step": _statistics_step(seed),
    }


def _elastica() -> dict[str, Any]:
    tips = drooped_tips(_TABLES, columns=24, length=_STRIP, area_weight=_DENSITY)
    exact = np.array([elastica_tip(k / 5, _DENSITY * G, _STRIP) for k in _TABLES])
    middle, columns = 2, (6, 12, 24)
    errors = []
    for n in columns:
        found = drooped_tips(
            _TABLES[middle : middle + 1], columns=n, length=_STRIP, area_weight=_DENSITY
        )[0]
        errors.append(float(np.linalg.norm(found - exact[middle])) / _STRIP)
    return {
        "load": [_DENSITY * G * _STRIP**3 / (k / 5) for k in _TABLES],
        "tips": (tips / _STRIP).tolist(),
        "exact": (exact / _STRIP).tolist(),
        "largest_error": float(np.linalg.norm(tips - exact, axis=1).max() / _STRIP),
        **_converging([_STRIP / (n - 0.5) for n in columns], errors),
    }


def _pendulum() -> dict[str, Any]:
    modes, rows = (1, 2, 3, 4), (20, 40, 80)
    found = {n: [swing(mode, rows=n) for mode in modes] for n in rows}
    errors = {n: [abs(measured / exact - 1) for measured, exact in found[n]] for n in rows}
    return {
        "modes": list(modes),
        "slowing": SWING_SLOWING,
        "frequency": [measured / (2 * math.pi) for measured, _ in found[rows[-1]]],
        "exact": [exact / (2 * math.pi) for _, exact in found[rows[-1]]],
        "rows": list(rows),
        "error": {str(n): errors[n] for n in rows},
        "rates": [
            rates([1 / n for n in rows], [errors[n][i] for n in rows]) for i in range(len(modes))
        ],
    }


def _summary(runs: FloatArray) -> dict[str, list[float]]:
    """Droop, downwind distance, speed and frequency of the free edge, powers of the tip: means and
    standard errors."""
    error = runs.std(0, ddof=1) / math.sqrt(len(runs))
    mean = runs.mean(0)
    mean[0] *= -1
    return {"mean": mean.tolist(), "error": error.tolist()}


def observed_order(
    sizes: FloatArray, values: FloatArray, errors: FloatArray
) -> tuple[float, float, float, float]:
    """Weighted least squares of v = v0 + c sᵖ: p with its 68 % range (χ² within 1 of its least),
    and v0.

    The range ends at the ends of what is tried where the values give no bound.
    """
    fits = []
    for order in _ORDERS_TRIED:
        design = np.stack([np.ones_like(sizes), sizes**order], axis=1) / errors[:, None]
        solution, *_ = np.linalg.lstsq(design, values / errors, rcond=None)
        fits.append((float(((design @ solution - values / errors) ** 2).sum()), float(solution[0])))
    squares, limits = np.array(fits).T
    best = int(squares.argmin())
    likely = _ORDERS_TRIED[squares <= squares[best] + 1]
    return float(_ORDERS_TRIED[best]), float(likely[0]), float(likely[-1]), float(limits[best])


def _mesh(seed: int) -> dict[str, Any]:
    each = [
        edge_statistics(n, seed=seed + n, wind=4.0, members=_MEMBERS, share=1.0) for n in _CELLS
    ]
    cells = np.array([1.5 / n for n in _CELLS])
    statistics = [_summary(runs) for runs in each]
    mean, error = (np.array([s[key] for s in statistics]) for key in ("mean", "error"))
    orders = {}
    for index, name in enumerate(_STATISTICS + _BANDS):
        order, low, high, limit = observed_order(cells, mean[:, index], error[:, index])
        orders[name] = {"order": order, "from": low, "to": high, "at_no_cell_size": limit}
    return {"cell": cells.tolist(), "statistics": statistics, "orders": orders}


def _statistics_step(seed: int) -> dict[str, Any]:
    shares = (1.0, 0.5, 0.25)
    each = [
        edge_statistics(15, seed=seed + i, wind=4.0, members=_MEMBERS, share=s)
        for i, s in enumerate(shares)
    ]
    statistics = [_summary(runs) for runs in each]
    mean, error = (np.array([s[key] for s in statistics]) for key in ("mean", "error"))
    centre = (mean / error**2).sum(0) / (1 / error**2).sum(0)
    return {
        "share": list(shares),
        "statistics": statistics,
        "quantities": [*_STATISTICS, *_BANDS],
        # Of the three values about their mean: 2 is expected where the step changes nothing, 6 is
        # exceeded by chance in one of twenty.
        "chi_squared": (((mean - centre) / error) ** 2).sum(0).tolist(),
    }


@dataclass(frozen=True, kw_only=True)
class _Order:
    """How a convergence is drawn: its place, theory's order, labels, and the scale of the sizes
    shown."""

    place: tuple[int, int]
    order: int
    xlabel: str
    ylabel: str
    title: str
    scale: float = 1.0


_ORDERS = {
    "energy": _Order(
        place=(0, 1),
        order=2,
        xlabel="step / stability limit",
        ylabel="largest energy error, relative",
        title="1  undamped vibration, 0.5 s",
    ),
    "hung_strip": _Order(
        place=(0, 2),
        order=2,
        xlabel="cell / length",
        ylabel="error of the length [m]",
        title="2  hung strip, stretched by 4.5 %",
    ),
    "fall": _Order(
        place=(0, 4),
        order=1,
        xlabel="step [ms]",
        ylabel="error of the depth after 0.3 s [m]",
        title="5  falling sheet",
        scale=1e3,
    ),
    "elastica": _Order(
        place=(1, 1),
        order=1,
        xlabel="cell [mm]",
        ylabel="error of the tip / length",
        title="3  elastica, k = 1 mN·m",
        scale=1e3,
    ),
    "step": _Order(
        place=(1, 4),
        order=1,
        xlabel="step [ms]",
        ylabel="vertices from a step of 7.8 µs [m]",
        title="7  flag, 4 m/s, at 0.16 s",
        scale=1e3,
    ),
    "mesh_early": _Order(
        place=(2, 0),
        order=1,
        xlabel="cell [mm]",
        ylabel="mean distance to half the cell [m]",
        title="7  flag, 4 m/s, at 0.16 s",
        scale=1e3,
    ),
}


def _draw_order(axes: Axes, how: _Order, result: dict[str, Any]) -> None:
    size, error = how.scale * np.array(result["size"]), np.array(result["error"])
    line = 1.6 * error[-1] * (size / size[-1]) ** how.order
    axes.loglog(size, error, "o-", color=MEASURED, ms=4, lw=1)
    axes.loglog(size, line, "--", color=THEORY, lw=1)
    axes.text(
        size[0], line[0], f"order {how.order} ", color=THEORY, fontsize=8, ha="right", va="bottom"
    )
    observed = ", ".join(f"{rate:.2f}" for rate in result["rates"])
    axes.set(xlabel=how.xlabel, ylabel=how.ylabel)
    axes.set_title(f"{how.title}\nobserved orders {observed}", fontsize=9)
    _mark_sizes(axes, size)


def _mark_sizes(axes: Axes, size: FloatArray) -> None:
    axes.set_xticks(size, [f"{value:.3g}" for value in size])
    axes.xaxis.set_minor_locator(NullLocator())


def draw_verification(result: dict[str, Any], path: Path) -> None:
    """Problems with closed forms, then convergence."""
    figure = Figure(figsize=(15, 9.6), layout="constrained")
    panels = figure.subplots(3, 5)
    for name, how in _ORDERS.items():
        _draw_order(panels[how.place], how, result[name])
    _draw_energy(panels[0, 0], result["energy"])
    _draw_fall(panels[0, 3], result["fall"])
    _draw_elastica(panels[1, 0], result["elastica"])
    _draw_pendulum(panels[1, 2], panels[1, 3], result["pendulum"])
    for offset, names in enumerate((_STATISTICS[:2], _STATISTICS[2:], _BANDS)):
        _draw_statistics(panels[2, 1 + offset], result["mesh"], names)
    panels[2, 3].set(
        ylabel="upper corner across the wind,\nmean square [m²]", yscale="log", ylim=(5e-4, 0.3)
    )
    _draw_steps(panels[2, 4], result["statistics_step"])
    figure.savefig(path, dpi=90)


def _draw_energy(axes: Axes, result: dict[str, Any]) -> None:
    for key, index, colour in (
        ("drift_largest_step", 0, MEASURED),
        ("drift_smallest_step", -1, THEORY),
    ):
        drift = 1e3 * np.array(result[key])
        label = f"step {result['size'][index]:g} of the limit"
        axes.plot(0.01 * np.arange(1, len(drift) + 1), drift, color=colour, lw=0.9, label=label)
    axes.set(xlabel="time [s]", ylabel="energy error / energy [10⁻³]")
    axes.set_title("1  undamped vibration:\nbounded error", fontsize=9)
    axes.legend(frameon=False, fontsize=8)


def _draw_fall(axes: Axes, result: dict[str, Any]) -> None:
    time, speed, _, exact, _ = np.array(result["curve"]).T
    axes.plot(time, exact, color=THEORY, lw=1.2, label=r"$v_t\,\tanh(g t/v_t)$")
    axes.plot(time, speed, "o", color=MEASURED, ms=3.5, mfc="none", label="simulated")
    axes.axhline(result["terminal"], color=MARK, lw=0.8, ls=":")
    axes.text(
        0.0,
        result["terminal"],
        f"$v_t$ = √(ρₛ g/ρ) = {result['terminal']:.3f} m/s",
        fontsize=8,
        va="bottom",
    )
    axes.set(xlabel="time [s]", ylabel="downward speed [m/s]", ylim=(0, 1.15 * result["terminal"]))
    axes.set_title("5  falling sheet:\n0.15 kg/m², ρ = 1.2 kg/m³", fontsize=9)
    axes.legend(frameon=False, fontsize=8, loc="lower right")


def _draw_elastica(axes: Axes, result: dict[str, Any]) -> None:
    loads = np.geomspace(0.9 * min(result["load"]), 1.1 * max(result["load"]), 60)
    exact = np.array([elastica_tip(1.0, load, 1.0) for load in loads])
    for column, (label, style) in enumerate((("out", "o"), ("down", "s"))):
        axes.semilogx(
            loads, exact[:, column], color=THEORY, lw=1.2, label="elastica" if not column else None
        )
        tips = np.array(result["tips"])[:, column]
        axes.semilogx(
            result["load"],
            tips,
            style,
            color=MEASURED,
            mfc="none",
            ms=5,
            label=f"simulated, {label}",
        )
    axes.set(xlabel="load ρₛ g L³/B", ylabel="tip of the strip / length", ylim=(0, 1.55))
    axes.set_title(
        f"3  heavy elastica, 24 cells:\nwithin {100 * result['largest_error']:.2f} % of L",
        fontsize=9,
    )
    axes.legend(frameon=False, fontsize=8, loc="upper left")


def _draw_pendulum(axes: Axes, errors: Axes, result: dict[str, Any]) -> None:
    modes = np.array(result["modes"])
    exact = np.array([jn_zeros(0, int(n))[-1] for n in modes]) / (4 * math.pi) * math.sqrt(G)
    axes.plot(modes, exact, "_", color=THEORY, ms=18, mew=1.4, label="(j₀ₙ/4π) √(g/L)")
    axes.plot(
        modes,
        result["frequency"],
        "o",
        color=MEASURED,
        mfc="none",
        ms=6,
        label=f"simulated, {result['rows'][-1]} rows",
    )
    axes.set(xlabel="mode", ylabel="frequency [Hz], L = 1 m", xticks=modes, ylim=(0, None))
    axes.set_title("4  hanging sheet's\npendulum modes", fontsize=9)
    axes.legend(frameon=False, fontsize=8)
    size = 1 / np.array(result["rows"])
    table = np.array([result["error"][str(n)] for n in result["rows"]])
    for index, mode in enumerate(modes):
        errors.loglog(
            size, table[:, index], "o-", ms=4, lw=1, color=MEASURED, alpha=1 - 0.2 * index
        )
        errors.text(size[0] * 1.05, table[0, index], f"n = {mode}", fontsize=7, va="center")
    errors.loglog(size, 0.4 * table[-1, 0] * (size / size[-1]) ** 2, "--", color=THEORY, lw=1)
    errors.text(
        size[1],
        0.4 * table[-1, 0] * (size[1] / size[-1]) ** 2,
        "order 2",
        color=THEORY,
        fontsize=8,
        va="top",
    )
    last = ", ".join(f"{mode[-1]:.2f}" for mode in result["rates"])
    errors.axhline(result["slowing"], color=MARK, lw=0.8, ls=":")
    errors.text(
        size[-2],
        result["slowing"],
        "slowing by its static stretch",
        fontsize=7,
        va="top",
        color=MARK,
    )
    errors.set(
        xlabel="cell / length",
        ylabel="frequency error, relative",
        xlim=(size[-1] / 1.2, size[0] * 1.5),
    )
    errors.set_title(f"4  pendulum modes\nlast orders {last}", fontsize=9)
    _mark_sizes(errors, size)


def _draw_statistics(axes: Axes, result: dict[str, Any], names: tuple[str, ...]) -> None:
    """Against the cell, with the order that each approaches its limit in."""
    x = 1e3 * np.array(result["cell"])
    colours = (MEASURED, THEORY, "#6a8f3c", MARK)
    for name, colour in zip(names, colours, strict=False):
        column = (_STATISTICS + _BANDS).index(name)
        mean, error = (
            np.array([s[key][column] for s in result["statistics"]]) for key in ("mean", "error")
        )
        label = f"{name}: {_order_text(result['orders'][name])}"
        axes.errorbar(
            x, mean, yerr=error, fmt="o-", color=colour, lw=1, ms=4, capsize=3, label=label
        )
    axes.set(xlabel="cell [mm]", xlim=(0, 1.1 * max(x)), ylim=(0, None))
    axes.set_title(
        f"7  settled, 4 m/s: {_MEMBERS} runs of 7 s,\n± standard error; order (68 %)", fontsize=9
    )
    axes.legend(frameon=False, fontsize=7, loc="upper left" if len(names) > 2 else "center left")


def _order_text(fit: dict[str, float]) -> str:
    """The range alone where it is open to one side."""
    if fit["from"] == _ORDERS_TRIED[0]:
        return "any" if fit["to"] == _ORDERS_TRIED[-1] else f"below {fit['to']:.1f}"
    if fit["to"] == _ORDERS_TRIED[-1]:
        return f"above {fit['from']:.1f}"
    return f"{fit['order']:.1f} ({fit['from']:.1f}–{fit['to']:.1f})"


def _draw_steps(axes: Axes, result: dict[str, Any]) -> None:
    """How far the statistics are from their mean over the steps, in standard errors."""
    mean, error = (np.array([s[key] for s in result["statistics"]]) for key in ("mean", "error"))
    centre = (mean / error**2).sum(0) / (1 / error**2).sum(0)
    places = np.arange(len(result["quantities"]))
    for share, values, colour in zip(
        result["share"], (mean - centre) / error, (MEASURED, THEORY, MARK), strict=True
    ):
        axes.plot(values, places, "o", color=colour, mfc="none", ms=5, label=f"{share:g} × default")
    axes.axvline(0, color=MARK, lw=0.6)
    axes.set_yticks(places, [name.partition(" [")[0] for name in result["quantities"]], fontsize=7)
    axes.invert_yaxis()
    axes.set(xlabel="from the mean of the three\n[standard errors]", xlim=(-3, 7))
    worst = max(result["chi_squared"])
    axes.set_title(
        f"7  against the step, cell 100 mm:\nχ² at most {worst:.1f}, 2 expected", fontsize=9
    )
    axes.legend(frameon=False, fontsize=7, loc="center right", handletextpad=0.0)
