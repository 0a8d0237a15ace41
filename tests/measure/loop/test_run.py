"""The whole loop at small size: nulls stand, a strong effect is named, the same seed says the
same."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, cast

import numpy as np
import pytest
import torch
from torch import Tensor

from flagdata.errors import InputError, UsageError
from measure.closing import close_loop
from measure.forecasting import Calibration, Design, Setting, Suspicion, columns, fields, on_markers
from measure.inference import CoefficientFit, WhitenedMisfit
from measure.loop import LoopOptions, run
from measure.loop.corrective_field import corrective_field
from measure.nulls import NullBatch
from measure.nulls import bank as banks
from measure.probes import projected_statistics
from measure.report import as_document, from_document, lead
from measure.report.verdict_words import words
from measure.trajectories import Experiment, Specimen, Trajectory
from measure.verdict import NOT_REJECTED, Conclusion, Verdict, number
from sim.cloth import Cloth
from sim.effects import EFFECTS, Effect, ForceEffect, Value, strength
from sim.workers import Job
from tests.measure.report.pages import page_of_words

DURATION, NOISE, SPEEDS, KINDS = 4.6, 5e-4, (3.5, 6.0), 9


@dataclass(frozen=True, kw_only=True)
class Push(ForceEffect):
    """A force per mass across the wind, alike all over.

    Attributes:
        acceleration: of it [m/s²].
    """

    acceleration: Annotated[
        Value, strength(unit="m/s²", prior=(-10.0, 10.0), source="made for a test")
    ] = 0.0

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        return (
            torch.zeros_like(position).index_fill(1, torch.tensor(1), 1.0)
            * cloth.mass[:, None]
            * self.acceleration
        )


@pytest.fixture(scope="module")
def bank(specimen: Specimen, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Nulls of nine kinds of numerics, the fewest that can test a level of 0.1."""
    folder = tmp_path_factory.mktemp("bank")
    done: list[int] = []
    banks.build(folder, batches(specimen)[:-1])
    banks.build(folder, batches(specimen), progress=done.append)
    efforts = [batch.effort for batch in batches(specimen)]
    assert done == [sum(efforts[:-1]), efforts[-1]]  # a build goes on where it was
    return folder


def batches(specimen: Specimen) -> list[NullBatch]:
    alike = {
        "markers": specimen.mesh.rest,
        "rate": 25.0,
        "duration": DURATION,
        "noise": NOISE,
        "speeds": (3.0, 6.5),
    }
    return [banks.prior_batch(specimen, **alike, seed=seed) for seed in range(KINDS)]  # pyright: ignore[reportArgumentType]


def recorded(specimen: Specimen, *effects: Effect, seed: int) -> Experiment:
    """Two winds, by a mesh and steps of their own."""
    batch = NullBatch(
        specimen=specimen,
        markers=specimen.mesh.rest,
        rate=25.0,
        duration=DURATION,
        noise=NOISE,
        speeds=SPEEDS,
        calibrations=(Calibration(area_weight=1.1, bending=0.7, damping=2e-3),) * len(SPEEDS),
        seed=seed,
        effects=effects,
    )
    return Experiment(specimen=specimen, recordings=tuple(batch.simulate()))


@pytest.fixture(scope="module")
def plain(specimen: Specimen) -> Experiment:
    return recorded(specimen, seed=5)


@pytest.fixture(scope="module")
def pulled(specimen: Specimen) -> Experiment:
    return recorded(specimen, EFFECTS["tangential-linear-drag"](coefficient=0.8), seed=77)


@pytest.fixture(scope="module")
def dragged(pulled: Experiment, bank: Path) -> Verdict:
    return close_loop(pulled, LoopOptions(bank=bank, level=0.1))


def test_a_stored_bank_says_what_its_nulls_were_made_with(specimen: Specimen, bank: Path) -> None:
    nulls = banks.load(bank, words="made", batches=batches(specimen)).nulls
    first = batches(specimen)[0].calibrations[0].damping
    assert nulls.design.damping == pytest.approx(first, rel=1e-12)
    known = replace(nulls.design, damping=first)
    assert known == Design(
        noise=NOISE, period=0.04, cloth=specimen.material.fingerprint, damping=first
    )
    for kind, batch in enumerate(batches(specimen)):
        own = nulls.select(nulls.numerics == kind)
        recording = own.statistics.recording - own.statistics.recording.min()
        np.testing.assert_array_equal(own.speeds, np.array(batch.speeds)[recording])
        steps = np.array([cloth.steps_from(Calibration()) for cloth in batch.calibrations])
        np.testing.assert_array_equal(own.calibration, steps[recording])
        assert set(own.cloth) == {specimen.material.fingerprint}
        assert set(own.noise) == {NOISE}


def test_a_null_needs_no_effect(plain: Experiment, bank: Path) -> None:
    verdict = close_loop(plain, LoopOptions(bank=bank, level=0.1))
    assert verdict.conclusion in NOT_REJECTED
    assert not verdict.named
    assert not verdict.comparisons
    assert [one.share for one in verdict.power] == sorted(
        (one.share for one in verdict.power), reverse=True
    )
    assert len(verdict.power) == len(on_markers())


def test_a_suspicion_is_tested_alone_and_said_to_have_been_stated_before(
    plain: Experiment, bank: Path
) -> None:
    suspicion = Suspicion.parse("lift", on_markers())
    verdict = close_loop(plain, LoopOptions(bank=bank, level=0.1, suspected=suspicion))
    assert (verdict.test.suspected, verdict.conclusion in NOT_REJECTED) == ("lift+", True)
    assert [one.effect for one in verdict.power] == ["lift"]
    assert "along lift+ alone, suspected before the recordings were looked at" in " ".join(
        words(verdict).split()
    )


def test_a_strong_effect_is_named_and_helps_where_it_was_not_fitted(dragged: Verdict) -> None:
    assert dragged.conclusion not in NOT_REJECTED
    assert dragged.named[:1] == ("tangential-linear-drag",)
    slow, fast, late = dragged.comparisons
    for comparison in (fast, late):
        assert comparison.after.point < comparison.before.point
    # At 3.5 m/s the base model errs by about as much as the numerical floor, so that there is
    # nothing to gain.
    assert slow.reduction.high > 0
    for left_out in (slow, fast):
        assert left_out.control_name == "tangential-quadratic-drag"
        assert left_out.apart is not None
        assert left_out.apart.point > 0
    # At 3.5 m/s alone, by four segments, both drags may be within the floor's reach; both
    # recordings together separate them by six standard errors, and so does the fast one by itself,
    # in metres too.
    assert dragged.apart is not None
    assert dragged.apart.low > 0
    assert fast.apart is not None
    assert fast.apart.low > 0
    assert fast.control is not None
    assert fast.after.high < fast.control.low
    assert fast.reduction.low > 0


def test_a_hoist_that_is_attached_is_as_stiff_as_a_bound_and_the_bound_holds(
    specimen: Specimen, bank: Path
) -> None:
    """From some stiffness on nothing changes, and a fit ends anywhere."""
    true = 17_000.0
    attached = recorded(specimen, EFFECTS["full-hoist"](stiffness=true), seed=77)
    verdict = close_loop(attached, LoopOptions(bank=bank, level=0.1))
    assert "full-hoist" in verdict.named
    (found,) = [c for c in verdict.ranking if c.effect == "full-hoist"]
    assert (found.strength.bound, found.strength.level) == ("at-least", 0.95)
    assert 0 < found.strength.low < true < found.strength.high
    assert found.strength.point == found.strength.low
    assert (
        from_document(json.loads(json.dumps(as_document(verdict), allow_nan=False))).ranking
        == verdict.ranking
    )
    said = f"stiffness at least {number(found.strength.low, digits=2)} N/m² 95 %"
    for text in (lead(verdict), words(verdict), page_of_words(verdict)):
        assert said.removesuffix(" 95 %") in text.replace("\N{NO-BREAK SPACE}", " ")
    assert said in lead(verdict)


def test_a_verdict_that_rests_on_few_kinds_says_that_another_draw_could_decide_otherwise(
    dragged: Verdict,
) -> None:
    """By nine kinds of numerics of which none is as far, up to 28 % of all may be: 0.05^(1/9) =
    0.72."""
    test = dragged.test
    assert test.p_value.point == pytest.approx(1 / 10)
    assert test.p_value.high == pytest.approx(1 - 0.05 ** (1 / 9))
    assert test.open
    assert test.settling == 29  # 0.9^28 > 5 % > 0.9^29
    assert "The evidence is borderline" in dragged.words
    assert "(29 numerical set-ups) to decide" in dragged.words


def test_the_same_data_and_seed_give_the_same_verdict(
    pulled: Experiment, bank: Path, dragged: Verdict
) -> None:
    again = close_loop(pulled, LoopOptions(bank=bank, level=0.1, workers=2))
    assert replace(again, seconds=0.0) == replace(dragged, seconds=0.0)


def test_the_corrective_field_is_the_force_that_acts(specimen: Specimen, bank: Path) -> None:
    setting = Setting.of(recorded(specimen, Push(acceleration=6.0), seed=11))
    nominal = [setting.calibration] * len(setting.segments)
    found, projection = projected_statistics(
        setting.forecaster, setting.segments, nominal, columns()
    )
    null = banks.load(bank, words="made").model(setting.design)
    whitened = WhitenedMisfit(
        statistics=found, projection=projection, null=null, speeds=setting.speeds[setting.recording]
    )
    modes = corrective_field(setting, whitened)
    assert [mode.column for mode in modes] == list(fields())
    across = next(mode for mode in modes if mode.column.name == "field.y.00")
    assert across.value == pytest.approx(6.0, abs=3 * across.error)
    assert across.value > 3 * across.error
    assert max(modes, key=lambda mode: abs(mode.value / mode.error)) is across
    # Of errors without the part of them that such a force makes, none of it is left.
    segments, forecaster = setting.segments, setting.forecaster
    errors = forecaster.errors(*forecaster.system(segments, nominal), segments)
    change = forecaster.sensitivities([across.column], segments, nominal, errors)[-1]
    rest = corrective_field(setting, whitened, errors=errors - across.value * change)
    unmoved = next(mode for mode in rest if mode.column == across.column)
    assert abs(unmoved.value) < across.error


def test_turning_the_world_changes_nothing_of_what_is_judged(
    specimen: Specimen, pulled: Experiment
) -> None:
    """A verdict is made of its setting alone, which turns every experiment into the frame of its
    wind."""
    c, s = np.cos(2.0), np.sin(2.0)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])

    def turned(recording: Trajectory) -> Trajectory:
        wind = replace(recording.wind, velocity=recording.wind.velocity @ turn)
        return replace(recording, positions=recording.positions @ turn, wind=wind)

    moved = Experiment(
        specimen=replace(specimen, anchors=specimen.anchors @ turn),
        recordings=tuple(map(turned, pulled.recordings)),
    )
    one, other = Setting.of(pulled), Setting.of(moved)
    assert len(one.segments) == len(other.segments) == 4
    close = partial(
        np.testing.assert_allclose, rtol=0, atol=1e-12
    )  # of places and speeds of some units
    close(other.experiment.specimen.anchors, one.experiment.specimen.anchors)
    close(other.forecaster.specimen.anchors, one.forecaster.specimen.anchors)
    for mine, its in zip(one.segments.items, other.segments.items, strict=True):
        close(its.positions, mine.positions)
        close(its.wind.velocity, mine.wind.velocity)


def test_a_level_that_the_bank_cannot_test_is_reported(pulled: Experiment, bank: Path) -> None:
    """Nine kinds of numerics: no p is below 1/10."""
    verdict = close_loop(pulled, LoopOptions(bank=bank))
    assert verdict.conclusion is Conclusion.UNTESTED
    assert verdict.test.p_value.point >= 1 / 10
    assert "cannot be tested at level 0.05" in verdict.words
    assert "at least 19 are needed" in verdict.words  # K + 1 ≥ 1/0.05
    assert not verdict.test.open
    assert "borderline" not in verdict.words
    assert [p.name.split()[0] for p in verdict.parameters] == [
        "area_weight",
        "bending",
        "damping",
        "direction",
    ]


def test_a_bank_of_other_segments_is_refused(
    specimen: Specimen, plain: Experiment, bank: Path
) -> None:
    short = tuple(replace(r, positions=r.positions[:60]) for r in plain.recordings)
    with pytest.raises(InputError, match="the bank has segments of"):
        close_loop(
            Experiment(specimen=specimen, recordings=short), LoopOptions(bank=bank, level=0.1)
        )


def test_a_bank_with_anchors_known_in_another_way_is_refused(
    specimen: Specimen, plain: Experiment, bank: Path
) -> None:
    data = replace(plain, specimen=replace(specimen, anchors_given=False))
    with pytest.raises(
        InputError, match="anchors that are given, the recordings have anchors taken from where"
    ):
        close_loop(data, LoopOptions(bank=bank, level=0.1))


@pytest.mark.parametrize(
    "wrong", [{"level": 0.0}, {"level": 1.5}, {"level": 0.01}, {"nulls": 10}, {"workers": 0}]
)
def test_options_that_make_no_sense_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(UsageError):
        LoopOptions(**wrong)  # pyright: ignore[reportArgumentType]


@dataclass(frozen=True)
class At:
    """What of a setting the looks for the base model need."""

    calibration: Calibration = field(default_factory=Calibration)


@pytest.mark.parametrize(
    ("left", "looks"), [((9.0, 5.0, 4.0, 3.0, 2.0, 1.0), 5), ((9.0, 5.0, 6.0), 2), ((9.0, 9.5), 1)]
)
def test_the_base_model_is_led_on_only_to_where_less_is_left(
    monkeypatch: pytest.MonkeyPatch, left: tuple[float, ...], looks: int
) -> None:
    """Each step doubles the bending. The first look is that of the nominal cloth, at most four
    follow."""

    def fitted(setting: At, fits: object) -> CoefficientFit:
        place = round(math.log2(setting.calibration.bending))
        return CoefficientFit(
            active=(0, 1, 2),
            value=np.array([0.0, math.log(2), 0.0]),
            covariance=1e-2 * np.eye(3),
            remainder=left[place],
        )

    monkeypatch.setattr(run, "_looked_at", lambda setting: ())
    monkeypatch.setattr(run, "_fits", lambda setting, bank: setting)
    monkeypatch.setattr(run, "_base_fit", fitted)
    ended, fits = run._calibrate_statistics(*cast(Any, (At(), At(), None)))  # pyright: ignore[reportPrivateUsage]
    assert ended.calibration.bending == pytest.approx(2.0 ** (looks - 1))
    assert fits is ended or looks == 1


def test_nulls_are_simulated_by_the_workers_of_a_scheduler(
    specimen: Specimen, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str | None] = []

    class Workers:
        def results(self, jobs: Iterable[Job]) -> Iterator[object]:
            yield from ((index, b"nulls of a worker") for _, (_, index) in jobs)

    def connected(scheduler: str | None, **options: object) -> AbstractContextManager[Workers]:
        asked.append(scheduler)
        return nullcontext(Workers())

    monkeypatch.setattr("sim.workers.kept_simulations.connect_workers", connected)
    banks.build(tmp_path, batches(specimen)[:2], scheduler="tcp://host:8786")
    banks.build(
        tmp_path, batches(specimen)[:2], scheduler="tcp://host:8786"
    )  # all there: nobody is asked
    assert asked == ["tcp://host:8786"]
    assert [path.read_bytes() for path in banks.files(tmp_path)] == [b"nulls of a worker"] * 2
