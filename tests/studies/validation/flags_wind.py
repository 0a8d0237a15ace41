"""Curves of the flag's motion: against the wind, in frequency, in energy, and against the
damping."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.signal import welch

from flagdata.core.arrays import FloatArray
from sim.cloth.scene import GRAVITY
from sim.run import CRUMPLED
from tests.studies.validation.arcsim import ReferenceMotion
from tests.studies.validation.flags_runs import (
    CAMEL,
    ENERGY_EVERY,
    RATE,
    REPLICATES,
    SETTLED,
    Ensemble,
)

MOTION, THEORY, IMPLICIT, MARK = "#b5541c", "#1f5f8b", "#6a8f3c", "#444444"
_QUANTITIES = ("droop", "downwind", "speed", "frequency")
_LABELS = {
    "droop": "droop of the free edge\nbelow mid-hoist [m]",
    "downwind": "free edge downwind\nof the hoist [m]",
    "speed": "speed of the free edge,\nmean of |v| [m/s]",
    "frequency": "frequency of the free edge,\nv r.m.s. / (2π x r.m.s.) [Hz]",
}
_MARKERS = {"0.5 ms": "s", "5 ms": "D"}
_LENGTH = 1.5
"""Of the flag along the wind [m]."""
_SEGMENT = 4.0
"""Length of the pieces that spectra are averaged over [s]."""


def _quantity(statistics: FloatArray, name: str) -> FloatArray:
    """(group, replicate) from `Ensemble.statistics`."""
    if name == "droop":
        return 0.5 - statistics[..., 2]
    return statistics[..., {"downwind": 0, "speed": 3, "frequency": 4}[name]]


def summary(ensemble: Ensemble) -> dict[str, Any]:
    """Means over replicates with the standard deviation of one run, for each group."""
    statistics = ensemble.statistics
    result: dict[str, Any] = {
        "values": ensemble.values.tolist(),
        "replicates": statistics.shape[1],
        "seconds": (len(ensemble.settled) - 1) / RATE,
        "compression": _plain(moments(ensemble.compression)[0]),
        "diverged": ensemble.diverged.sum(axis=1).tolist(),
        "crumpled": (~ensemble.diverged & (ensemble.compression > CRUMPLED)).sum(axis=1).tolist(),
        "lasted": ensemble.lasted.mean(axis=1).tolist(),
    }
    for name in _QUANTITIES:
        mean, deviation = moments(_quantity(statistics, name))
        result[name] = {"mean": _plain(mean), "deviation": _plain(deviation)}
    return result


def moments(runs: NDArray[np.floating]) -> tuple[FloatArray, FloatArray]:
    """Mean and standard deviation over the replicates (group, replicate) that are not NaN; NaN
    where fewer than two."""
    rows = [row[np.isfinite(row)].astype(np.float64) for row in runs]
    pairs = [(row.mean(), row.std(ddof=1)) if len(row) > 1 else (np.nan, np.nan) for row in rows]
    mean, deviation = np.array(pairs).T
    return mean, deviation


def _plain(values: FloatArray) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values]


def broadside_speed() -> float:
    """Wind whose force on the cloth spread across it equals the cloth's weight, √(ρ_s g/ρ), ρ = 1
    kg/m³ [m/s]."""
    return math.sqrt(CAMEL.area_weight * -GRAVITY[2])


def _scatter(
    axes: Axes, ensemble: Ensemble, name: str, colour: str, label: str, *, shift: float = 0.0
) -> None:
    runs = _quantity(ensemble.statistics, name)
    x = ensemble.values + shift
    axes.plot(np.repeat(x, runs.shape[1]), runs.ravel(), ".", color=colour, alpha=0.35, ms=4)
    mean, deviation = moments(runs)
    axes.errorbar(x, mean, yerr=deviation, color=colour, lw=1.2, capsize=2, label=label)


def tip_spectrum(ensemble: Ensemble, group: int, corner: int) -> tuple[FloatArray, FloatArray]:
    """Frequencies [Hz], and the power spectral density of a vertex of the free edge across the
    wind, in m²/Hz: one row a replicate."""
    across = ensemble.settled[:, corner, 1, group].astype(np.float64)
    frequency, density = welch(
        across, fs=RATE, nperseg=round(_SEGMENT * RATE), detrend="linear", axis=0
    )
    return frequency, density.T


def draw_wind(
    flags: Ensemble, implicit: Ensemble, references: list[ReferenceMotion], path: Path
) -> dict[str, Any]:
    """Droop, stretch-out, speed and frequency against wind; spectra; returns the spectra's
    peaks."""
    figure = Figure(figsize=(12.5, 7.6), layout="constrained")
    panels = figure.subplots(2, 3)
    for axes, name in zip(panels.ravel(), _QUANTITIES, strict=False):
        _scatter(axes, flags, name, MOTION, "leapfrog, d = 0.25 ms, contact")
        _scatter(axes, implicit, name, IMPLICIT, "backward Euler, 5 ms, no contact", shift=0.1)
        for step, marker in _MARKERS.items():
            there = [r for r in references if r.step == step and r.wind > 0]
            values = [_quantity(r.statistics, name) for r in there]
            axes.plot(
                [r.wind for r in there],
                values,
                marker,
                color="black",
                mfc="none",
                ms=7,
                label=f"ArcSim, {step}",
            )
        axes.axvline(broadside_speed(), color="#999999", lw=0.8, ls=":")
        axes.set(
            xlabel="wind speed [m/s]",
            ylabel=_LABELS[name],
            ylim=(None if name == "droop" else 0, None),
        )
    panels[0, 0].invert_yaxis()
    panels[0, 0].legend(frameon=False, fontsize=8)
    panels[0, 1].text(
        broadside_speed() + 0.1,
        0.02,
        "√(ρₛ g/ρ)",
        transform=panels[0, 1].get_xaxis_transform(),
        fontsize=8,
    )
    peaks = _draw_spectra(panels[1, 1], flags)
    _draw_map(panels[1, 2], flags)
    figure.suptitle(
        f"Free edge after {SETTLED:g} s, dots: replicates of {summary(flags)['seconds']:g} s from "
        "starts with 1 mm of "
        "noise, velocities over 40 ms; bars: standard deviation of one replicate",
        fontsize=10,
    )
    figure.savefig(path, dpi=95)
    return peaks


def _draw_spectra(axes: Axes, flags: Ensemble) -> dict[str, Any]:
    """The upper fly corner across the wind, averaged over replicates, with their spread."""
    peaks: dict[str, Any] = {
        "vertex": "upper fly corner, displacement across the wind (y)",
        "resolution": 1 / _SEGMENT,
    }
    colours = _shades(5)
    for colour, wind in zip(colours, (2.0, 4.0, 6.0, 8.0, 10.0), strict=True):
        frequency, density = tip_spectrum(flags, int(np.flatnonzero(flags.values == wind)[0]), -1)
        mean, error = density.mean(0), density.std(0, ddof=1) / math.sqrt(len(density))
        axes.loglog(frequency[1:], mean[1:], color=colour, lw=1.2, label=f"{wind:g} m/s")
        axes.fill_between(
            frequency[1:],
            np.maximum(mean - error, 1e-3 * mean)[1:],
            (mean + error)[1:],
            color=colour,
            alpha=0.2,
            lw=0,
        )
        peaks[f"{wind:g} m/s"] = float(frequency[1:][np.argmax((frequency * mean)[1:])])
    axes.axvline(12.5, color="#999999", lw=0.8, ls=":")
    axes.text(
        12.2,
        0.96,
        "Nyquist frequency\nat 25 frames/s",
        transform=axes.get_xaxis_transform(),
        fontsize=7,
        ha="right",
        va="top",
    )
    axes.set(
        xlabel="frequency [Hz]",
        ylabel="upper fly corner across the wind,\npower spectral density [m²/Hz]",
        ylim=(1e-8, 3),
    )
    axes.legend(frameon=False, fontsize=8, loc="lower left")
    return peaks


def _shades(count: int) -> list[tuple[float, float, float, float]]:
    return [colormaps["viridis"](share) for share in np.linspace(0.05, 0.85, count)]


def _draw_map(axes: Axes, flags: Ensemble) -> None:
    """The same spectra for every wind."""
    rows = []
    for group in range(len(flags.values)):
        frequency, density = tip_spectrum(flags, group, -1)
        rows.append((frequency * density.mean(0))[1:])
    image = axes.pcolormesh(
        frequency[1:],
        flags.values,
        np.log10(np.maximum(rows, 1e-9)),
        cmap="magma",
        vmin=-6,
        vmax=-1,
        shading="nearest",
    )
    axes.plot(flags.values / (2 * _LENGTH), flags.values, ":", color="black", lw=1.4)
    axes.text(0.5 * 5 / _LENGTH, 5.1, "f L/U = ½ ", color="black", fontsize=9, ha="right")
    axes.set(
        xscale="log",
        xlabel="frequency [Hz]",
        ylabel="wind speed [m/s]",
        title="upper fly corner across the wind",
    )
    axes.title.set_fontsize(9)
    axes.figure.colorbar(image, ax=axes, label="log₁₀ of frequency × density / m²")


def draw_energies(flags: Ensemble, path: Path) -> None:
    """Energies of one replicate against time, with the range of all replicates."""
    figure = Figure(figsize=(12.5, 3.6), layout="constrained")
    panels = figure.subplots(1, 3, sharex=True)
    colours = {"kinetic": MOTION, "stretching": THEORY, "bending": IMPLICIT, "gravity": MARK}
    for axes, wind in zip(panels, (2.0, 6.0, 10.0), strict=True):
        group = int(np.flatnonzero(flags.values == wind)[0])
        for name, colour in colours.items():
            runs = flags.energies[name][:, group]
            time = np.arange(len(runs)) * ENERGY_EVERY / RATE
            axes.plot(time, runs[:, 0], color=colour, lw=0.9, label=name)
            axes.fill_between(time, runs.min(1), runs.max(1), color=colour, alpha=0.15, lw=0)
        axes.axvline(SETTLED, color="#999999", lw=0.8, ls=":")
        axes.set(xlabel="time [s]", title=f"{wind:g} m/s")
        axes.set_yscale("symlog", linthresh=0.01)
        axes.axhline(0, color="#999999", lw=0.5)
    panels[0].set_ylabel("energy [J], linear within ±0.01 J\n(gravity's: from the start)")
    panels[0].legend(frameon=False, fontsize=8, ncols=2)
    figure.suptitle(
        "Energies: line one replicate, band the range of all, contact left out; statistics begin "
        "at the dotted line",
        fontsize=10,
    )
    figure.savefig(path, dpi=95)


def draw_damping(
    declared: Ensemble, implicit: Ensemble, references: list[ReferenceMotion], path: Path
) -> None:
    """What the declared damping d does to the settled flag at 4 m/s; and backward Euler's step in
    its place."""
    figure = Figure(figsize=(12.5, 3.6), layout="constrained")
    panels = figure.subplots(1, 4)
    for axes, name in zip(panels, ("downwind", "speed", "frequency"), strict=False):
        for ensemble, colour, label in (
            (declared, MOTION, "leapfrog: d"),
            (implicit, IMPLICIT, "backward Euler, d = 0: h"),
        ):
            runs = _quantity(ensemble.statistics, name)
            x = 1e3 * ensemble.values
            axes.plot(
                np.repeat(x, runs.shape[1]), runs.ravel(), ".", color=colour, alpha=0.35, ms=4
            )
            mean, deviation = moments(runs)
            axes.errorbar(x, mean, yerr=deviation, color=colour, lw=1.2, capsize=2, label=label)
        for reference in references:
            if reference.wind == 4:
                step, marker = float(reference.step.split()[0]), _MARKERS[reference.step]
                value = _quantity(reference.statistics, name)
                axes.plot(
                    step,
                    value,
                    marker,
                    color="black",
                    mfc="none",
                    ms=7,
                    label=f"ArcSim, h = {reference.step}",
                )
        axes.set(ylabel=_LABELS[name], ylim=(0, None))
    for ensemble, colour in ((declared, MOTION), (implicit, IMPLICIT)):
        mean, deviation = moments(ensemble.compression)
        panels[3].errorbar(
            1e3 * ensemble.values,
            mean,
            yerr=deviation,
            fmt="o-",
            color=colour,
            lw=1.2,
            ms=4,
            capsize=2,
        )
        for value, count in zip(ensemble.values, ensemble.diverged.sum(1), strict=True):
            if count:
                lasted = ensemble.lasted[ensemble.values == value].mean()
                label = f"{count} of {REPLICATES} diverged, after {lasted:.2g} s"
                panels[3].text(
                    1e3 * value,
                    0.01,
                    label,
                    rotation=90,
                    fontsize=7,
                    color=colour,
                    va="bottom",
                    ha="right",
                )
    panels[3].axhline(CRUMPLED, color=MARK, lw=0.8, ls="--")
    panels[3].text(10, CRUMPLED, "reported as crumpled above", fontsize=8, va="top", ha="right")
    panels[3].set(ylabel="compression of the faces, r.m.s.", ylim=(0, None))
    for axes in panels:
        axes.set_xscale("symlog", linthresh=0.05)
        axes.set(
            xlabel="d or h [ms]",
            xlim=(-0.01, 15),
            xticks=[0, 0.1, 1, 10],
            xticklabels=["0", "0.1", "1", "10"],
        )
    panels[0].legend(frameon=False, fontsize=8, loc="lower right")
    figure.suptitle(
        "Damping, wind 4 m/s, contact off: Kelvin–Voigt d (declared), or what backward Euler does "
        "by its step h; axis "
        "linear below 0.05 ms",
        fontsize=10,
    )
    figure.savefig(path, dpi=95)
