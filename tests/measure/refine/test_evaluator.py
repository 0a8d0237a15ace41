"""Evaluations: the same wherever and whenever they are made, and made once."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.json_values import json_values
from flagdata.errors import CorruptError
from measure.refine import DrawnView, Evaluator, FilmCamera, FixedView, Simulator, fingerprint
from measure.refine.target_view import of_parameters
from models.conditioning import VERSION
from models.trained.estimator import Estimator
from sim.assets import Assets
from sim.render import named_prior


def test_an_evaluation_does_not_depend_on_what_is_evaluated_beside_it(
    evaluator: Evaluator, points: np.ndarray
) -> None:
    together = evaluator.evaluate(points, 2)
    alone = replace(evaluator, folder=None, _kept={}).evaluate(points[[2]], 2)[0]
    np.testing.assert_array_equal(together[2].embedding, alone.embedding)


def test_replicates_differ_and_so_do_points(evaluator: Evaluator, points: np.ndarray) -> None:
    found = np.concatenate([entry.embedding for entry in evaluator.evaluate(points[:2], 2)])
    assert len(np.unique(found.round(9), axis=0)) == 4


def test_what_was_kept_is_not_simulated_again(
    evaluator: Evaluator, points: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = evaluator.evaluate(points, 1)
    later = replace(evaluator, _kept={})

    def never(*_: object) -> None:
        raise AssertionError("simulated again")

    monkeypatch.setattr(Simulator, "films", never)
    for a, b in zip(before, later.evaluate(points, 1), strict=True):
        np.testing.assert_array_equal(a.embedding, b.embedding)
        assert a.seconds == b.seconds


def test_another_view_seed_or_model_is_another_evaluation(
    evaluator: Evaluator, estimator: Estimator
) -> None:
    view = evaluator.simulator.view
    assert isinstance(view, FixedView)
    darker = replace(view, zeta=replace(view.zeta, exposure_bias=-1.0))
    others = [
        replace(evaluator, seed=6),
        replace(evaluator, model="other"),
        replace(evaluator, simulator=replace(evaluator.simulator, view=darker)),
    ]
    assert len({entry.identity for entry in [evaluator, *others]}) == 4
    assert fingerprint(estimator) == evaluator.model


def test_what_was_kept_of_clips_conditioned_by_an_older_version_is_not_used(
    evaluator: Evaluator, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = evaluator.identity
    monkeypatch.setattr("measure.refine.simulator.VERSION", VERSION - 1)
    assert evaluator.identity != now


def test_a_damaged_file_is_named_whichever_bit_of_it_changed(
    evaluator: Evaluator, points: np.ndarray
) -> None:
    evaluator.evaluate(points[:1], 1)
    assert evaluator.folder is not None
    kept = next(evaluator.folder.rglob("*.npz"))
    whole = kept.read_bytes()
    places = np.linspace(0, len(whole) - 1, 40).astype(int).tolist()
    for content in (
        whole[:40],
        *(whole[:k] + bytes([whole[k] ^ 1]) + whole[k + 1 :] for k in places),
    ):
        kept.write_bytes(content)
        with pytest.raises(CorruptError, match="damaged") as caught:
            replace(evaluator, _kept={}).evaluate(points[:1], 1)
        assert caught.value.where == str(kept)


def test_an_unknown_view_is_drawn_anew_for_each_clip(simulator: Simulator, tmp_path: Path) -> None:
    view = DrawnView(prior=named_prior("flags"), assets=Assets())
    seen = [view.at(seed) for seed in (1, 1, 2)]
    assert seen[0] == seen[1]
    assert seen[0][0] != seen[2][0]
    assert seen[0][1] != seen[2][1]


def test_a_recordings_own_view_is_read_from_its_parameters(view: FixedView) -> None:
    stated = {f"render.{name}": value for name, value in json_values(view.zeta).items()}
    camera = {"camera.rate_factor": 19.0, "camera.read_noise": 1.0, "camera.shot_noise": 2.0}
    found = of_parameters({**stated, **camera, "area_weight": 0.1}, where="test")
    assert found is not None
    assert found.zeta == view.zeta
    assert found.camera == FilmCamera(rate_factor=19.0, read_noise=1.0, shot_noise=2.0)
    assert of_parameters({"area_weight": 0.1}, where="test") is None
