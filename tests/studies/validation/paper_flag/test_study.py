"""From tracks to the page, with a drawn sheet and models whose answers are known."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.studies.validation.paper_flag import study as studied
from tests.studies.validation.paper_flag.candidates import Candidate, Load, Shear
from tests.studies.validation.paper_flag.edge import EdgeTrack, Seen
from tests.studies.validation.paper_flag.evidence import NEVER, Kind
from tests.studies.validation.paper_flag.limit_cycle import StripMotion
from tests.studies.validation.paper_flag.observe import Clip, Observations, Thresholds, measure_clip
from tests.studies.validation.paper_flag.page import as_json, page
from tests.studies.validation.paper_flag.recipe import Case, ClipSpec, Group, load_case
from tests.studies.validation.paper_flag.simulated import Flutter
from tests.studies.validation.paper_flag.thresholds import Threshold
from tests.studies.validation.paper_flag.verdict import Conclusion, judge

TRUTH = Load(reactive=0.2)
"""In half the tunnel's speed it gives what the drawn clips show."""


def frequency(load: Load, speed: float) -> float:
    """[Hz] of the models in time."""
    return 2.4 * speed * (load.reactive + load.lift) / TRUTH.reactive


def drawn_clip(spec: ClipSpec, case: Case) -> Clip:
    time = np.arange(400) / case.true_rate
    columns = np.arange(130)
    x = np.maximum(columns - 4, 0) * case.column_scale
    angle = 2 * np.pi * frequency(TRUTH, spec.speed / 2) * (time[:, None] - x / (0.3 * spec.speed))
    y = 0.2 * case.sheet.length * (x / 0.126) ** 2 * np.cos(angle)
    height = np.where(columns < 4, np.nan, 200 - y / case.row_scale)
    seen = np.where(np.isfinite(height), Seen.LINE, Seen.NOTHING).astype(np.uint8)
    return measure_clip(
        EdgeTrack(time=time, height=height, width=np.ones_like(height), seen=seen), spec, case
    )


@pytest.fixture(scope="module")
def case() -> Case:
    groups = {
        Group.FIT: {"slow": 8.0, "fast": 12.0},
        Group.HELD_OUT: {"middle": 10.0, "faster": 11.0},
        Group.OTHER: {"other": 9.0},
    }
    clips = tuple(
        ClipSpec(name=name, speed=speed, group=group, whole=name in ("slow", "middle"))
        for group, own in groups.items()
        for name, speed in own.items()
    )
    return replace(
        load_case(), true_rate=400.0, column_scale=1e-3, row_scale=5e-4, clips=clips, fit_lengths=(0.08, 0.12),
        held_out_lengths=(0.10, 0.14), shares=(0.1, 0.2), lifts=(0.3,), pair_shares=(0.1,), pair_lifts=(0.3,),
        speeds=(3.0, 4.0, 5.0, 6.0, 7.0),
    )  # fmt: skip


@pytest.fixture(scope="module")
def seen(case: Case) -> Observations:
    stops = tuple(
        Threshold(length=h, speed=v)
        for h, v in ((0.08, 9.0), (0.10, 8.0), (0.12, 7.5), (0.14, 7.0))
    )
    tables = Thresholds(
        stop=stops,
        onset=stops,
        bistable=stops,
        flutter=stops,
        curves={"curve_00": ((0.9, 40.0), (2.2, 28.0)), "experiments": ((2.7, 25.0),)},
    )
    return Observations(
        clips=tuple(drawn_clip(spec, case) for spec in case.clips), thresholds=tables
    )


@pytest.fixture(scope="module")
def found(case: Case, seen: Observations) -> studied.Study:
    def flutters(loads: Sequence[Load], speeds: Sequence[float], **_: Any) -> list[Flutter]:
        still = Flutter(frequency=np.nan, wave=np.nan, amplitude=np.nan, tip=0.001, periodic=False)
        return [
            Flutter(
                frequency=frequency(one, speed),
                wave=0.6 * speed,
                amplitude=0.2,
                tip=0.2,
                periodic=True,
            )
            if one.reactive or one.lift
            else still
            for one, speed in zip(loads, speeds, strict=True)
        ]

    def simulate(*, length: float, speeds: Sequence[float], **_: Any) -> StripMotion:
        time, arc = np.arange(250) / 500, np.linspace(0, length, 24)
        wave = 0.02 * np.cos(2 * np.pi * 12 * (time[:, None] - arc / 3)) * arc / length
        across = np.repeat(wave[..., None], len(speeds), axis=2)
        return StripMotion(
            time=time, along=np.broadcast_to(arc[:, None], across.shape), across=across, arc=arc
        )

    def tried(candidate: Candidate) -> tuple[Load, ...]:
        few = {
            Candidate.REACTIVE: (Load(reactive=0.1), TRUTH),
            Candidate.LIFT: (Load(lift=0.3),),
            Candidate.REACTIVE_AND_LIFT: (Load(reactive=0.1, lift=0.3),),
        }
        return few.get(candidate, (Load(),))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(studied, "flutters", flutters)
        patch.setattr(studied, "simulate", simulate)
        patch.setattr(studied, "tried", tried)
        return studied.study(case, seen)


def test_a_clip_is_measured_in_metres_with_its_own_scale_of_rows_and_columns(
    seen: Observations, case: Case
) -> None:
    clip = next(one for one in seen.clips if one.spec.name == "middle")
    assert clip.waves.frequency.value == pytest.approx(12.0, abs=0.02)  # 2.4 · 10/2
    assert clip.waves.speed.value == pytest.approx(3.0, rel=0.03)  # 0.3 · 10
    assert clip.waves.amplitude.value == pytest.approx(
        0.2 * case.sheet.length, rel=0.12
    )  # at the last of 8 columns
    assert clip.clamp == 4
    other = next(one for one in seen.clips if one.spec.name == "other")
    assert other.clamp is None
    assert other.stretch is None


def test_only_whole_sheets_give_lengths_and_nothing_held_out_is_fitted(
    seen: Observations, case: Case
) -> None:
    fitted = seen.conditions(case, Group.FIT, list(Kind))
    held = seen.conditions(case, Group.HELD_OUT, list(Kind))
    assert [c.at for c in fitted if c.kind is Kind.FREQUENCY] == [8.0, 12.0]
    assert [c.at for c in fitted if c.kind is Kind.WAVE] == [8.0]
    assert [c.at for c in held if c.kind is Kind.STOP] == [0.10, 0.14]
    assert not {(c.kind, c.at) for c in fitted} & {(c.kind, c.at) for c in held}


def test_the_base_model_does_not_flutter_and_the_planted_one_is_found(found: studied.Study) -> None:
    for outcome in found.linear:
        if outcome.candidate is Candidate.NONE:
            assert all((values == NEVER).all() for values in outcome.held_out.values())
    best = next(
        o for o in found.in_time if o.candidate is Candidate.REACTIVE and o.shear is Shear.FREE
    )
    assert np.abs(best.held_out[Kind.WAVE]).max() < 0.5
    assert {cell.factor for cell in found.declared} == {1.0, 0.5}


def test_the_verdict_and_its_page_state_what_the_numbers_are(
    found: studied.Study, seen: Observations, case: Case
) -> None:
    verdict = judge(case, seen, found)
    assert verdict.conclusion in set(Conclusion)
    assert verdict.best in verdict.remaining
    text = page(case, seen, found, verdict)
    assert "no flutter" in text
    assert text.count("data:image/png;base64,") == 5
    assert "http" not in text.replace("http-equiv", "")  # refers to no other file
    content = json.loads(json.dumps(as_json(case, seen, found, verdict), allow_nan=False))
    assert content["conclusion"] == verdict.conclusion.value
