"""The reactive loading beside what others found: Argentina and Mahadevan 2005, d'Adamo and others
2024.

The loading's only parameter is the air's mass M per area, here the same everywhere.

Experiments plotted by Argentina and Mahadevan (ρL/ρₛh from 2.7 to 9.3): the loading with M = ρL/2
flutters at 0.44 to 0.67 of the measured speeds; with M = ρL/4, as waves of 0.8 L have, at 0.53 to
0.76. Their own curves lie below most
measurements too: the highest meets the first and has 0.40 of the speed at heavier air. Curves and
loading differ in how they depend on the mass ratio. Theirs fall, steeply at light air; the reactive
onset rises in steps, where the leading mode changes, from 4.2/√(M/ρL) in the limit of light air,
where the loading is a follower force. What theirs
has and the loading lacks: the wake, whose circulation lags and damps, and an uneven load without a
pressure jump at the free edge. What both lack: the finite height of real sheets, which are more
stable than two-dimensional theory says (Eloy, Lagrange, Souilliez and Schouveiler, J. Fluid Mech.
611:97, 2008).

Paper sheets of d'Adamo: with M = ρL/2 the onset is at half the tunnel's speed, as in the jet's
shear layer, for the shortest sheet (7 cm: 7.1 against 7.3 m/s, 26 against 22 Hz). With the length
the calculation falls faster than the measurement, to 2.4 against 5.3 m/s and 5 against 17 Hz at
15.5 cm: a mass that grows with L is too much for sheets that are longer than high or than their
waves. In the clips of the 13.85 cm sheet, far above the onset, the leading mode at half the
tunnel's speed is 15 to 28 % above the filmed frequency; at the tunnel's full speed it is five times
too fast.
"""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from flagdata.core.arrays import FloatArray
from tests.evidence import ABSENT, REFERENCE
from tests.verification.flutter.beam import Strip, leading, onset, pipe_onset

_FOLDER = REFERENCE / "flutter"

_SHARES = (0.25, 0.5, np.pi / 4)
"""M/(ρ L). π/4: a plate moving broadside, averaged over its chord; ½: what is often taken; ¼: waves
of 0.8 L on both sides of a wide sheet, 2 ρ/k."""

# The paper sheet of d'Adamo and others: 80 g/m², bending stiffness by Stuart loop, air of the day.
_SHEET, _RIGIDITY, _AIR, _LENGTH = 0.080, 1.315e-4, 1.0888, 0.1385
_CLIPS = {7.64: 10.4, 8.09: 11.7, 9.30: 14.5}
"""Tunnel speed [m/s] → flutter frequency [Hz] of the clips, by the column centroids of the dark
line at 1000 Hz."""


def _columns(path: Path) -> dict[str, FloatArray]:
    """Name → (n, 2) of the digitised curves: pairs of columns, the name above the first."""
    rows = list(csv.reader(path.read_text().splitlines()))
    found = {}
    for index, name in enumerate(rows[0]):
        if name:
            pairs = [(row[index], row[index + 1]) for row in rows[2:]]
            found[name] = np.array([(float(x), float(y)) for x, y in pairs if x and y])
    return found


def reactive(mass_ratio: float, *, share: float) -> float:
    """Onset U/√(B/(ρ L³)) of the reactive loading with M = share · ρ L, at ρ L/(ρ_s h); no
    damping."""
    loading = share * mass_ratio
    return pipe_onset(beta=loading / (1 + loading)).speed / float(np.sqrt(share))


def _argentina_mahadevan() -> dict[str, Any]:
    found = _columns(_FOLDER / "argentina_mahadevan_2005_digitised.csv")
    experiments = found["experiments"]
    result: dict[str, Any] = {"experiments": len(experiments)}
    for share in _SHARES:
        ratios = experiments[:, 1] / [reactive(float(x), share=share) for x in experiments[:, 0]]
        result[f"measured_over_reactive_M_{share:.2f}_rho_L"] = ratios.tolist()
    for name, curve in found.items():
        if name != "experiments":
            order = np.argsort(curve[:, 0])
            at = np.interp(experiments[:, 0], curve[order, 0], curve[order, 1])
            result[f"measured_over_{name}"] = (experiments[:, 1] / at).tolist()
    return result


def _paper(length: float) -> Strip:
    return Strip(length=length, mass=_SHEET, rigidity=_RIGIDITY, air_mass=_AIR * length / 2)


def _dadamo() -> dict[str, Any]:
    rows = list(
        csv.DictReader(
            (_FOLDER / "dadamo-2024" / "thresholds_by_length.csv").read_text().splitlines()
        )
    )
    thresholds = []
    for row in sorted(rows, key=lambda r: float(r["L"])):
        length = float(row["L"]) / 100
        found = onset(_paper(length), lowest=0.2, highest=30.0, samples=300)
        thresholds.append(
            {
                "length_m": length,
                "tunnel_speed_flutter": float(row["U_flutter"]),
                "tunnel_speed_bistable": float(row["U_bistable"]),
                "frequency_hz": float(row["f_flutter"]),
                "reactive_onset": found.speed,
                "reactive_frequency_hz": found.frequency / (2 * np.pi),
            }
        )
    clips = []
    for speed, measured in _CLIPS.items():
        at = {
            label: leading(replace(_paper(_LENGTH), speed=speed * share)).imag / (2 * np.pi)
            for label, share in (("tunnel_speed", 1.0), ("half_of_it", 0.5))
        }
        clips.append({"tunnel_speed": speed, "measured_hz": measured, "leading_mode_hz": at})
    return {"air_mass": "rho L / 2", "thresholds": thresholds, "clips": clips}


def compared() -> dict[str, Any]:
    """The comparison; that it was left out, and why, where the reference data are absent."""
    if not _FOLDER.is_dir():
        return dict(ABSENT)
    return {"argentina_mahadevan_2005": _argentina_mahadevan(), "dadamo_2024": _dadamo()}


def plot_measured(rows: list[dict[str, Any]], out: Path) -> None:
    """Onsets in Argentina and Mahadevan's plane, with the simulator's own, and the sheets of
    d'Adamo and others."""
    if not _FOLDER.is_dir():
        return
    found = _columns(_FOLDER / "argentina_mahadevan_2005_digitised.csv")
    figure = Figure(figsize=(12, 4.6), layout="constrained")
    plane, sheets, pitch = figure.subplots(1, 3, width_ratios=(2, 1, 1))
    for name, curve in found.items():
        if name == "experiments":
            plane.plot(*curve.T, "s", color="#222222", label="experiments they cite")
        else:
            plane.plot(
                *curve.T,
                color="#999999",
                lw=1,
                label="their theory" if name.endswith("00") else None,
            )
    ratios = np.geomspace(0.1, 10, 90)
    for share, style in zip(_SHARES, (":", "-", "--"), strict=True):
        onsets = [reactive(float(x), share=share) for x in ratios]
        plane.plot(
            ratios,
            onsets,
            style,
            color="#1f5f8b",
            lw=1.2,
            label=f"reactive loading, M = {share:.2f} ρL",
        )
    half = np.sqrt(0.5)
    points = [
        (2 * row["beta"] / (1 - row["beta"]), row["u"] * finest["speed"] / half)
        for row in rows
        if "speed" in (finest := list(row["columns"].values())[-1])
    ]
    if points:
        plane.plot(
            *zip(*points, strict=True),
            "o",
            color="#b5541c",
            mfc="none",
            label="simulator, M = 0.50 ρL",
        )
    plane.set(xlabel="ρ L / ρₛ h", ylabel="onset  U / √(B / ρ L³)", xlim=(0, 10), ylim=(0, 60))
    plane.legend(frameon=False, fontsize=8, ncols=2, loc="upper right")
    thresholds = _dadamo()["thresholds"]
    length = [row["length_m"] for row in thresholds]
    for axes, parts in (
        (sheets, (("tunnel_speed_flutter", "s"), ("reactive_onset", "o-"))),
        (pitch, (("frequency_hz", "s"), ("reactive_frequency_hz", "o-"))),
    ):
        for key, style in parts:
            colour = "#222222" if style == "s" else "#1f5f8b"
            label = "measured (tunnel)" if style == "s" else "reactive, M = ρL/2"
            axes.plot(
                length,
                [row[key] for row in thresholds],
                style,
                color=colour,
                mfc="none",
                label=label,
            )
    sheets.plot(
        length,
        [row["tunnel_speed_flutter"] / 2 for row in thresholds],
        "x",
        color="#222222",
        label="half of the tunnel's",
    )
    sheets.set(xlabel="length [m]", ylabel="onset of flutter [m/s]", ylim=(0, 20))
    pitch.set(xlabel="length [m]", ylabel="frequency there [Hz]", ylim=(0, 30))
    plane.set_title("two-dimensional sheets: Argentina and Mahadevan 2005", fontsize=9)
    sheets.set_title("paper sheets: d'Adamo and others 2024", fontsize=9)
    sheets.legend(frameon=False, fontsize=7, loc="upper right")
    pitch.legend(frameon=False, fontsize=7, loc="lower left")
    figure.savefig(out / "validate-flutter-measured.png", dpi=110)
