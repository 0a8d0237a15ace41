"""How often the gate refuses simulated clips, and what it says of 60 clips unlike those the network
was trained on.

The lake is named by FLAGDATA_LAKE and holds the data set `flagsim-wide`. The model is the one that
comes with the package; its gate is read from its folder, or calibrated from the lake where it has
none. False alarms are counted on the test side, one film of each simulation; the 60 clips are made
of other films of the test side (`tests.studies.validation.gate_clips`), which nothing in the gate
was calibrated by.
"""

from __future__ import annotations

import os
import time
from collections import Counter
from pathlib import Path
from typing import Any

import av
import numpy as np
import torch

from flagdata.core.arrays import UInt8Array
from flagdata.errors import NotFoundError
from measure.gate import Gate, judge, read
from measure.gate.window import CONFIDENCE, FALSE_ALARM, Judgement
from models.trained.estimator import SHIPPED, Estimator, load_shipped
from tests.evidence import ABSENT, REFERENCE
from tests.studies.gate import FilmsOf, calibrated, data_of, rate_of
from tests.studies.shares import Share
from tests.studies.validation.gate_clips import KINDS, made, seed_of

LAKE = "FLAGDATA_LAKE"
SOURCES = 60
"""Films of the test side that the clips are made of; the others are judged as they are."""
_CLIP = "video/dyntex_flag_571c110.avi"


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """The sheet, as JSON and as `validate-gate.md`."""
    path = os.environ.get(LAKE)
    if path is None:
        return {
            "left_out": f"no lake; set {LAKE} to one with the data sets that the network was "
            "trained on"
        }
    torch.set_num_threads(1)
    model = load_shipped()
    gate = gate_of(model, Path(path), seed=seed)
    films = FilmsOf(Path(path), data_of(model), "test", rate=rate_of(model))
    with torch.no_grad():
        begun = time.perf_counter()
        plain = [
            judge(films[index][: model.front_end.frames], model, gate)
            for index in range(SOURCES, len(films))
        ]
        seconds = (time.perf_counter() - begun) / len(plain)
        clips = made([films[index] for index in range(SOURCES)], seed=seed_of(seed))
        judged = [(name, judge(clip, model, gate)) for name, clip in clips]
        real = _real(model, gate)
    result = {
        "model": model.name,
        "calibration_clips": len(gate.calibration),
        "false_alarm": FALSE_ALARM,
        "confidence": CONFIDENCE,
        "level": plain[0].level,
        "seconds_a_clip": seconds,
        "plain": _alarms(plain),
        "clips": _refusals(judged),
        "real_clip": real,
    }
    (out / "validate-gate.md").write_text(_page(result), encoding="utf-8")
    return result


def gate_of(model: Estimator, lake: Path, *, seed: int) -> Gate:
    """The gate that is stored beside the model, or a new one."""
    try:
        return read(SHIPPED / model.name, model)
    except NotFoundError:
        train, validation = (
            FilmsOf(lake, data_of(model), side, rate=rate_of(model))
            for side in ("train", "validation")
        )
        return calibrated(model, train, validation, seed=seed, advance=lambda _: None)


def _alarms(plain: list[Judgement]) -> dict[str, Any]:
    refused = [one for one in plain if not one.familiar]
    p = np.array([one.p for one in plain])
    return {
        "clips": len(plain),
        "refused": Share.of(not one.familiar for one in plain).as_dict(),
        "reasons": dict(Counter(one.reasons[0].kind for one in refused)),
        "p_at_most": {
            f"{share:g}": float((p <= share).mean()) for share in (0.05, 0.1, 0.25, 0.5, 0.75)
        },
    }


def _refusals(judged: list[tuple[str, Judgement]]) -> dict[str, Any]:
    return {
        "clips": len(judged),
        "refused": Share.of(not one.familiar for _, one in judged).as_dict(),
        "right_first_reason": sum(_right(name, one) for name, one in judged),
        "right_among_reasons": sum(_right(name, one, first=False) for name, one in judged),
        "kinds": {
            name: _kind([one for kind, one in judged if kind == name], name) for name in KINDS
        },
    }


def _right(name: str, one: Judgement, *, first: bool = True) -> bool:
    reasons = one.reasons[:1] if first else one.reasons
    return any(reason.kind in KINDS[name][1] for reason in reasons)


def _kind(judged: list[Judgement], name: str) -> dict[str, Any]:
    return {
        "clips": len(judged),
        "refused": sum(not one.familiar for one in judged),
        "right_first_reason": sum(_right(name, one) for one in judged),
        "p": [one.p for one in judged],
        "first_reasons": dict(
            Counter(one.reasons[0].kind if one.reasons else "familiar" for one in judged)
        ),
        "example": next((one.reasons[0].what for one in judged if one.reasons), ""),
    }


def _real(model: Estimator, gate: Gate) -> dict[str, Any]:
    """The gate's answers for the windows of a real recording of two flags (DynTex 571c110), if it
    is there."""
    path = REFERENCE / _CLIP
    if not path.exists():
        return dict(ABSENT)
    with av.open(str(path)) as container:
        film = np.array(
            [frame.to_ndarray(format="gray") for frame in container.decode(video=0)], dtype=np.uint8
        )
    count = model.front_end.frames
    windows = [film[first : first + count] for first in range(0, len(film) - count + 1, count)]
    return {"clip": _CLIP, "windows": [_window(window, model, gate) for window in windows]}


def _window(window: UInt8Array, model: Estimator, gate: Gate) -> dict[str, Any]:
    one = judge(window, model, gate)
    return {
        "familiar": one.familiar,
        "p": one.p,
        "reasons": [reason.what for reason in one.reasons],
    }


def _page(result: dict[str, Any]) -> str:
    plain, clips = result["plain"], result["clips"]
    alarms, refusals = plain["refused"], clips["refused"]
    rows = [
        f"| {name} | {kind['refused']} of {kind['clips']} | {kind['right_first_reason']} | "
        f"{', '.join(f'{reason} {count}' for reason, count in kind['first_reasons'].items())} |"
        for name, kind in clips["kinds"].items()
    ]
    examples = [
        f"- {name}: {kind['example']}" for name, kind in clips["kinds"].items() if kind["example"]
    ]
    stated = (
        f"Model {result['model']}; {result['calibration_clips']} calibration clips; stated: at "
        "most "
        f"{result['false_alarm']:.0%} false alarms, with confidence {result['confidence']:.0%} "
        f"(refused at p ≤ {result['level']:.3g})."
    )
    false = (
        f"False alarms: {alarms['hits']} of {alarms['count']} clips of the test side, "
        f"{alarms['value']:.1%} "
        f"[{alarms['low']:.1%}, {alarms['high']:.1%}] 90 %."
    )
    caught = (
        f"Of {clips['clips']} clips that are not what it was trained on, {refusals['hits']} were "
        "refused, "
        f"{refusals['value']:.0%} [{refusals['low']:.0%}, {refusals['high']:.0%}] 90 %; "
        f"{clips['right_first_reason']} with the right first reason, "
        f"{clips['right_among_reasons']} with it among "
        "the reasons."
    )
    text = ["# The gate", "", stated, "", false, "", caught, ""]
    text += [
        "| kind | refused | right first reason | first reasons |",
        "|---|---|---|---|",
        *rows,
        "",
    ]
    text += ["First reasons of one clip of each kind:", "", *examples, ""]
    real = result["real_clip"]
    if "windows" in real:
        refused = sum(not window["familiar"] for window in real["windows"])
        text += [
            (
                f"The real recording {real['clip']}: {refused} of {len(real['windows'])} windows "
                "refused. The first:"
            ),
            "",
        ]
        text += [f"- {sentence}" for sentence in real["windows"][0]["reasons"]]
    return "\n".join(text).rstrip() + "\n"
