"""Which of 40 films without a flag on a pole are answered: ten kinds of things that move, drawn
before scenery.

Each kind is drawn four times, at a place and of a size that the seed gives. In half of the films a
post stands still at
one side of what moves, as a pole would: no rule may rest on the absence of posts. Every film is
measured as `flagdata measure` does by default, as of a flag of 1.5 × 1.0 m. Constants of the rules
were fixed on the films of the seeds `FIXED`; those of another seed judge (decision 085).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch

from flagdata.core.arrays import UInt8Array
from flagdata.core.rng import stream
from flagdata.errors import RefusedError
from flagdata.ingest.films.film_array import Frames
from measure.estimate import Options, measure, of_model
from measure.film import ConditionedFilm, FlagSize
from measure.gate import WindowGate
from measure.measuring_model import Network, gate_beside, network
from sim.assets import Assets
from sim.datasets.camera_picture import noisy
from tests.drawn import no_flag
from tests.studies.validation.films import kind_of

FIXED = (85, 86)
"""Seeds of the films on which constants were fixed."""
KINDS: tuple[Callable[[UInt8Array, np.random.Generator], UInt8Array], ...] = (
    no_flag.leaves,
    no_flag.palms,
    no_flag.water,
    no_flag.crowd,
    no_flag.rotor,
    no_flag.hung,
    no_flag.umbrellas,
    no_flag.birds,
    no_flag.fire,
    no_flag.traffic,
)
OF_EACH = 4
"""Films of a kind."""
RATE, COUNT = 25.0, 150
"""Hz and frames of a film: six seconds."""
WIDTH, HEIGHT = 480, 320
"""Of the picture [px]."""
SIZE = FlagSize(length=1.5, height=1.0)
"""That is stated."""
_SCENERY = ("sky", "hills", "foliage", "buildings")
_SHARE = (0.55, 1.0)
"""Width and height of what is drawn into, in those of the picture."""
_NOISE = {"camera.read_noise": 0.8, "camera.shot_noise": 1.5}
"""Of the camera, in 8-bit steps."""


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Measures films of a seed, and writes the sheet as JSON and as `validate-no-flag.md`."""
    torch.set_num_threads(1)
    model = network(None, lake=None, at=None)
    gate = gate_beside(model, false_alarm=Options().false_alarm)
    rows = [
        {"film": kind, "post": post, **judged(film, model, gate)}
        for kind, post, film in films(seed)
    ]
    sheet = {
        "seed": seed,
        "fixed_on": " and ".join(map(str, FIXED)),
        "counts": counts(rows),
        "films": rows,
    }
    (out / "validate-no-flag.md").write_text(page(sheet), encoding="utf-8")
    return sheet


def films(seed: int) -> Iterator[tuple[str, bool, UInt8Array]]:
    """Makes all films of a seed: the kind, whether a post stands beside it, and its pictures (n,
    height, width)."""
    assets = Assets()
    for kind in KINDS:
        for number in range(OF_EACH):
            rng = stream(seed, "no flag", kind.__name__, number)
            name = f"{_SCENERY[number % len(_SCENERY)]}/{int(rng.integers(12))}"
            behind = cv2.cvtColor(np.asarray(assets.background(name)), cv2.COLOR_RGB2GRAY)
            scenery = cv2.resize(behind, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
            film = np.repeat(np.asarray(scenery, np.uint8)[None], COUNT, axis=0)
            width, height = (
                round(float(share) * whole)
                for share, whole in zip(rng.uniform(*_SHARE, 2), (WIDTH, HEIGHT), strict=True)
            )
            left, top = int(rng.integers(WIDTH - width + 1)), int(rng.integers(HEIGHT - height + 1))
            place = np.s_[:, top : top + height, left : left + width]
            film[place] = kind(film[place], rng)
            post = bool(number % 2)
            if post:
                _stand(film, left + 0.3 * width if rng.random() < 0.5 else left + 0.7 * width, top)
            yield kind.__name__, post, np.stack([noisy(frame, _NOISE, rng) for frame in film])


def _stand(film: UInt8Array, column: float, top: int) -> None:
    """Draws a post down to the lower edge of all pictures (n, height, width)."""
    film[:, top:, round(column) - 2 : round(column) + 2] = 25


def judged(pictures: UInt8Array, model: Network, gate: WindowGate) -> dict[str, Any]:
    """Measures a film: the kinds of its reasons in order, none where it is answered, and then the
    wind [m/s]."""
    film = ConditionedFilm(
        Frames(images=pictures, time=np.arange(len(pictures)) / RATE),
        aspect=SIZE.length / SIZE.height,
    )
    try:
        measured = measure(
            film,
            model.estimator,
            gate=gate,
            dependence=of_model(model.estimator),
            options=Options(size=SIZE),
        )
    except RefusedError as error:
        return {"kinds": [kind_of(error)], "wind": None}
    if measured.verdict.refused:
        return {"kinds": [reason.kind for reason in measured.verdict.reasons], "wind": None}
    return {
        "kinds": [],
        "wind": float(measured.draws[:, measured.names.index("wind_speed")].mean()),
    }


def counts(rows: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Counts the films of each kind, the refused ones, and how often each reason comes first."""
    sheet: dict[str, dict[str, Any]] = {}
    for row in rows:
        of_kind = sheet.setdefault(row["film"], {"films": 0, "refused": 0, "first": Counter()})
        of_kind["films"] += 1
        of_kind["refused"] += bool(row["kinds"])
        of_kind["first"].update(row["kinds"][:1])
    return {name: {**of_kind, "first": dict(of_kind["first"])} for name, of_kind in sheet.items()}


def page(sheet: Mapping[str, Any]) -> str:
    """Writes the sheet in Markdown."""
    answered = [row for row in sheet["films"] if not row["kinds"]]
    lines = [
        "# Films without a flag on a pole",
        "",
        (
            f"{len(answered)} of {len(sheet['films'])} films of seed {sheet['seed']} are answered; "
            "constants were "
            f"fixed on those of the seeds {sheet['fixed_on']} (`python -m tests.studies no-flag`)."
        ),
        "",
        "| films of | number | refused | first reasons |",
        "|---|---|---|---|",
    ]
    for name, of_kind in sheet["counts"].items():
        reasons = (
            ", ".join(f"`{kind}` {count}" for kind, count in of_kind["first"].items()) or "none"
        )
        lines.append(f"| {name} | {of_kind['films']} | {of_kind['refused']} | {reasons} |")
    return "\n".join(lines) + "\n"
