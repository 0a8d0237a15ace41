"""Where does a clamped sheet in a stream begin to flutter, how fast, and what has the reactive
loading to do with it?

The simulator against the linear calculation of the same equations
(`tests.verification.flutter.beam`) over the range of mass ratios and with the mesh; what the
simulator does without the effect; and both beside theory and experiments of others
(`tests.studies.validation.flutter_measured`).
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sim.integrate import BackwardEuler, Symplectic
from tests.studies.validation.flutter_measured import compared, plot_measured
from tests.verification.flutter.beam import Onset, Strip, eigenvalues, leading, onset, pipe_onset
from tests.verification.flutter.strip import crossing, deflections, growth, sweep

_BARE = Strip(length=0.15, mass=0.1, rigidity=5e-5, damping=1e-4)
_RATIOS = (0.1, 0.2, 0.4, 0.5, 0.6, 0.8)
_COLUMNS = (12, 24, 48)
_SHARES = np.array([0.95, 0.99, 1.02, 1.05, 1.1])
_DURATION = 2.0
_SWEPT = (0.2, 0.5)
_THEORY, _SIMULATED, _WITHOUT = "#1f5f8b", "#b5541c", "#444444"


def _loaded(beta: float) -> Strip:
    return replace(_BARE, air_mass=_BARE.mass * beta / (1 - beta))


def _reduced(strip: Strip, found: Onset) -> tuple[float, float]:
    """u = U L √(M/B) and ω L² √((m + M)/B)."""
    time = strip.length**2 * float(np.sqrt((strip.mass + strip.air_mass) / strip.rigidity))
    return found.speed * strip.length * float(
        np.sqrt(strip.air_mass / strip.rigidity)
    ), found.frequency * time


def _onsets() -> dict[str, Any]:
    """Simulated onsets over their theory, at every mass ratio and mesh."""
    strips = [_loaded(beta) for beta in _RATIOS]
    theory = [onset(strip, lowest=0.1, highest=8.0, samples=400) for strip in strips]
    rows: list[dict[str, Any]] = [
        {"beta": beta, "u": _reduced(s, t)[0], "omega": _reduced(s, t)[1], "columns": {}}
        for beta, s, t in zip(_RATIOS, strips, theory, strict=True)
    ]
    for columns in _COLUMNS:
        members = [
            m for s, t in zip(strips, theory, strict=True) for m in sweep(s, _SHARES * t.speed)
        ]
        rates = growth(members, columns=columns, duration=_DURATION).reshape(len(strips), -1)
        for row, expected, found in zip(rows, theory, rates, strict=True):
            row["columns"][str(columns)] = _ratios(expected, found)
    for row in rows:
        errors = [row["columns"][str(c)].get("speed") for c in _COLUMNS]
        if None not in errors:
            shrunk = [abs(error - 1) for error in errors]
            row["observed_rates"] = [float(np.log2(a / b)) for a, b in itertools.pairwise(shrunk)]
    return {
        "length": _BARE.length,
        "mass": _BARE.mass,
        "rigidity": _BARE.rigidity,
        "damping": _BARE.damping,
        "rows": rows,
    }


def _ratios(expected: Onset, rates: NDArray[np.complex128]) -> dict[str, Any]:
    try:
        found = crossing(_SHARES * expected.speed, rates)
    except ValueError as error:
        return {"none": str(error)}
    return {
        "speed": found.speed / expected.speed,
        "frequency": found.frequency / expected.frequency,
    }


def _implicit() -> dict[str, float]:
    """Onset with backward Euler at the paper's step h, over that of the calculation with what the
    step adds.

    To first order in h: damping d + h of the elastic part, and a Coriolis load that is late by h/2,
    since it is taken with the velocity of the step before.
    """
    step = 5e-3
    strip = replace(_loaded(0.5), damping=_BARE.damping + step, lag=step / 2)
    expected = onset(strip, lowest=0.1, highest=8.0)
    speeds = _SHARES * expected.speed
    rates = growth(
        sweep(_loaded(0.5), speeds),
        columns=24,
        duration=_DURATION,
        integrator=BackwardEuler(step=step),
    )
    found = crossing(speeds, rates)
    return {
        "speed": found.speed / expected.speed,
        "frequency": found.frequency / expected.frequency,
    }


def _growth_over_speed() -> dict[str, Any]:
    """Growth rates far around the onset, with the loading and without.

    Of the mode that is largest at the end of the run: well below the onset not always the one that
    decays slowest.
    """
    result: dict[str, Any] = {}
    for beta in _SWEPT:
        strip = _loaded(beta)
        critical = onset(strip, lowest=0.1, highest=8.0).speed
        # What grows fast reaches large slopes, but is also soon alone: a shorter run.
        slow, fast = np.linspace(0.3, 1.1, 9) * critical, np.linspace(1.2, 1.5, 4) * critical
        rates = np.concatenate(
            [
                growth(sweep(strip, slow), columns=24, duration=_DURATION),
                growth(sweep(strip, fast), columns=24, duration=_DURATION / 2.5),
            ]
        )
        speeds, unloaded = np.concatenate([slow, fast]), np.linspace(0.3, 4.0, 14) * critical
        bare = growth(sweep(_BARE, unloaded), columns=24, duration=_DURATION)
        result[_name(beta)] = {
            "critical_speed": critical,
            "speeds": speeds.tolist(),
            "simulated_growth": rates.real.tolist(),
            "simulated_frequency": rates.imag.tolist(),
            "calculated_growth": [leading(member).real for member in sweep(strip, speeds)],
            "without_loading_speeds": unloaded.tolist(),
            "without_loading_growth": bare.real.tolist(),
            "without_loading_frequency": bare.imag.tolist(),
            "frequency_in_vacuum": float(eigenvalues(_BARE)[0].imag),
        }
    return result


def _name(beta: float) -> str:
    return f"M/(m+M) = {beta:g}"


def _amplitudes() -> dict[str, Any]:
    """Tip motion after a push of a tenth of the length: does the sheet keep moving, and how far?

    Null where a member diverged.
    """
    loaded = _loaded(0.5)
    critical = onset(loaded, lowest=0.1, highest=8.0).speed
    shares = np.array([0.5, 0.8, 0.95, 1.05, 1.2, 1.5, 1.8])
    result: dict[str, Any] = {"shares_of_critical_speed": shares.tolist()}
    for label, strip in (("with_loading", loaded), ("without_loading", _BARE)):
        frames = deflections(
            sweep(strip, shares * critical),
            columns=24,
            interval=0.02,
            samples=400,
            integrator=Symplectic(),
            deflection=0.1,
            stretching=50.0,
        )
        tip = frames[:, -1] / strip.length
        for name, part in (("2_to_4_s", tip[100:200]), ("6_to_8_s", tip[300:])):
            rms = np.sqrt(((part - part.mean(0)) ** 2).mean(0))
            result[f"{label}_{name}"] = [
                float(value) if np.isfinite(value) else None for value in rms
            ]
    return result


def _plot(result: dict[str, Any], out: Path) -> None:
    figure = Figure(figsize=(11, 7.5), layout="constrained")
    speed, frequency, rate, tip = figure.subplots(2, 2).ravel()
    betas = np.linspace(0.02, 0.9, 120)
    lines = [pipe_onset(beta=float(beta)) for beta in betas]
    rows = result["onset"]["rows"]
    for axes, name, values, label in (
        (speed, "speed", [line.speed for line in lines], "onset speed  U L √(M/B)"),
        (
            frequency,
            "frequency",
            [line.frequency for line in lines],
            "its frequency  ω L² √((m+M)/B)",
        ),
    ):
        axes.plot(betas, values, color=_THEORY, lw=1.2, label="linear calculation, undamped")
        key = "u" if name == "speed" else "omega"
        for columns, marker in zip(_COLUMNS, "xo.", strict=True):
            found = [
                (row["beta"], row[key], row["columns"][str(columns)].get(name, np.nan))
                for row in rows
            ]
            points = [(beta, expected * ratio) for beta, expected, ratio in found]
            axes.plot(
                *zip(*points, strict=True),
                marker,
                color=_SIMULATED,
                mfc="none",
                label=f"simulator, {columns} columns",
            )
        axes.set(xlabel="mass ratio M/(m+M)", ylabel=label)
    speed.legend(frameon=False, fontsize=8)
    shares = np.linspace(0.3, 1.5, 97)
    for beta, style in zip(_SWEPT, ("-", "--"), strict=True):
        name = _name(beta)
        sweeps = result["growth"][name]
        critical = sweeps["critical_speed"]
        share = np.array(sweeps["speeds"]) / critical
        calculated = [leading(member).real for member in sweep(_loaded(beta), shares * critical)]
        rate.plot(shares, calculated, style, color=_THEORY, lw=1.2, label=f"calculation, {name}")
        rate.plot(
            share,
            sweeps["simulated_growth"],
            "o",
            color=_SIMULATED,
            mfc="none" if style == "-" else None,
            ms=4,
            label=f"simulator, {name}",
        )
        unloaded = np.array(sweeps["without_loading_speeds"]) / critical
        label = "simulator, M = 0" if style == "-" else None
        rate.plot(unloaded, sweeps["without_loading_growth"], ".", color=_WITHOUT, label=label)
    rate.axhline(0, color="#999999", lw=0.6)
    rate.set(
        xlabel="speed / calculated onset",
        ylabel="growth rate of the leading mode [1/s]",
        xlim=(0.25, 2.6),
        ylim=(-6, 16),
    )
    strongest = max(
        abs(v) for sweeps in result["growth"].values() for v in sweeps["without_loading_growth"]
    )
    rate.text(
        2.55,
        -0.3,
        f"M = 0, up to 4 times the onset: within {strongest:.1g} 1/s of 0",
        fontsize=7,
        ha="right",
        va="top",
    )
    rate.legend(frameon=False, fontsize=8, loc="upper right")
    shares = result["amplitude"]["shares_of_critical_speed"]
    for label, colour in (("with_loading", _SIMULATED), ("without_loading", _WITHOUT)):
        for name, style in (("2_to_4_s", "o:"), ("6_to_8_s", "o-")):
            values = [np.nan if v is None else v for v in result["amplitude"][f"{label}_{name}"]]
            text = f"{label}, {name}".replace("_", " ")
            tip.plot(shares, values, style, color=colour, mfc="none", lw=1, label=text)
    tip.set(xlabel="speed / calculated onset", ylabel="tip motion, r.m.s. / L")
    tip.set_title("pushed by 0.1 L, M/(m+M) = 0.5", fontsize=10)
    tip.legend(frameon=False, fontsize=8)
    figure.savefig(out / "validate-flutter.png", dpi=110)


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Nothing here is drawn at random: the seed changes nothing."""
    result = {
        "onset": _onsets(),
        "backward_euler_5_ms": _implicit(),
        "growth": _growth_over_speed(),
        "amplitude": _amplitudes(),
        "measured": compared(),
    }
    _plot(result, out)
    plot_measured(result["onset"]["rows"], out)
    return result
