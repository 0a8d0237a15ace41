"""The page: what its first screen says of an answer and of a refusal, and what is folded below."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest

from flagdata.answer import Section
from flagdata.answer.measured import Measured
from flagdata.api.measuring_verbs import Measuring
from flagdata.errors import RefusedError
from flagdata.ingest.films.film_array import Frames
from flagdata.record.signals import WindAverage
from flagdata.timebase import parse
from measure.commands.measure_film import Request, answer_of
from measure.estimate import Measurement, beside, make_head, make_sections, winds
from measure.estimate.measurement_page import FindNeighbours
from measure.estimate.nearest import Neighbour
from measure.film import ConditionedFilm, FilmReading, Subject
from measure.measuring_model import Network
from models.trained.estimator import Estimator
from tests.measure.estimate.conftest import FRAMES, even, pictures
from tests.measure.estimate.test_film_measuring import far, measured
from tests.measure.estimate.test_wind_by_window import START, gusts, log, saying


@pytest.fixture(scope="module")
def found(model: Estimator) -> Measurement:
    done = measured(even(3 * FRAMES), model)
    return replace(done, verdict=replace(done.verdict, p=0.5, window_p=(0.5, 0.5, 0.5)))


def answered(
    found: Measurement,
    model: Estimator,
    *,
    anyway: bool = False,
    wind: str | None = None,
    neighbours: FindNeighbours | None = None,
) -> Measured:
    return answer_of(
        found,
        Subject(film=ConditionedFilm(even(3 * FRAMES))),
        Network(estimator=model, identity="0" * 64, artifact=None, folder=Path()),
        Request(options=found.options, reading=FilmReading(), origin=None),
        Measuring(source="<flag>.mkv", anyway=anyway, wind=wind),
        lake=None,
        neighbours=neighbours,
    )


def words(page: str) -> str:
    """What a person reads of a page."""
    shown = re.sub(r"<style>.*?</style>|<svg.*?</svg>", "", page, flags=re.DOTALL)
    return " ".join(unescape(re.sub(r"<[^>]*>", " ", shown)).split())


def test_the_sentence_stands_first_and_is_short_enough_to_say(
    found: Measurement, model: Estimator
) -> None:
    answer = answered(found, model)
    said = words(answer.page)
    assert said.index(answer.sentence) < said.index("size of the flag") < said.index("All quant")
    wind, weight = found.quantities[:2]
    assert wind.constrained is answer.sentence.startswith("The wind was ")
    assert weight.constrained is ("the cloth weighs" in answer.sentence)
    assert len(answer.sentence.split()) < 25
    assert repr(answer) == f"Measured({answer.sentence})"


@pytest.mark.parametrize("clear", [True, False])
def test_a_sentence_states_wind_and_weight_with_their_ends_as_far_as_the_film_constrains_them(
    found: Measurement, model: Estimator, clear: bool
) -> None:
    def told(name: str, value: float, low: float, high: float) -> object:
        own = next(one for one in found.quantities if one.name == name)
        span = replace(own.span, low=low, high=high, bound=None, level=0.9)
        return replace(own, value=value, span=span, constrained=clear)

    first = told("wind_speed", 5.21, 4.84, 5.57), told("area_weight", 0.131, 0.12, 0.14)
    quantities = (*first, *found.quantities[2:])
    answer = answered(replace(found, quantities=quantities), model)  # type: ignore[arg-type]
    assert answer.sentence == (
        "The wind was 5.2 m/s, between 4.8 and 5.6 at 90 %; the cloth weighs 0.13 kg/m², between "
        "0.12 and 0.14."
        if clear
        else "The film does not constrain the wind."
    )


def test_every_quantity_has_a_row_in_a_unit_that_people_use(
    found: Measurement, model: Estimator
) -> None:
    page = answered(found, model).page
    table = page.partition("All quantities")[2].partition("</table>")[0]
    assert table.count("<tr>") == 1 + len(found.quantities)
    titles = ("wind", "area weight", "bending stiffness", "bending, warp over weft")
    assert [len(re.findall(f">{title}</t[hd]>", table)) for title in titles] == [1] * 4
    assert "µN·m" in table
    assert "logarithm" not in words(page)
    assert "log10" not in words(page)


def test_a_notebook_shows_the_quantities_of_the_page(found: Measurement, model: Estimator) -> None:
    answer = answered(found, model)
    shown = words(answer._repr_html_())
    assert not re.search(r"log|scale|aspect|N·m(?<!µN·m)", shown.removeprefix(answer.sentence))
    for quantity, title in zip(answer.quantities.values(), ("wind", "area weight"), strict=False):
        assert quantity.title == title
        assert f"{title} {quantity.text}" in shown
    bending = replace(answer.quantities["bending_scale"], value=-4.0, constrained=True)
    span = replace(bending.span, low=-4.3, high=-3.5, bound=None)
    assert replace(bending, span=span).text == "100 [50, 320] µN·m"


def test_a_wind_from_elsewhere_is_compared_on_the_page_too(
    found: Measurement, model: Estimator
) -> None:
    answer = answered(found, model, wind="3±1")
    said = words(answer.page)
    assert answer.elsewhere is not None
    for sentence in (answer.elsewhere.sentence, answer.elsewhere.advice):
        assert sentence[1:] in said
    assert "wind elsewhere" not in words(answered(found, model).page)


def test_a_bound_is_reported_as_one_without_a_value(model: Estimator) -> None:
    strong = measured(even(3 * FRAMES), far(model, 0, 1.0))
    strong = replace(strong, verdict=replace(strong.verdict, p=0.5))
    answer = answered(strong, model)
    assert re.match(r"The wind was at least \d\.\d m/s, at 95 %", answer.sentence)
    assert re.search(r"<td></td><td>at least \d\.\d m/s \(95 %\)</td>", answer.page)
    said = words(answer.page)
    assert "range ends at 10.0 m/s" in said
    assert not re.search(r"\binf\b", said)


def test_a_film_in_which_nothing_moves_is_shown_without_estimates_even_anyway(
    model: Estimator,
) -> None:
    still = measured(
        Frames(time=np.arange(24) / 25.0, images=pictures(1).repeat(24, axis=0)), model
    )
    answer = answered(still, model, anyway=True)
    said = words(answer.page)
    assert said.count("Refused: there is nothing to measure in it.") == 1
    assert "No motion is found in the picture" in said
    assert "All quantities" not in said
    assert "m/s" not in said
    with pytest.raises(RefusedError, match="no motion"):
        answer.to_xarray()


def test_names_from_outside_are_escaped(found: Measurement, model: Estimator) -> None:
    text = answered(replace(found, film="<script>x</script>"), model).page
    assert "<script>" not in text
    assert "&lt;script&gt;" in text


def test_a_refused_film_is_shown_without_estimates_unless_asked_for_and_then_marked(
    found: Measurement, model: Estimator
) -> None:
    refused = replace(found, verdict=replace(found.verdict, p=0.001))
    answer = answered(refused, model)
    said = words(answer.page)
    assert answer.sentence.startswith("Refused: the film is unlike those")
    assert "All quantities" not in said
    assert "m/s" not in said
    for reason in answer.reasons:
        assert reason.what[1:] in said.partition("Whether the network")[0]
    marked = answered(refused, model, anyway=True)
    assert "not to be relied on: the" in marked.sentence
    assert "All quantities" in words(marked.page)
    assert len(marked.sentence.split()) < 25


def test_a_limit_of_the_answer_is_reported_once_with_what_to_do(
    found: Measurement, model: Estimator
) -> None:
    said = words(answered(found, model).page)
    limits = [one for one in found.findings if one.severity.value == "warning"]
    assert limits
    for one in limits:
        assert said.count(one.what[1:]) == 1
        assert not one.fix or one.fix[1:] in said


def test_a_section_of_another_program_comes_between_the_answer_and_the_gate(
    found: Measurement,
) -> None:
    section = Section(title="Refined by simulation", parts=["fifty runs"], anchor="refinement")
    subject = Subject(film=ConditionedFilm(even(3 * FRAMES)))
    series = beside(found, start=None, wind=None)
    sections = make_sections(found, series, subject, anyway=False, rate=25.0, more=(section,))
    titles = [one.title for one in sections]
    assert titles.index("All quantities") < titles.index("Refined by simulation")
    assert titles[-1] == "Whether the network can judge it"


def test_simulated_neighbours_are_shown_in_motion_with_what_they_were_made_with(
    found: Measurement, model: Estimator
) -> None:
    neighbour = Neighbour(
        artifact="a" * 32,
        name="clip",
        frames=pictures(FRAMES, seed=9),
        distance=2.5,
        known={"wind_speed": 3.25, "area_weight": 0.12},
    )
    text = answered(found, model, neighbours=lambda: ((neighbour,), 7)).page
    assert text.count("data:image/webp") == 2
    assert "wind 3.2 m/s, area weight 0.12 kg/m²" in words(text)
    assert "nearest of 7 simulated clips" in words(text)
    assert np.all(neighbour.frames == pictures(FRAMES, seed=9))


def test_a_long_film_beside_an_anemometer_shows_errors_spectra_and_delay(model: Estimator) -> None:
    times = np.arange(-70, 160, 0.5)
    wind = gusts(len(times))
    seen = np.interp(np.arange(140) + 0.22, times, wind)
    found = saying(model, np.maximum(seen + 0.5, 0), step=1.0)
    found = replace(found, verdict=replace(found.verdict, p=0.5))
    series = beside(found, start=START, wind=log(times, wind))
    subject = Subject(film=ConditionedFilm(even(3 * FRAMES)))
    sections = make_sections(found, series, subject, anyway=False, rate=25.0)
    (compared,) = [one for one in sections if one.anchor == "anemometer"]
    said = " ".join(part for part in compared.parts if isinstance(part, str))
    assert "bias +0.5" in said
    assert "n = 140 windows" in said
    assert "the film's wind follows the anemometer's" in said
    assert re.search(r"Clocks: (no delay|[+-]\d)", said)
    head = make_head(found, series, subject, anyway=False, rate=25.0)
    assert [figure.title for figure in head.figures][1:] == [
        "Wind of each window of the film, beside the anemometer's"
    ]


def test_the_winds_stand_in_local_time_where_date_and_zone_are_known(found: Measurement) -> None:
    start = parse("2026-05-01T12:00:03Z")
    series = beside(found, start=start, wind=None)
    logged = WindAverage(
        time=start + np.arange(-2, 3) * 1_000_000_000,
        speed=np.arange(5.0),
        sigma=np.ones(5),
        direction=np.full(5, np.nan),
        count=np.ones(5, dtype=np.int32),
        period=1.0,
    )
    drawn = winds(found, series, start=start, logged=logged, zone_name="Europe/Amsterdam")
    (panel,) = drawn.rows[0]
    assert panel.x.label == "local time, 2026-05-01, CEST"
    assert panel.x.texts[:2] == ["14:00:03", "14:00:04"]
    assert panel.x.ticks == [50403.0, 50404.0]
    line, dots, *_ = panel.marks
    np.testing.assert_array_equal(line.y, [2.0, 3.0])  # type: ignore[union-attr]
    familiar = series.p > found.verdict.level
    np.testing.assert_array_equal(dots.low, series.low[familiar])  # type: ignore[union-attr]
    (undated,) = winds(found, series, start=None).rows[0]
    assert undated.x.label == "time since the first frame [s]"


def test_the_answer_is_a_data_set_over_windows_and_draws(
    found: Measurement, model: Estimator
) -> None:
    xarray = pytest.importorskip("xarray")
    answer = answered(found, model)
    data = answer.to_xarray()
    assert isinstance(data, xarray.Dataset)
    assert dict(data.sizes) == {"window": 3, "draw": len(found.draws)}
    assert set(data.coords) == {"start", "end"}
    assert data.wind_speed.attrs["units"] == "m/s"
    assert data.attrs["answer"] == answer.sentence
    np.testing.assert_array_equal(data.wind_speed_draws, answer.draws["wind_speed"])
    np.testing.assert_array_equal(data.area_weight_low, answer.windows.low["area_weight"])
    assert tuple(answer.draws) == found.names
