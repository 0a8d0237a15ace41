"""The page: what it shows of an answer and of a refusal, and where other parts are put."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape

import numpy as np
import pytest
from markupsafe import Markup

from flagdata.answer.wind_elsewhere import WindComparison
from flagdata.core.stated import Stated
from flagdata.ingest.films.film_array import Frames
from measure.estimate import SHORT, Context, Measurement, Section, beside
from measure.estimate.measurement_page import page
from measure.estimate.nearest import Neighbour
from models.trained.estimator import Estimator
from tests.measure.estimate.conftest import FRAMES, even, pictures
from tests.measure.estimate.test_film_measuring import far, measured
from tests.measure.estimate.test_wind_by_window import START, gusts, log, saying

PLAIN = Context(provenance={"film": "<flag>.mkv"}, known={}, neighbours=(), compared=0, rate=25.0)


@pytest.fixture(scope="module")
def found(model: Estimator) -> Measurement:
    done = measured(even(3 * FRAMES), model)
    return replace(done, verdict=replace(done.verdict, p=0.5, window_p=(0.5, 0.5, 0.5)))


def drawn(
    found: Measurement,
    context: Context = PLAIN,
    *,
    anyway: bool = False,
    sections: tuple[Section, ...] = (),
) -> str:
    return page(
        found, beside(found, start=None, wind=None), context, anyway=anyway, sections=sections
    )


def test_the_answer_stands_first_and_every_quantity_has_a_row(found: Measurement) -> None:
    text = drawn(found)
    assert found.sentence in text
    assert text.index(found.sentence) < text.index("What the film says")
    folded = text.partition("Not constrained by this film")[2].partition("</details>")[0]
    for quantity in found.quantities:
        assert (f"<td>{SHORT[quantity.name]}</td>" in folded) is not quantity.constrained
    assert [
        text.count(f"<td>{name}</td>") for name in ("wind", "area weight", "bending", "anisotropy")
    ] == [1] * 4


def test_a_wind_from_elsewhere_is_compared_on_the_page_too(found: Measurement) -> None:
    compared = WindComparison(stated=Stated.of("3±1"), difference=(-2.7, 1.0), level=0.9)
    text = unescape(drawn(found, replace(PLAIN, elsewhere=compared)))
    assert f"A wind from elsewhere: {compared.sentence}; {compared.advice}." in text
    assert "A wind from elsewhere" not in drawn(found)


def test_a_bound_is_shown_as_one_without_a_value(model: Estimator) -> None:
    strong = measured(even(3 * FRAMES), far(model, 0, 1.0))
    strong = replace(strong, verdict=replace(strong.verdict, p=0.5))
    text = unescape(" ".join(drawn(strong).split()))
    assert f"<b>{strong.sentence}</b>" in text
    (headline,) = re.findall(r'<p class="headline">(.*?)</p>', text)
    assert re.fullmatch(r"wind <b>at least \d\.\d\d m/s</b> 95 %", headline)
    assert (
        text.index(headline) < text.index(f"<b>{strong.sentence}</b>") < text.index("<h2>The film")
    )
    assert re.search(r"<td>wind</td> <td></td><td>at least \d\.\d\d \(95 %\)</td>", text)
    assert "range ends at 10.0 m/s" in text
    assert "inf" not in re.sub(r"data:[^\"]*|inference|information|inform", "", text)


def test_a_film_in_which_nothing_moves_is_shown_without_estimates_even_anyway(
    model: Estimator,
) -> None:
    still = measured(
        Frames(time=np.arange(24) / 25.0, images=pictures(1).repeat(24, axis=0)), model
    )
    text = drawn(still, anyway=True)
    assert "no motion is found in the picture" in text
    assert "What the film says" not in text
    assert "m/s" not in re.sub(r"data:[^\"]*", "", text)


def test_names_from_outside_are_escaped(found: Measurement) -> None:
    text = drawn(replace(found, film="<script>x</script>"))
    assert "<script>" not in text
    assert "&lt;flag&gt;.mkv" in text


def test_a_refused_film_is_shown_without_estimates_unless_asked_for_and_then_marked(
    found: Measurement,
) -> None:
    refused = replace(found, verdict=replace(found.verdict, p=0.001))
    assert found.sentence not in drawn(refused)
    assert "What the film says" not in drawn(refused)
    marked = drawn(refused, anyway=True)
    assert found.sentence in marked
    assert "not to be relied on" in " ".join(marked.split())


def test_a_section_of_another_program_comes_between_the_answer_and_its_provenance(
    found: Measurement,
) -> None:
    section = Section(
        anchor="refinement", title="Refined by simulation", body=Markup("<p>fifty <b>runs</b></p>")
    )
    text = drawn(found, sections=(section,))
    assert '<section id="refinement">' in text
    assert "<b>runs</b>" in text
    assert text.index("What the film says") < text.index("fifty") < text.index("Where it is from")


def test_simulated_neighbours_are_shown_in_motion_with_what_they_were_made_with(
    found: Measurement,
) -> None:
    neighbour = Neighbour(
        artifact="a" * 32,
        name="clip",
        frames=pictures(FRAMES, seed=9),
        distance=2.5,
        known={"wind_speed": 3.25, "area_weight": 0.12},
    )
    context = replace(PLAIN, neighbours=(neighbour,), compared=7, known={"wind_speed": 6.0})
    text = drawn(found, context)
    assert text.count("data:image/webp") == 2
    assert "wind 3.2 m/s, area weight 0.120 kg/m²" in text
    assert "nearest of 7 simulated clips" in " ".join(text.split())
    assert "<td>6.00</td>" in text
    assert np.all(neighbour.frames == pictures(FRAMES, seed=9))


def test_a_long_film_beside_an_anemometer_shows_errors_spectra_and_delay(model: Estimator) -> None:
    times = np.arange(-70, 160, 0.5)
    wind = gusts(len(times))
    seen = np.interp(np.arange(140) + 0.22, times, wind)
    found = saying(model, np.maximum(seen + 0.5, 0), step=1.0)
    found = replace(found, verdict=replace(found.verdict, p=0.5))
    text = page(found, beside(found, start=START, wind=log(times, wind)), PLAIN, anyway=False)
    assert "bias +0.5" in text
    assert "n = 140 windows" in text
    assert "Spectra and coherence" in text
    assert "the film&#39;s wind follows the anemometer&#39;s" in text
    assert re.search(r"Clocks: (no delay|[+-]\d)", text)
