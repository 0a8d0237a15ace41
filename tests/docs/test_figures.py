"""The figures of accuracy that how-to pages quote are those of their sheets."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

from tests.docs.pages import DOCS


def sheet(name: str) -> Mapping[str, Any]:
    """Returns the result of a sheet of docs/results."""
    return json.loads((DOCS / "results" / f"{name}.json").read_text(encoding="utf-8"))["result"]


def text(page: str) -> str:
    """Returns a page with one blank between words, whatever its lines."""
    return " ".join((DOCS / page).read_text(encoding="utf-8").split())


def test_the_forces_counted_on_markers_are_those_of_the_readme() -> None:
    readme = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    (result,) = re.findall(
        r"^\| forces missing from the cloth model \| [^|]+ \| ([^|]+) \|$", readme, re.MULTILINE
    )
    assert f"of markers | {result} |" in text("reading-a-verdict.md")


def test_the_verdicts_on_another_simulator_are_those_of_their_sheets() -> None:
    page, nulls, effects = (
        text("reading-a-verdict.md"),
        sheet("validate-foreign-nulls"),
        sheet("validate-foreign-effects"),
    )
    density, bending, damping = (
        nulls["covered"][name] for name in ("density", "bending", "damping")
    )
    assert damping["hits"] == damping["count"]
    rejected = nulls["false_rejections"]
    assert f"[{rejected['count']} null experiments]" in page
    assert (
        f"| {rejected['hits']} rejected; the intervals contain the area weight in "
        f"{density['hits']}, the bending in "
        f"{bending['hits']}, the damping in all |"
    ) in page
    right, missed, wrong = (effects[name] for name in ("right", "missed", "wrong"))
    part = right["count"] - right["hits"] - missed["hits"] - wrong["hits"]
    assert wrong["hits"] == 0
    assert f"[{right['count']} effects]" in page
    assert (
        f"{right['hits']} named correctly, {part} named partly or by class, {missed['hits']} "
        "missed, none wrong" in page
    )


def test_the_errors_of_a_weight_are_those_of_the_sheet() -> None:
    page, result = text("weighing.md"), sheet("validate-weighed")
    films, geometry = result["films"], result["geometry"]
    assert len(films["flags"]) == 10
    assert f"the median error was {100 * films['median_error']:.0f} %" in page
    assert f"{films['held']} of {len(films['flags'])} were in their intervals" in page
    assert f"median error of {100 * geometry['median_error']:.0f} %" in page
    assert f"{geometry['held']} of {len(geometry['flags'])} in their intervals" in page


def test_the_errors_of_a_reading_model_are_those_of_the_sheet() -> None:
    page, networks = text("anemometer.md"), sheet("validate-anemometer")["networks"]
    default, flow = (
        [film["read"]["cup"]["rmse"] for film in networks[name]["films"][:2]] for name in networks
    )
    assert list(networks) == ["flow-outdoor", "flow"]
    assert (
        f"following five minutes to {default[0]:.2f} m/s and another day to {default[1]:.2f}"
        in page
    )
    assert f"and `flow` to {flow[0]:.2f} and {flow[1]:.2f}" in page


def test_the_gain_of_a_refinement_is_that_of_the_sheet() -> None:
    alone, refined = sheet("validate-refinement-changed")["methods"]
    assert (alone["method"], refined["method"]) == ("regression alone", "refine")
    assert (
        f"the median error is {refined['wind_error'][0]:.2f} m/s beside the network's "
        f"{alone['wind_error'][0]:.2f}"
    ) in text("refining.md")


def rows_of_the_readme() -> dict[str, str]:
    """Returns the results of README's table by what they are of."""
    readme = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    return dict(re.findall(r"^\| ([^|]+) \| [^|]+ \| ([^|]+) \|$", readme, re.MULTILINE))


def score(name: str) -> dict[str, tuple[int, int]]:
    """Returns hits and count of the shares of a scored challenge."""
    path = DOCS / "results" / name / "challenge-score.json"
    shares = json.loads(path.read_text(encoding="utf-8"))["shares"]
    return {key: (share["hits"], share["count"]) for key, share in shares.items()}


def test_the_films_of_the_readme_are_those_of_their_sheets() -> None:
    rows, films = rows_of_the_readme(), sheet("validate-films")
    for row, weight in (("wind from a film", "open"), ("the same, area weight given", "stated")):
        errors, refused = films["errors"]["coverage"][weight], films["refused"]["coverage"]
        covered = errors["covered"]
        assert f"median error {errors['median_error']:.2f} m/s, {covered['hits']} of" in rows[row]
        assert f"of {covered['count']} in their" in rows[row]
        assert rows[row].endswith(f"; {refused['hits']} refused")
    too_low = films["errors"]["coverage"]["open"]["too_low"]
    assert f", {too_low} too low;" in rows["wind from a film"]
    counts = sheet("validate-no-flag")["counts"].values()
    refused, drawn = (sum(one[key] for one in counts) for key in ("refused", "films"))
    assert rows["films without a flag on a pole"] == (
        f"{refused} refused, {drawn - refused} answered"
    )
    judged = sheet("validate-gate-films")["halves"]["judging"]
    assert rows["films with a defect"] == (
        f"{judged['refused']['hits']} of {judged['refused']['count']} refused, "
        f"{judged['right_first']['hits']} of them with the true reason first"
    )
    errors = sheet("validate-weighed")["films"]
    assert rows["area weight, wind known"].startswith(
        f"median error {100 * errors['median_error']:.0f} %, {errors['held']} of "
    )


def test_the_verdicts_of_the_readme_are_those_of_their_sheets() -> None:
    rows = rows_of_the_readme()
    for row, name in (
        ("forces missing from the cloth model", "challenge-registered"),
        ("the same, from films", "challenge-films-3"),
        ("the same, from films of three minutes", "challenge-films-long"),
    ):
        alarms, nulls = score(name)["false positives on nulls"]
        found, hidden = score(name)["detected: one effect"]
        named, _ = score(name)["true effect among those named"]
        assert f"{alarms or 'no'} false alarm" in rows[row]
        assert (
            f" in {nulls}; of {hidden} hidden forces {found} detected, {named} named" in rows[row]
        )
    false, claims = score("challenge-registered")["false discoveries among claims"]
    assert rows["named forces that did not act"] == f"{false} of {claims}"
