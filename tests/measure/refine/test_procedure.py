"""The procedure end to end, on a coarse flag and a network of random weights: its steps are tested,
not its values."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flagdata.answer import Answer
from flagdata.answer.charts import Dots
from flagdata.core.json_values import json_values
from flagdata.core.rng import child_seed
from flagdata.errors import InputError
from measure.estimate.refined import scale_refinement
from measure.refine import (
    QUANTITIES,
    Evaluator,
    FilmRequest,
    FixedView,
    Refinement,
    Settings,
    Simulator,
    Target,
    refine,
)
from measure.refine.refinement_section import refinement_section, trace_chart
from models.trained.estimator import Estimator
from sim.run import Recipe

SETTINGS = Settings(budget=36, batch=8, seed=4)
WHOLE = replace(SETTINGS, to_floor=False)


@pytest.fixture(scope="module")
def target(recipe: Recipe, view: FixedView) -> Target:
    simulator = Simulator.of(recipe, view, frames=8, rate=25.0, batch=1)
    clip = simulator.films([FilmRequest(point=(0.0,) * 16 + (0.2,), seed=child_seed(9, "target"))])[
        0
    ].clip
    assert clip is not None
    return Target(
        name="known", clip=clip, view=view, truth={"wind_speed": 6.0, "area_weight": 0.135}
    )


@pytest.fixture(scope="module")
def whole(
    recipe: Recipe, estimator: Estimator, target: Target, tmp_path_factory: pytest.TempPathFactory
) -> Refinement:
    """All 36 evaluations."""
    return refine(target, estimator, recipe, settings=WHOLE, cache=tmp_path_factory.mktemp("whole"))


def test_killed_and_resumed_it_gives_the_same_result(
    recipe: Recipe,
    estimator: Estimator,
    target: Target,
    whole: Refinement,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made: list[int] = []
    films = Simulator.films

    def dying(self: Simulator, requests: list[FilmRequest]) -> list[object]:
        if sum(made) >= 24:
            raise KeyboardInterrupt
        made.append(len(requests))
        return films(self, requests)  # pyright: ignore[reportReturnType]

    with monkeypatch.context() as patch:
        patch.setattr(Simulator, "films", dying)
        with pytest.raises(KeyboardInterrupt):
            refine(target, estimator, recipe, settings=WHOLE, cache=tmp_path / "b")
    again: list[int] = []
    monkeypatch.setattr(Simulator, "films", lambda self, r: again.append(len(r)) or films(self, r))
    resumed = refine(target, estimator, recipe, settings=WHOLE, cache=tmp_path / "b")
    assert sum(made) + sum(again) == whole.evaluations == 36
    np.testing.assert_array_equal(resumed.traces[0].points, whole.traces[0].points)
    np.testing.assert_array_equal(resumed.traces[0].distances, whole.traces[0].distances)
    assert resumed.intervals == whole.intervals


def test_it_stops_at_the_noise_floor_and_says_so(
    recipe: Recipe, estimator: Estimator, target: Target
) -> None:
    found = refine(target, estimator, recipe, settings=replace(SETTINGS, budget=200, settled=10.0))
    assert found.reached
    assert found.rounds[-1].distance <= found.floor
    assert found.evaluations < 200
    assert "as well as they fit themselves" in found.stopped


def test_what_no_simulation_looks_like_is_never_at_the_floor(
    recipe: Recipe, estimator: Estimator, target: Target
) -> None:
    noise = np.random.default_rng(0).integers(0, 256, target.clip.shape, dtype=np.uint8)
    found = refine(replace(target, clip=noise), estimator, recipe, settings=SETTINGS)
    assert not found.reached
    assert found.stopped == "the budget is spent"
    assert {"above-noise-floor", "damping-assumed"} <= {finding.kind for finding in found.findings}


def test_two_clips_share_a_cloth_and_have_a_wind_each(
    recipe: Recipe, estimator: Estimator, target: Target
) -> None:
    found = refine(
        [target, replace(target, name="again")],
        estimator,
        recipe,
        settings=replace(SETTINGS, budget=28),
    )
    a, b = (trace.points for trace in found.traces)
    np.testing.assert_array_equal(a[:, :16], b[:, :16])
    assert not np.array_equal(a[:, 16], b[:, 16])
    assert [entry.name for entry in found.intervals] == [
        *(q.name for q in QUANTITIES),
        "wind_speed.1",
    ]


def shown(refinement: Refinement, *, in_motion: bool = True) -> str:
    """The page of nothing but the section of a refinement."""
    section = refinement_section(refinement, in_motion=in_motion)
    answer = Answer(
        question="measure", subject="film", sentence="s", make_sections=lambda: (section,)
    )
    return answer.page


def test_the_section_shows_the_answer_the_steps_and_both_in_motion(whole: Refinement) -> None:
    page = shown(whole).partition('id="refinement"')[2].partition("</details>")[0]
    assert whole.sentence[1:] in page
    assert page.count("image/webp") == 2
    assert [f"step {step}:" in page for step in (0, 10, 20, 40)] == [True, True, True, False]
    tables = [part for part in page.split("<table>")[1:] if "<th" in part]
    assert sum(table.count("<tr>") for table in tables) >= 1 + len(QUANTITIES) + 1 + 15
    for entry in json_values(whole)["intervals"]:
        assert entry["low"] <= entry["median"] <= entry["high"]


def test_charts_of_a_flag_four_times_as_large_have_twice_the_winds(whole: Refinement) -> None:
    """Wind goes with the root of the size at one Froude number: points, axis and captions alike, as
    the intervals."""
    larger = scale_refinement(whole, 4.0)
    captions = [
        np.array(re.findall(r"step \d+: ([\d.]+) m/s", shown(one, in_motion=False))).astype(float)
        for one in (whole, larger)
    ]
    np.testing.assert_allclose(captions[1], 2 * captions[0], atol=0.015)
    before, after = (trace_chart(one).rows[0][1] for one in (whole, larger))
    dots = [panel.marks[0] for panel in (before, after)]
    assert all(isinstance(one, Dots) for one in dots)
    np.testing.assert_allclose(dots[1].y, 2 * np.asarray(dots[0].y))  # type: ignore[union-attr]
    np.testing.assert_allclose(after.y.limits, 2 * np.array(before.y.limits))


def test_a_budget_too_small_for_an_interval_is_refused() -> None:
    with pytest.raises(InputError, match="too few for an interval"):
        Settings(budget=19)
    with pytest.raises(InputError, match="noise floor"):
        Settings(replicates=1)


def test_a_model_without_the_targets_is_refused(
    recipe: Recipe, estimator: Estimator, target: Target
) -> None:
    class Blind(Estimator):
        targets = ()

    blind = Blind(**{name: getattr(estimator, name) for name in estimator.__dataclass_fields__})
    with pytest.raises(InputError, match="a refinement needs wind_speed"):
        refine(target, blind, recipe, settings=SETTINGS)


def test_evaluators_keep_frames_for_the_pictures(evaluator: Evaluator, points: np.ndarray) -> None:
    kept = evaluator.evaluate(points[:1], 1)[0].frame
    clip = evaluator.clip(points[0])
    assert clip is not None
    np.testing.assert_array_equal(kept, clip[4])
