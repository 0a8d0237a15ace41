"""Which films of one flag, of two that overlap, upside down and on their side are refused, and with
which reason.

Constants of the rules were fixed on the films of the seeds `FIXED`; those of another seed judge
(decision 081).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch

from flagdata.core.arrays import UInt8Array
from flagdata.core.rng import child_seed
from flagdata.ingest.films.film_array import Frames
from measure.film import ConditionedFilm
from measure.gate import REASONS
from tests.studies.validation.kinds_films import (
    RATE,
    flights,
    look,
    mirrored,
    on_its_side,
    pair,
    shot,
    upside_down,
)

FIXED = (81, 82)
"""Seeds of the films on which constants were fixed."""
SINGLES, PAIRS = 24, 14
"""Films of one flag, and of two."""
_WARNED = "second-pole-suspected"


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Judges films of a seed, and writes the sheet as JSON and as `validate-kinds.md`."""
    torch.set_num_threads(1)
    rows = [{"film": name, "kinds": found(pictures)} for name, pictures in films(seed)]
    sheet = {
        "seed": seed,
        "fixed_on": " and ".join(map(str, FIXED)),
        "counts": counts(rows),
        "films": rows,
    }
    (out / "validate-kinds.md").write_text(page(sheet), encoding="utf-8")
    return sheet


def films(seed: int) -> Iterator[tuple[str, UInt8Array]]:
    """Makes all films of a seed: what each shows, and its pictures (n, height, width)."""
    flags = flights(seed, SINGLES)
    for k, flight in enumerate(flags):
        own = child_seed(seed, "single", k)
        single = mirrored(shot(flight, look(own), own).pictures, own)
        yield "one flag", single
        yield "upside down", upside_down(single)
        yield "on its side", on_its_side(single, 1 if k % 2 else -1)
    for k in range(PAIRS):
        own = child_seed(seed, "pair", k)
        two = pair(flags[k % SINGLES], flags[(k + 5) % SINGLES], own)
        yield "two flags", mirrored(two.pictures, own)


def found(pictures: UInt8Array) -> list[str]:
    """Returns the kinds of a film's faults, in order, then the warning of a second pole where there
    is one."""
    film = ConditionedFilm(
        Frames(images=pictures, time=np.arange(len(pictures)) / RATE), aspect=1.5
    )
    for _ in film.frames(0.0, film.duration):
        pass
    kinds = [one.kind for one in film.findings()]
    return [kind for kind in kinds if kind in REASONS] + [_WARNED] * (_WARNED in kinds)


def counts(rows: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, int]]:
    """Counts films by what they show, and of these the refused ones, the answered ones with a
    warning, and kinds."""
    sheet: dict[str, dict[str, int]] = {}
    for row in rows:
        own = sheet.setdefault(row["film"], Counter({"films": 0, "refused": 0, "warned": 0}))
        faults = [kind for kind in row["kinds"] if kind in REASONS]
        own["films"] += 1
        own["refused"] += bool(faults)
        own["warned"] += not faults and _WARNED in row["kinds"]
        for kind in faults:
            own[kind] = own.get(kind, 0) + 1
    return {name: dict(own) for name, own in sheet.items()}


def page(sheet: Mapping[str, Any]) -> str:
    """Writes the sheet in Markdown."""
    lines = [
        "# Films that must not be answered",
        "",
        (
            f"Films of seed {sheet['seed']}; constants were fixed on those of the seeds "
            f"{sheet['fixed_on']} "
            "(`python -m tests.studies kinds`)."
        ),
        "",
        "| films of | number | refused | warned of | reasons |",
        "|---|---|---|---|---|",
    ]
    for name, own in sheet["counts"].items():
        reasons = ", ".join(f"`{kind}` {own[kind]}" for kind in REASONS if kind in own) or "none"
        lines.append(
            f"| {name} | {own['films']} | {own['refused']} | {own['warned']} | {reasons} |"
        )
    return "\n".join(lines) + "\n"
