"""One table of all models on the same clips, and the three forms it is written in."""

from __future__ import annotations

import dataclasses
import json
import math
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from markdown import markdown as render

from flagdata.answer import Tone
from flagdata.errors import InputError, UnknownNameError
from models.evaluation import SCORES
from models.evaluation.curves import LearningPoint
from models.evaluation.evaluation import Evaluation, as_document, evaluate
from models.evaluation.evaluation_report import answer_of, markdown, write
from models.evaluation.score_table import digits
from tests.models.evaluation.made import GROUP, WIND, compared, of_wind, run, score
from tests.refusals import unrefused


@pytest.fixture(scope="module")
def found() -> Evaluation:
    return compared()


def test_runs_of_one_model_are_pooled_as_their_mean_and_range_and_each_is_shown(
    found: Evaluation,
) -> None:
    each = [SCORES["rmse"](WIND, of.mean[:, 0]) for of in (run("SDN", 0.3, 1), run("SDN", 0.5, 2))]
    assert [(row.label, row.run) for row in found.rows] == [
        ("SDN", None),
        ("SDN", 1),
        ("SDN", 2),
        ("ours <&>", None),
        ("ResNet-18", None),
    ]
    assert found.rows[0].scores["rmse"].value == pytest.approx(sum(each) / 2)
    assert found.rows[0].spread["rmse"] == pytest.approx((min(each), max(each)))
    assert [row.scores["rmse"].value for row in found.rows[1:3]] == pytest.approx(each)


def test_sequences_that_models_learned_from_are_called_that() -> None:
    known = evaluate([run("SDN", 0.3, 1)], data="made", seed=0, draws=10, unseen=False)
    assert "that models may have learned from" in markdown(known)
    assert "seen-in-training" in {finding.kind for finding in known.findings}
    assert "**Warning:** models may have learned from these clips" in markdown(known)
    assert "no model was trained on" in markdown(dataclasses.replace(known, unseen=True))


def test_every_row_keeps_the_bound_between_its_two_columns(found: Evaluation) -> None:
    for row in found.rows:
        assert row.bound is not None
        assert row.scores["rmse"].value >= row.bound
    accuracy = [row.scores["accuracy"].value for row in found.rows[1:3]]
    assert found.rows[0].bound == pytest.approx(np.mean([0.5 * math.sqrt(1 - a) for a in accuracy]))


def test_differences_are_paired_over_the_same_sequences(found: Evaluation) -> None:
    """Errors that only differ by a factor of three have a difference of two thirds the larger,
    interval and all."""
    assert found.reference == "ours <&>"
    whole = run("A", 1.5, 4)
    third = dataclasses.replace(whole, label="B", mean=whole.truth + (whole.mean - whole.truth) / 3)
    pair = evaluate([whole, third], data="made", seed=0, draws=100)
    (rmse,) = [one for one in pair.differences if one.metric == "rmse"]
    alone = pair.rows[0].scores["rmse"]
    assert (rmse.label, rmse.reference, rmse.apart) == ("A", "B", True)
    assert alone.interval is not None
    assert rmse.difference.value == pytest.approx(2 / 3 * alone.value)
    assert rmse.difference.interval == pytest.approx(tuple(2 / 3 * end for end in alone.interval))


def test_a_model_has_no_score_of_what_it_does_not_give(found: Evaluation) -> None:
    by_label = {row.label: row for row in found.rows if row.run is None}
    assert set(by_label["SDN"].scores) == {"rmse", "accuracy", "bias", "triplets"}
    assert set(by_label["ours <&>"].scores) == {
        "rmse",
        "accuracy",
        "bias",
        "area_weight_error",
        "covered_50",
        "covered_80",
        "covered_90",
    }
    assert (
        by_label["SDN"].scores["triplets"].value == 1.0
    )  # its embedding is the wind, which differs between sequences


def test_models_that_were_not_tested_alike_are_refused() -> None:
    cases = [
        (run("B", 1, 1, group=GROUP[::-1].copy()), "same sequences"),
        (
            dataclasses.replace(run("B", 1, 1), truth=WIND[:, None] + 0.1),
            "same truth of wind_speed",
        ),
        (dataclasses.replace(run("A", 1, 1), parameters=11), "differ in targets, parameters"),
    ]
    assert (
        unrefused(
            lambda other: evaluate([run("A", 1, 1), other], data="made", seed=0, draws=10),
            cases,
            InputError,
        )
        == []
    )


def test_unknown_labels_and_no_predictions_are_refused() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'SDN'"):
        evaluate([run("SDN", 1, 1)], data="made", seed=0, reference="SND")
    with pytest.raises(InputError, match="no predictions"):
        evaluate([], data="made", seed=0)


def test_few_sequences_a_missing_triplet_and_a_constant_target_are_reported() -> None:
    made = of_wind(np.ones(5), np.arange(5), embedding=np.eye(5), samples=np.ones((5, 3)))
    found = evaluate([made], data="made", seed=0, draws=10)
    assert {finding.kind for finding in found.findings} == {
        "no-triplets",
        "few-sequences",
        "no-tarp",
    }
    json.dumps(as_document(found), allow_nan=False)
    assert "R²" in answer_of(found).page


class Links(HTMLParser):
    """What a page would fetch, its tags and its text."""

    def __init__(self) -> None:
        super().__init__()
        self.fetched: list[str] = []
        self.ids: list[str] = []
        self.text: list[str] = []
        self.tags: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        for name, value in attrs:
            if (
                name in ("src", "href", "xlink:href")
                and value
                and not value.startswith(("#", "data:"))
            ):
                self.fetched.append(value)
            if name == "id" and value:
                self.ids.append(value)

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def test_the_page_fetches_nothing_escapes_labels_and_repeats_no_id(found: Evaluation) -> None:
    html = answer_of(found).page
    links = Links()
    links.feed(html)
    assert links.fetched == []
    assert len(links.ids) == len(set(links.ids)) > 0
    assert "ours <&>" in {text.strip() for text in links.text}
    assert "<&>" not in html
    assert html.count("<svg ") == 4


BAD = "<img src=x onerror=alert(1)> [a](http://b) | `c` *d* &lt; $\\frac$\n# e"


def test_names_of_models_and_data_are_text_in_markdown_and_on_the_page() -> None:
    """A name may come from anyone's recipe or card. Rendered by a parser of Markdown, it is the
    text that it was."""
    made = [
        dataclasses.replace(run("B", 0.3, 1), label=BAD, note=BAD),
        dataclasses.replace(run("A", 0.4, 2), note=BAD),
    ]
    shown = evaluate(made, data=BAD, seed=0, draws=10, reference=BAD)
    shown = dataclasses.replace(
        shown, learning=(LearningPoint(label=BAD, sequences=9, score=score(1, 1, 2)),)
    )
    for html in (render(markdown(shown), extensions=["tables"]), answer_of(shown).page):
        read = Links()
        read.feed(html)
        assert "img" not in read.tags
        assert not {"a", "em"} & read.tags
        assert "code" not in read.tags
        assert "alert(1)> [a](http://b) | `c` *d* &lt;" in " ".join(" ".join(read.text).split())
    widths = {line.count(" | ") for line in markdown(shown).splitlines() if line.startswith("| A")}
    assert widths == {3, 10}


def test_json_and_markdown_hold_the_same_scores(found: Evaluation, tmp_path: Path) -> None:
    folder = tmp_path / "results"
    answer = write(found, folder, name="models")
    paths = [folder / name for name in ("models.html", "models.json", "models.md")]
    assert {path.name for path in folder.iterdir()} >= {path.name for path in paths}
    assert paths[0].read_text(encoding="utf-8").startswith(answer.page)
    document = json.loads(paths[1].read_text(encoding="utf-8"))
    assert document["schema"] == "flagdata.evaluation/1"
    assert (document["clips"], document["groups"]) == (120, 30)
    rmse = document["models"][0]["scores"]["rmse"]
    assert rmse["interval"][0] <= rmse["value"] <= rmse["interval"][1]
    words = paths[2].read_text(encoding="utf-8")
    assert words.startswith(markdown(found))
    assert (
        f"| {rmse['value']:.3f}<br>[{rmse['interval'][0]:.3f}, {rmse['interval'][1]:.3f}]" in words
    )
    widths = {line.count(" | ") for line in words.splitlines() if line.startswith("| SDN<br>mean")}
    assert widths == {10}


def test_points_of_curves_that_make_no_sense_are_refused() -> None:
    with pytest.raises(InputError, match="lower end"):
        LearningPoint(label="a", sequences=10, score=score(0.2, 0.3, 0.1))


def test_small_errors_are_shown_to_three_significant_digits() -> None:
    cases = [(0.0194, 4), (0.00123, 5), (0.2, 3), (12.0, 3), (0.0, 3)]
    assert [digits(error) for error, _ in cases] == [decimals for _, decimals in cases]


def test_the_answer_names_the_model_that_misses_the_wind_least_and_whether_that_is_beyond_chance(
    found: Evaluation,
) -> None:
    answer = answer_of(found)
    assert answer.sentence.startswith("Of 3 models ours <&> misses the wind least, by 0.103 m/s")
    assert (answer.tone, len(answer.sentence.split()) < 25) == (Tone.SETTLED, True)
    assert answer.quantities["rmse"].value == found.rows[3].scores["rmse"].value
    assert answer.document == as_document(found)
    twin = dataclasses.replace(run("SDN", 0.3, 1), label="twin")
    alike = answer_of(evaluate([run("SDN", 0.3, 1), twin], data="made", seed=0, draws=50))
    assert (alike.tone, "which chance may explain" in alike.sentence) == (Tone.OPEN, True)
    alone = answer_of(evaluate([run("SDN", 0.3, 1)], data="made", seed=0, draws=50))
    assert alone.sentence == "SDN misses the wind by 0.254 m/s in the root mean square"


def test_scores_are_a_data_set_over_models_targets_and_bins_of_the_wind(found: Evaluation) -> None:
    pytest.importorskip("xarray", reason="xarray is not installed")
    scores = answer_of(found).to_xarray()
    assert list(scores["model"].values) == ["SDN", "ours <&>", "ResNet-18"]
    assert float(scores["rmse"].sel(model="SDN")) == found.rows[0].scores["rmse"].value
    assert scores["rmse"].attrs["units"] == "m/s"
    low, high = scores["rmse_interval"].sel(model="SDN").values
    assert (low, high) == found.rows[0].scores["rmse"].interval
    assert math.isnan(float(scores["target_rmse"].sel(model="SDN", target="area_weight")))
    first = found.wind_errors[0]
    of_bin = scores["rmse_by_wind"].sel(model=first.label, wind=sum(first.bins[0].wind) / 2)
    assert float(of_bin) == first.bins[0].rmse.value
