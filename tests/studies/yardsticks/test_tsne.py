"""t-SNE of an embedding."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest

from flagdata.errors import InputError, UsageError
from flagdata.pages.chart_drawing import svg
from tests.models.evaluation.made import generator, of_wind
from tests.studies.yardsticks.sections import draw_tsne
from tests.studies.yardsticks.tsne import layout


def test_clusters_stay_apart_each_clip_keeps_its_wind_and_one_seed_gives_one_picture() -> None:
    pytest.importorskip("sklearn", reason="scikit-learn is not installed")
    wind = np.repeat([1.0, 5.0, 9.0], 20)
    embedding = 50 * np.repeat(np.eye(3), 20, axis=0) + generator(1).normal(size=(60, 3))
    made = of_wind(wind, wind, embedding=embedding)
    found = layout(made, seed=1, perplexity=12, most=45)
    assert found.places.shape == (45, 2)
    distance = np.linalg.norm(found.places[:, None] - found.places[None], axis=2) + 1e9 * np.eye(45)
    np.testing.assert_array_equal(found.wind[distance.argmin(axis=1)], found.wind)
    np.testing.assert_array_equal(layout(made, seed=1, perplexity=12, most=45).places, found.places)
    assert svg(draw_tsne(found), name="plane").startswith("<svg ")
    with pytest.raises(InputError, match="60 clips do not admit a perplexity of 60"):
        layout(made, seed=1, perplexity=60)


def test_without_scikit_learn_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(UsageError, match="pip install scikit-learn"):
        layout(of_wind([1.0], [1.0], embedding=np.ones((1, 2))), seed=1)
