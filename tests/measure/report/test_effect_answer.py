"""What `flagdata catalog effects NAME` answers."""

from __future__ import annotations

from pathlib import Path

import pytest

from flagdata.errors import UnknownNameError
from measure.forecasting.strengths import every_strength
from measure.report.effect_answer import answer_effect, move_by
from sim.effects import EFFECTS
from tests.program import invoke


def test_every_effect_says_its_parameters_and_from_which_recordings_it_is_weighed() -> None:
    for name, effect in EFFECTS.items():
        document = answer_effect(name).document
        assert set(document["parameters"]) == set(effect.parameters())
        for label, row in document["parameters"].items():
            assert row["meaning"], (name, label)
            assert (row["role"] == "strength") == ("weighed" in row)
        assert set(document["recordings"]) == {"films", "markers or meshes"}
        why_not = {text.startswith("not weighed: ") for text in document["recordings"].values()}
        assert why_not == {True} if effect.unweighed else False in why_not


def test_slack_is_weighed_from_films_alone_and_drags_are_confused() -> None:
    recordings = answer_effect("slack").document["recordings"]
    assert recordings["films"] == "weighed"
    assert recordings["markers or meshes"].startswith("not weighed: it needs films: ")
    confused = answer_effect("tangential-linear-drag").document["confused_with"]
    assert confused == ["tangential-quadratic-drag"]


def test_a_wind_that_rises_is_drawn_as_moving_the_flag_up() -> None:
    (rising,) = (one for one in every_strength() if one.column.effect == "vertical-wind")
    rest, moved = move_by(rising)
    assert moved.shape == (24, len(rest), 3)
    assert moved[..., 2].mean() > 1e-5
    assert abs(moved[..., 1].mean()) < moved[..., 2].mean()


def test_the_command_prints_it_writes_its_page_and_answers_a_misspelt_name(tmp_path: Path) -> None:
    page = tmp_path / "wet.html"
    shown = invoke("catalog", "effects", "wet-mass", "--report", page)
    assert shown.code == 0, shown.err
    assert "Every mass is multiplied by 1 + w." in shown.out
    assert "0.05 to 1" in shown.out
    html = page.read_text(encoding="utf-8")
    assert "Where it acts" in html
    assert "mean change" in html
    document = invoke("catalog", "effects", "wet-mass", "--json").document
    assert document["parameters"]["uptake"]["weighed"] == [0.05, 1.0]
    with pytest.raises(UnknownNameError, match="did you mean 'lift'"):
        answer_effect("lifft")
    assert "lift" in invoke("catalog", "effects", "lifft").err
    assert invoke("catalog", "materials", "paper", "--report", tmp_path / "no.html").code == 2
