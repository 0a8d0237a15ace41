"""Charts of a verdict are data: what they hold is what the verdict holds."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from flagdata.answer.charts import Across, Bars, Bins, Cells, Line, Mark
from flagdata.pages.chart_drawing import svg
from measure.report.error_maps import effect_chart
from measure.report.recordings_chart import recording_chart
from measure.report.verdict_charts import errors_chart, gains_chart, null_chart
from measure.trajectories import Trajectory, WindTrack
from measure.verdict import Conclusion
from tests.measure.report.verdicts import changed, verdict


def marks(chart: object, kind: type[Mark]) -> list:
    """All marks of a kind."""
    return [
        mark
        for row in chart.rows  # type: ignore[attr-defined]
        for panel in row
        for mark in panel.marks
        if isinstance(mark, kind)
    ]


def test_bars_of_errors_are_in_per_cent_of_the_base_models_and_the_floor_is_behind() -> None:
    comparisons = verdict(Conclusion.EFFECT).comparisons
    chart = errors_chart(comparisons, after="with lift")
    floor, before, after = marks(chart, Bars)
    first = comparisons[0]
    assert before.lengths == pytest.approx([100.0] * len(comparisons))
    assert after.lengths[0] == pytest.approx(100 * first.after.point / first.before.point)
    assert after.low[0] == pytest.approx(100 * first.after.low / first.before.point)
    assert floor.lengths[0] == pytest.approx(100 * first.floor.point / first.before.point)
    assert errors_chart(verdict(Conclusion.SUFFICIENT).comparisons, after="") is None


def test_an_interval_longer_than_its_bar_has_room_and_a_figure_behind_it() -> None:
    first = verdict(Conclusion.EFFECT).comparisons[0]
    wide = replace(first, before=changed(first.before, high=2 * first.before.point))
    chart = errors_chart([wide], after="with lift")
    assert chart is not None
    assert chart.rows[0][0].x.limits == (0, pytest.approx(240))
    assert "100 %" in svg(chart, name="a")


def test_a_bar_far_beyond_is_cut_and_its_figure_is_not() -> None:
    first = verdict(Conclusion.EFFECT).comparisons[0]
    worse = replace(first, after=changed(first.after, value=9 * first.before.point, high=math.inf))
    after = marks(errors_chart([worse], after="with lift"), Bars)[2]
    assert (after.lengths, after.texts) == ([250.0], ["900 %"])


def test_a_long_name_is_broken_into_lines_and_none_is_lost() -> None:
    first = verdict(Conclusion.EFFECT).comparisons[0]
    name = "the last part of every recording of the second day, unseen by either model"
    drawn = str(svg(errors_chart([replace(first, what=name)], after="with lift"), name="a"))  # type: ignore[arg-type]
    for word in name.split():
        assert word in drawn
    assert name not in drawn


def test_the_observed_statistic_stands_beside_all_nulls() -> None:
    test = verdict(Conclusion.EFFECT).test
    chart = null_chart(test)
    assert sum(marks(chart, Bins)[0].heights) == len(test.null)
    assert [line.x for line in marks(chart, Across)] == [test.critical, test.statistic]
    assert chart.rows[0][0].x.logarithmic
    assert marks(null_chart(replace(test, null=[], statistic=math.nan)), Bins) == []


def test_an_effect_that_could_not_be_weighed_has_no_bar() -> None:
    whole = verdict(Conclusion.EFFECT)
    unweighed = replace(whole.ranking[1], gain=math.nan)
    chart = gains_chart(
        [whole.ranking[0], unweighed], title=lambda one: one.effect, named=whole.ranking[:1]
    )
    assert [bars.names for bars in marks(chart, Bars)] == [["lift"]]


def test_where_an_effect_acts_is_what_it_moves_on_average() -> None:
    residual = verdict(Conclusion.EFFECT).residuals[0]
    before = np.asarray(residual.before)
    push = np.array([0.0, 2e-3, 0.0])
    lost = before + push
    lost[:3, 5] = np.nan
    chart = effect_chart(replace(residual, after=lost.tolist()))
    x, y, z = marks(chart, Cells)
    assert np.nanmax(np.abs(x.values)) == pytest.approx(0, abs=1e-9)
    assert y.values[np.isfinite(y.values)] == pytest.approx(2.0)  # mm
    assert np.nanmax(np.abs(z.values)) == pytest.approx(0, abs=1e-9)
    assert effect_chart(replace(residual, after=[])) is None


def test_gaps_of_a_marker_are_blank_above_the_wind() -> None:
    markers = np.array([[1.0, 0.0], [0.0, 0.0], [0.5, 0.0]])
    positions = np.zeros((40, 3, 3))
    positions[:, 0, 1] = np.tile([-0.1, 0.1], 20)
    positions[10:20, 0] = np.nan
    seen = np.ones((40, 3), dtype=bool)
    seen[30:, 1] = False
    recording = Trajectory(
        name="a",
        markers=markers,
        positions=positions,
        rate=20.0,
        wind=WindTrack.constant((3.0, 4.0, 0.0)),
        seen=seen,
    )
    chart = recording_chart(recording)
    (cells,), (line,) = marks(chart, Cells), marks(chart, Line)
    assert cells.values.shape == (3, 40)
    # Rows from the hoist: the second marker, the third, the first.
    assert np.isnan(cells.values[0, 30:]).all()
    assert np.isfinite(cells.values[1]).all()
    assert np.isnan(cells.values[2, 10:20]).all()
    assert cells.values[2, :10] == pytest.approx(0.1)
    assert line.y == pytest.approx(5.0)
