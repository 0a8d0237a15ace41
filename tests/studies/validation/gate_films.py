"""What `flagdata measure` says of 78 films that have a known defect each, of thirteen kinds
(`vtk_films.defects`).

Thresholds were chosen on the films of even number, and the others judge; false alarms are those of
the films of `validation.films`. FLAGDATA_FILMS names the folder of the films, FLAGDATA_GATE_FILMS
("tuned" or "judging") one half of them.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import torch

from flagdata.errors import NotFoundError
from measure.estimate import Options
from measure.film import FlagSize
from measure.gate import WindowGate
from measure.measuring_model import Network, gate_beside, network
from tests.evidence import ABSENT, REFERENCE
from tests.studies.shares import Share
from tests.studies.validation.environments import VTK
from tests.studies.validation.films import answer
from tests.studies.validation.vtk_films.defects import DEFECTS, defect, names, tuned
from tests.studies.validation.vtk_films.making import FOLDER
from tests.studies.validation.vtk_films.runs import HEIGHT, LENGTH

_HALVES = {"tuned": True, "judging": False}


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """The sheet, as JSON and as `validate-gate-films.md`."""
    if not (REFERENCE / "arcsim").is_dir():
        return dict(ABSENT)
    try:
        python = VTK.find()
    except NotFoundError as error:
        return {"left_out": f"{error.what}: {error.fix}"}
    torch.set_num_threads(1)
    found = network(None, lake=None, at=None)
    gate = gate_beside(found, false_alarm=Options().false_alarm)
    only = os.environ.get("FLAGDATA_GATE_FILMS")
    wanted = [
        (kind, number) for kind, number in names() if only is None or tuned(number) == _HALVES[only]
    ]
    rows = [row(kind, number, found, gate, python=python, seed=seed) for kind, number in wanted]
    sheet = {"model": found.estimator.name, "halves": summary(rows), "films": rows}
    (out / "validate-gate-films.md").write_text(page(sheet), encoding="utf-8")
    return sheet


def row(
    kind: str, number: int, found: Network, gate: WindowGate, *, python: Path, seed: int
) -> dict[str, Any]:
    """What `flagdata measure` reports of one film."""
    path = defect(kind, number, folder=FOLDER, python=python)
    said = answer(
        path, found, gate, Options(size=FlagSize(length=LENGTH, height=HEIGHT), seed=seed)
    )
    right = DEFECTS[kind][1]
    return {
        "kind": kind,
        "number": number,
        "tuned": tuned(number),
        "refused": said["refused"],
        "reasons": said["reasons"],
        "why": said["why"],
        "right_first": bool(set(said["reasons"][:1]) & set(right)),
        "right": bool(set(said["reasons"]) & set(right)),
    }


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Of each half: shares, and the same by kind."""
    found = {}
    for half, is_tuned in _HALVES.items():
        own = [one for one in rows if one["tuned"] == is_tuned]
        if own:
            found[half] = {
                "refused": Share.of(one["refused"] for one in own).as_dict(),
                "right_first": Share.of(one["right_first"] for one in own).as_dict(),
                "right": Share.of(one["right"] for one in own).as_dict(),
            }
    return found


def page(sheet: Mapping[str, Any]) -> str:
    """The sheet in Markdown."""
    lines = [
        "# Films with known defects",
        "",
        (
            f"Model {sheet['model']}; {len(sheet['films'])} films of {len(DEFECTS)} kinds, made of "
            "ArcSim's runs "
            "filmed by VTK and of drawn scenes (`python -m tests.studies gate-films`). Thresholds "
            "were chosen on "
            "one half."
        ),
        "",
        "| half | films | refused | the true reason first | among the reasons |",
        "|---|---|---|---|---|",
    ]
    for half, of in sheet["halves"].items():
        cells = " | ".join(_share(of[name]) for name in ("refused", "right_first", "right"))
        lines.append(f"| {half} | {of['refused']['count']} | {cells} |")
    lines += [
        "",
        "| kind | refused | the true reason first | first reasons | one sentence |",
        "|---|---|---|---|---|",
    ]
    for kind in DEFECTS:
        own = [one for one in sheet["films"] if one["kind"] == kind]
        firsts = Counter(one["reasons"][0] if one["reasons"] else "answered" for one in own)
        why = next((one["why"] for one in own if one["right_first"]), "")
        lines.append(
            f"| {kind} | {sum(one['refused'] for one in own)} of {len(own)} | "
            f"{sum(one['right_first'] for one in own)} | "
            f"{', '.join(f'{name} {count}' for name, count in firsts.items())} | {why} |"
        )
    return "\n".join(lines) + "\n"


def _share(of: Mapping[str, Any]) -> str:
    return f"{of['hits']} ({of['value']:.0%} [{of['low']:.0%}, {of['high']:.0%}])"
