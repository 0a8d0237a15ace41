"""`validate-simulator.html`: the pictures of the simulator on one page, with the figures that belong to them.

Made of the results in a folder, whichever are there.
"""

from __future__ import annotations

import base64
import html
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 1180px; margin: 2em auto; padding: 0 1em; color: #222; }
h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin-top: 2.2em; }
img { max-width: 100%; } table { border-collapse: collapse; margin: 1em 0; }
td, th { padding: 0.2em 0.9em 0.2em 0; text-align: right; border-bottom: 1px solid #ddd; }
td:first-child, th:first-child { text-align: left; }
"""


@dataclass(frozen=True, kw_only=True)
class Section:
    """A heading, what is to be seen and how to read it, pictures, and a table whose first row is its head."""

    title: str
    text: str
    pictures: Sequence[Path] = ()
    table: Sequence[Sequence[str]] = ()


def draw_page(folder: Path) -> None:
    """Write the page of the results in a folder; nothing where none of them is about the simulator."""
    results = {name: _result(folder, name) for name in ("flags", "verification", "flutter", "arcsim")}
    found = {name: result for name, result in results.items() if result is not None}
    if found:
        sections = [section for name, result in found.items() for section in _SECTIONS[name](result, folder)]
        write_page(folder / "validate-simulator.html", title="The simulator checked", sections=sections)


def _result(folder: Path, name: str) -> dict[str, Any] | None:
    path = folder / f"validate-{name}.json"
    return json.loads(path.read_text(encoding="utf-8"))["result"] if path.is_file() else None


def _flags(result: dict[str, Any], folder: Path) -> list[Section]:
    damping = result["damping"]
    seconds = result["wind"]["seconds"]
    return [
        Section(
            title="Shapes", pictures=[folder / "validate-flags-shapes.png"],
            text="The flag hangs in light wind and streams in strong. The scale between them is the wind whose push on "
            f"the cloth, spread across it, equals its weight: {result['broadside_speed']:.2f} m/s here.",
        ),
        Section(
            title="Against the wind", table=_wind_table(result["wind"]),
            pictures=[folder / "validate-flags-wind.png", folder / "validate-flags-energy.png"],
            text=f"Free edge over {seconds:g} s, once settled. Backward Euler at 5 ms, the paper's step, loses motion "
            "as the reference does at that step. Plus or minus: standard deviation of one replicate.",
        ),
        Section(
            title="Damping", pictures=[folder / "validate-flags-damping.png"],
            text="Without damping the sheet heats up with vibrations of its faces: "
            f"{damping['diverged'][0]} of {damping['replicates']} runs diverged and {damping.get('crumpled', [0])[0]} "
            "crumpled, which `flagdata simulate` reports and does not store. More damping takes motion away, declared "
            "or by backward Euler's step.",
        ),
    ]  # fmt: skip


def _verification(result: dict[str, Any], folder: Path) -> list[Section]:
    pictures = [folder / "validate-verification.png", folder / "validate-verification-tables.png"]
    drift = abs(result["energy"]["error"][-1])
    return [
        Section(
            title="Verification", pictures=pictures,
            text="Closed forms and conservation laws, numbered as in the specification; blue is theory. Energy is kept "
            f"to {drift:.1e} at the smallest step.",
        )
    ]  # fmt: skip


def _flutter(result: dict[str, Any], folder: Path) -> list[Section]:
    pictures = [folder / "validate-flutter.png"]
    if "left_out" not in result["measured"]:
        pictures.append(folder / "validate-flutter-measured.png")
    finest = [list(row["columns"].values())[-1] for row in result["onset"]["rows"]]
    worst = max(abs(row["speed"] - 1) for row in finest if "speed" in row)
    return [
        Section(
            title="Flutter (8)", pictures=pictures,
            text="A clamped sheet with the reactive loading, against the linear calculation of the same equations: "
            f"onsets within {worst:.1%} on the finest mesh. Without the loading there is none. How theory and "
            "experiments of others differ from it is said in tests/validation/flutter_measured.py.",
        )
    ]  # fmt: skip


def _arcsim(result: dict[str, Any], folder: Path) -> list[Section]:
    if "left_out" in result:
        return [Section(title="ArcSim", text=result["left_out"])]
    return [
        Section(
            title="ArcSim", pictures=[folder / "validate-arcsim.png"], table=_reference_table(result["settled"]),
            text="Vertex by vertex while motion is predictable, then in its statistics.",
        )
    ]  # fmt: skip


_SECTIONS = {"flags": _flags, "verification": _verification, "flutter": _flutter, "arcsim": _arcsim}


def _wind_table(summary: dict[str, Any]) -> list[list[str]]:
    names = ("droop", "downwind", "speed", "frequency")
    head = ["wind [m/s]", "droop [m]", "downwind [m]", "speed [m/s]", "frequency [Hz]"]
    rows = [
        [f"{wind:g}"] + [f"{summary[n]['mean'][i]:.3f} ± {summary[n]['deviation'][i]:.3f}" for n in names]
        for i, wind in enumerate(summary["values"])
    ]
    return [head, *rows]


def _reference_table(compared: dict[str, Any]) -> list[list[str]]:
    head = ["ArcSim run", "position off [cm]", "its deviation [cm]", "speed off", "frequency off"]
    return [head] + [
        [
            run, f"{100 * rows['position_off_m']:.1f}", f"{100 * rows['position_deviation_m']:.1f}",
            f"{100 * rows['speed']['off']:+.0f} % ± {100 * rows['speed']['deviation']:.0f} %",
            f"{100 * rows['frequency']['off']:+.0f} % ± {100 * rows['frequency']['deviation']:.0f} %",
        ]
        for run, rows in compared.items()
    ]  # fmt: skip


def write_page(path: Path, *, title: str, sections: Sequence[Section]) -> None:
    """Write the page; it refers to no other file."""
    parts = [
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(title)}</title>',
        f"<style>{_STYLE}</style><h1>{html.escape(title)}</h1>",
    ]
    for section in sections:
        parts.append(f"<h2>{html.escape(section.title)}</h2><p>{html.escape(section.text)}</p>")
        parts += [_picture(picture) for picture in section.pictures]
        if section.table:
            parts.append(_table(section.table))
    path.write_text("\n".join(parts) + "\n", encoding="utf-8")


def _picture(picture: Path) -> str:
    data = base64.b64encode(picture.read_bytes()).decode("ascii")
    return f'<img alt="{html.escape(picture.stem)}" src="data:image/png;base64,{data}">'


def _table(rows: Sequence[Sequence[str]]) -> str:
    head, *body = ("".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in row) for tag, row in _tagged(rows))
    return f"<table><tr>{head}</tr>" + "".join(f"<tr>{row}</tr>" for row in body) + "</table>"


def _tagged(rows: Sequence[Sequence[str]]) -> list[tuple[str, Sequence[str]]]:
    return [("th" if not index else "td", row) for index, row in enumerate(rows)]
