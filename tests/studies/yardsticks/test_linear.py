"""The linear readout against the naive loop and the hat matrix."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from flagdata.errors import InputError
from tests.models.evaluation.made import generator
from tests.refusals import unrefused
from tests.studies.yardsticks.linear import bouman, leave_one_group_out


def naive(
    embedding: np.ndarray, truth: np.ndarray, group: np.ndarray, components: int
) -> np.ndarray:
    """PCA by SVD and least squares, fitted anew without each group."""
    predicted = np.empty_like(truth)
    for label in np.unique(group):
        inside = group == label
        training, mean = embedding[~inside], embedding[~inside].mean(axis=0)
        axes = np.linalg.svd(training - mean, full_matrices=False)[2][:components].T
        design = np.column_stack([np.ones(len(training)), (training - mean) @ axes])
        solution = np.linalg.lstsq(design, truth[~inside], rcond=None)[0]
        predicted[inside] = (
            np.column_stack([np.ones(inside.sum()), (embedding[inside] - mean) @ axes]) @ solution
        )
    return predicted


@pytest.mark.parametrize(
    ("clips", "dimension", "components"), [(40, 6, 3), (24, 70, 9), (30, 5, 5)]
)
def test_leaving_one_out_equals_fitting_anew(clips: int, dimension: int, components: int) -> None:
    random = generator(clips)
    embedding = random.normal(size=(clips, dimension)) * np.linspace(1, 3, dimension) + 40
    truth = random.normal(size=(clips, 2))
    for group in (np.arange(clips), np.arange(clips) // 3):
        found = leave_one_group_out(embedding, truth, group=group, components=components)
        np.testing.assert_allclose(
            found, naive(embedding, truth, group, components), rtol=1e-6, atol=1e-8
        )


def test_with_all_components_it_is_the_hat_matrixs_closed_form() -> None:
    """y_i - e_i / (1 - h_ii) of ordinary least squares."""
    random = generator(3)
    embedding, truth = random.normal(size=(30, 5)), random.normal(size=(30, 1))
    design = np.column_stack([np.ones(30), embedding])
    hat = design @ np.linalg.pinv(design)
    expected = truth - (truth - hat @ truth) / (1 - np.diag(hat))[:, None]
    found = leave_one_group_out(embedding, truth, group=np.arange(30), components=5)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_a_linear_embedding_of_the_logarithms_is_read_out_with_r_of_one() -> None:
    random = generator(4)
    logs = random.normal(size=(90, 2))
    found = bouman(
        logs @ random.normal(size=(2, 60)) + 7,
        {"stiffness": np.exp(logs[:, 0]), "area_weight": np.exp(logs[:, 1])},
        group=np.arange(90) // 3,
        generator=generator(5),
        components=2,
    )
    assert found.targets == ("log stiffness", "log area_weight")
    assert [r.value for r in found.pearson] == pytest.approx([1, 1], abs=1e-9)
    np.testing.assert_allclose(found.predicted, logs, atol=1e-8)
    assert found.findings == ()
    assert (found.pearson[0].clips, found.pearson[0].groups) == (90, 30)


def test_r_is_that_of_the_predictions_made() -> None:
    random = generator(6)
    embedding, stiffness = random.normal(size=(40, 4)), np.exp(random.normal(size=40))
    found = bouman(
        embedding,
        {"stiffness": stiffness},
        group=np.arange(40),
        generator=generator(1),
        components=4,
    )
    expected, _ = stats.pearsonr(
        np.log(stiffness), naive(embedding, np.log(stiffness)[:, None], np.arange(40), 4)[:, 0]
    )
    assert found.pearson[0].value == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("clips", "dimension", "kept"), [(20, 512, 10), (200, 16, 16), (60, 512, 34)]
)
def test_fewer_components_are_kept_where_the_clips_or_dimensions_do_not_suffice_and_it_says_so(
    clips: int, dimension: int, kept: int
) -> None:
    """Of 19 clips that train a fold the mean takes one degree of freedom, and three fifths of 18
    are 10."""
    random = generator(7)
    found = bouman(
        random.normal(size=(clips, dimension)),
        {"area_weight": random.uniform(1, 2, clips)},
        group=np.arange(clips),
        generator=generator(1),
    )
    assert found.components == kept
    (finding,) = found.findings
    assert finding.kind == "fewer-components"
    assert f"{kept} principal components are kept, not 50" in finding.what


def test_ninety_clips_keep_the_papers_fifty_components() -> None:
    random = generator(8)
    area_weight = random.uniform(1, 2, 90)
    found = bouman(
        random.normal(size=(90, 512)),
        {"area_weight": area_weight},
        group=np.arange(90),
        generator=generator(1),
    )
    assert found.components == 50
    assert found.findings == ()


def test_quantities_without_a_logarithm_or_a_spread_are_refused() -> None:
    cases = [
        (np.array([1.0, 2, 3, 0, 5]), "not a positive number"),
        (np.array([1.0, 2, np.nan, 4, 5]), "not a positive number"),
        (np.full(5, 0.2), "same in all clips"),
        (np.ones(4), "each of 5 clips"),
    ]
    assert (
        unrefused(
            lambda area_weight: bouman(
                np.eye(5), {"area_weight": area_weight}, group=np.arange(5), generator=generator(1)
            ),
            cases,
            InputError,
        )
        == []
    )


def test_too_few_groups_are_refused() -> None:
    with pytest.raises(InputError, match="2 groups"):
        bouman(
            np.eye(5),
            {"area_weight": np.arange(1.0, 6)},
            group=np.array([1, 1, 1, 2, 2]),
            generator=generator(1),
        )
