"""From film to measurement, whatever the model says: similarity, determinism, which windows
count."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from torch import Tensor

from flagdata.answer import Bound
from flagdata.core.arrays import UInt8Array
from flagdata.core.findings import Finding, Severity
from flagdata.core.rng import child_seed
from flagdata.core.stated import Stated, parse
from flagdata.errors import InputError, RefusedError, UsageError
from flagdata.ingest.films.film_array import Frames
from measure.commands.measure import _Done, _report
from measure.estimate import DRAWS, Dependence, Measurement, Options, beside, measure
from measure.film import FlagSize
from measure.gate import Reason, gate_of
from models.networks.learner import Loss
from models.networks.mixture import Mixture
from models.trained import estimator
from models.trained.estimator import Estimator
from tests.measure.estimate.conftest import FRAMES, RATE, even, pictures, written

APART = Dependence(wind=0.2, cloth=0.2, source="given")
WHOLE = FlagSize(length=1.5, height=1.0)


class Listed:
    """A gate that gives these p-values in turn."""

    def __init__(self, *values: float) -> None:
        self._values = iter(values)

    def judge(self, frames: UInt8Array, summary: NDArray[np.floating]) -> list[Reason]:
        assert frames.ndim == 3
        p = next(self._values)
        return [Reason(kind="listed", what=f"p = {p}", p=p)]

    def level(self, false_alarm: float) -> float:
        return false_alarm


def measured(film: Frames, model: Estimator, **changes: object) -> Measurement:
    options = replace(Options(size=WHOLE), **changes)  # type: ignore[arg-type]
    return measure(film, model, gate=gate_of(model), dependence=APART, options=options)


def sigma(found: Measurement, name: str) -> float:
    value = next(quantity.sigma for quantity in found.quantities if quantity.name == name)
    assert value is not None
    return value


class Far(Estimator):
    """The same model, of which it says that the wind or the area weight lies far out, at an end of
    its range."""

    def logits(self, embeddings: list[Tensor], *, seed: int, draws: int) -> Tensor:
        out = super().logits(embeddings, seed=seed, draws=draws)
        column, sign = self.card["far"]
        out[..., column] = sign * (4.0 + 0.3 * out[..., column])
        return out


def far(model: Estimator, column: int, sign: float) -> Estimator:
    values = {field.name: getattr(model, field.name) for field in fields(model)}
    return Far(**{**values, "card": {**model.card, "far": (column, sign)}})


def test_the_same_pictures_of_a_smaller_flag_played_faster_are_a_similar_flag(
    model: Estimator,
) -> None:
    # s = 1/4: the same frames twice as fast; wind by 1/2, area weight by 1/4, bending by 1/256.
    images = pictures(4 * FRAMES)
    slow = Frames(time=np.arange(len(images)) / RATE, images=images)
    fast = Frames(time=np.arange(len(images)) / (2 * RATE), images=images)
    whole = measured(slow, model)
    quarter = measured(fast, model, size=FlagSize(length=0.375, height=0.25))
    wind, area_weight, bending, anisotropy = whole.draws.T
    expected = np.stack([wind / 2, area_weight / 4, bending - np.log10(256.0), anisotropy], axis=1)
    np.testing.assert_allclose(quarter.draws, expected, rtol=1e-9)
    assert quarter.quantities[1].assumed == pytest.approx((0.025, 0.0425))


def test_the_same_seed_gives_the_same_draws_and_another_does_not(model: Estimator) -> None:
    film = even(3 * FRAMES)
    np.testing.assert_array_equal(measured(film, model).draws, measured(film, model).draws)
    assert not np.array_equal(measured(film, model).draws, measured(film, model, seed=1).draws)


def test_an_unknown_size_widens_the_interval_of_the_wind(model: Estimator) -> None:
    film = even(8 * FRAMES, rate=50.0)
    known, unknown = measured(film, model), measured(film, model, size=None)
    assert "size-assumed" in {finding.kind for finding in unknown.findings}
    assert sigma(unknown, "wind_speed") > sigma(known, "wind_speed")
    low, high = unknown.quantities[1].assumed
    assert low < 0.1
    assert high > 0.17


def test_an_area_weight_that_is_known_restricts_the_answer_to_it(model: Estimator) -> None:
    film = even(4 * FRAMES)
    free, known = measured(film, model), measured(film, model, area_weight=parse("0.12:0.13"))
    area_weight = known.quantities[1]
    assert area_weight.assumed == (0.12, 0.13)
    assert 0.12 <= area_weight.span.low < area_weight.span.high <= 0.13
    assert sigma(known, "area_weight") < sigma(free, "area_weight") / 2
    assert known.options.recipe()["area_weight"] == [0.12, 0.13]
    for window in known.windows:
        own = window.quantity("area_weight").span
        assert 0.12 - 1e-6 <= own.low < own.high <= 0.13 + 1e-6


@pytest.mark.parametrize("windows", [1, 4])
def test_an_area_weight_is_a_value_or_has_a_deviation_and_the_wind_is_that_of_a_narrow_range(
    model: Estimator, windows: int
) -> None:
    film = even(windows * FRAMES)
    found = {
        text: measured(film, model, area_weight=parse(text))
        for text in ("0.16", "0.16±0.0001", "0.1599:0.1601")
    }
    narrow = found["0.1599:0.1601"].quantities
    for text, one in found.items():
        wind, area_weight, bending, _ = one.quantities
        for own, other in (
            (wind, narrow[0]),
            (bending, narrow[2]),
        ):  # four standard errors of both means
            assert own.value is not None
            assert other.value is not None
            assert other.sigma is not None
            assert own.value == pytest.approx(
                other.value, abs=4 * 1.5 * other.sigma / math.sqrt(DRAWS)
            ), text
            assert own.sigma == pytest.approx(other.sigma, rel=0.2), text
        assert area_weight.value == pytest.approx(0.16, abs=1e-4)
    exact = found["0.16"].quantities[1]
    assert (exact.given, exact.sigma, exact.span.ends()) == (True, 0.0, [0.16, 0.16])
    assert found["0.16"].sentence.endswith("area weight 0.16 kg/m², as given")
    assert found["0.16±0.0001"].options.recipe()["area_weight"] == {"value": 0.16, "sigma": 0.0001}


class Believing(Estimator):
    """The same model, which says of every clip at every size that the wind is 4 m/s and the cloth
    weighs 0.12 kg/m²."""

    def posterior(self, embeddings: Sequence[Tensor]) -> Mixture:
        found = super().posterior(embeddings)
        scaling = self.learners[0].scaling
        believed = torch.tensor([[4.0, 0.12, -4.0, 0.0]], dtype=torch.float64)
        location = scaling.learned(believed).double().expand_as(found.location)
        deviations = torch.tensor([1e-3, 0.3, 1.0, 1.0], dtype=torch.float64)
        return Mixture(
            log_weight=found.log_weight,
            location=location,
            factor=torch.diag(deviations).expand_as(found.factor),
        )


def test_of_an_unknown_size_a_weight_that_is_known_says_which_sizes_are_probable(
    model: Estimator,
) -> None:
    """p(s | x, ρ) ∝ p(s) q(ρ/s)/π(ρ/s): the network reads a cloth of 0.12 kg/m² at any size, so
    that one of 0.15 is of a larger flag. The wind is 4 √s m/s, which gives s."""
    believing = Believing(**{field.name: getattr(model, field.name) for field in fields(model)})
    film = even(8 * FRAMES, rate=2 * RATE)
    found = measured(
        film, believing, size=None, area_weight=parse("0.15"), first=0.0, last=1.6 * FRAMES / RATE
    )
    sizes = (found.draws[:, 0] / 4.0) ** 2
    s = np.linspace(0.6, 2.0, 20_001)
    share = np.exp(-0.5 * (np.log(s) / np.log(1.3)) ** 2) / s  # p(s), log-normal
    weight = 0.15 / s
    learned = torch.tensor(
        np.stack([np.full_like(s, 4.0), weight, np.full_like(s, -4.0), 0 * s], axis=1)
    )
    logit = believing.learners[0].scaling.learned(learned)[:, 1].double().numpy()
    believed = (
        believing.learners[0].scaling.learned(torch.tensor([[4.0, 0.12, -4.0, 0.0]]))[0, 1].item()
    )
    share *= np.exp(
        -0.5 * ((logit - believed) / 0.3) ** 2 + 0.5 * logit**2
    )  # π: the standard normal of the logit
    share[(weight < 0.10) | (weight > 0.17)] = 0.0
    share /= share.sum()
    mean = float(share @ s)
    deviation = float(np.sqrt(share @ (s - mean) ** 2))
    assert sizes.mean() == pytest.approx(mean, abs=0.25 * deviation)
    assert sizes.std() == pytest.approx(deviation, rel=0.25)
    np.testing.assert_allclose(found.draws[:, 1], 0.15, rtol=1e-9)
    (left_out,) = [
        finding for finding in found.findings if finding.kind == "sizes-excluded-by-weight"
    ]
    known = (np.log(np.array([0.15 / 0.17, 0.15 / 0.10])) / np.log(1.3) / np.sqrt(2)).tolist()
    assert left_out.value == pytest.approx(
        1 - (math.erf(known[1]) - math.erf(known[0])) / 2, abs=0.04
    )  # of 1,200


class Ambiguous(Believing):
    """As it, of which the logits of wind and weight are correlated by 0.9, each with a deviation of
    1 or less."""

    def posterior(self, embeddings: Sequence[Tensor]) -> Mixture:
        found = super().posterior(embeddings)
        covariance = torch.eye(4, dtype=torch.float64)
        covariance[:2, :2] = torch.tensor([[1.0, 0.9], [0.9, 1.0]])
        return replace(
            found,
            factor=torch.linalg.cholesky(self.card["spread"] ** 2 * covariance).expand_as(
                found.factor
            ),
        )

    def logits(self, embeddings: Sequence[Tensor], *, seed: int, draws: int) -> Tensor:
        return self.posterior(embeddings).sample(draws, torch.Generator().manual_seed(seed % 1000))


def test_a_weight_that_is_open_is_answered_with_the_winds_of_a_light_and_a_heavy_cloth(
    model: Estimator, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of a wind and a weight whose logits are those of 4 m/s and 0.12 kg/m² plus z and z', the
    conditional median at a weight is that of z = 0.9 z'."""
    values = {field.name: getattr(model, field.name) for field in fields(model)}
    ambiguous = Ambiguous(**{**values, "card": {**model.card, "spread": 1.0}})
    film = even(FRAMES)
    found = measured(film, ambiguous)
    (finding,) = [one for one in found.bounds if one.kind == "weight-open"]
    nowhere: Any = SimpleNamespace(known=None)
    nothing_else: Any = SimpleNamespace(elsewhere=None)
    series = beside(found, start=None, wind=None)
    _report(
        _Done(
            measured=found,
            series=series,
            subject=nowhere,
            refinement=None,
            answer=nothing_else,
        ),
        series=False,
    )
    assert f"  {finding.what}; weigh the cloth and give --area-weight\n" in capsys.readouterr().err
    light, heavy = re.findall(r"at ([\d.]+) kg/m² ([\d.]+) m/s", finding.what)
    scaling = model.learners[0].scaling

    def logits(wind: float, weight: float) -> np.ndarray:
        return (
            scaling.learned(torch.tensor([[wind, weight, -4.0, 0.0]], dtype=torch.float64))[0]
            .double()
            .numpy()
        )

    base = logits(4.0, 0.12)
    for weight, wind in (light, heavy):
        z = 0.9 * (logits(4.0, float(weight))[1] - base[1])
        draws = base[0] + z + np.sqrt(1 - 0.81) * np.random.default_rng(0).standard_normal(20_000)
        low, high = (float(bound[0]) for bound in scaling.bounds)
        expected = low + (high - low) / (1 + np.exp(-draws))
        assert float(wind) == pytest.approx(
            expected.mean(), abs=0.05 + 4 * expected.std() / math.sqrt(DRAWS)
        )
    assert float(light[0]) < 0.12 < float(heavy[0])
    assert finding.fix == "weigh the cloth and give --area-weight"
    assert finding.severity is Severity.NOTE
    given = measured(film, ambiguous, area_weight=parse("0.13"))
    assert "weight-open" not in [one.kind for one in given.bounds]
    independent = Believing(**values)
    assert "weight-open" not in [one.kind for one in measured(film, independent).bounds]


def test_a_flags_aspect_is_known_from_its_size_by_a_model_that_estimates_it(tmp_path: Path) -> None:
    aspects = estimator.load(
        written(tmp_path / "aspects", ("wind_speed", "area_weight", "log_aspect"))
    )
    for size, given in (
        (FlagSize(length=1.5, height=1.0), True),
        (FlagSize(length=1.5, height=0.5), False),
    ):
        found = measured(even(2 * FRAMES), aspects, size=size)
        aspect = found.quantities[2]
        kinds = [finding.kind for finding in found.findings]
        assert ("aspect-ratio" in kinds) is not given, size
        assert aspect.given is given
        if given:  # the middle, 4 % either way
            assert np.log(1.44) - 0.01 <= aspect.span.low < aspect.span.high <= np.log(1.56) + 0.01
    weighed = measured(even(2 * FRAMES), aspects, area_weight=parse("0.12"))
    assert weighed.quantities[1].value == 0.12
    assert weighed.quantities[2].span.high <= np.log(1.56) + 0.01
    assert (
        not measured(even(2 * FRAMES), aspects, size=None, first=0.0, last=0.6).quantities[2].given
    )


class Light(Ambiguous):
    """As it, of a cloth near the light end of what the model knows."""

    def posterior(self, embeddings: Sequence[Tensor]) -> Mixture:
        found = super().posterior(embeddings)
        location = found.location.clone()
        location[..., 1] = -4.7
        return replace(found, location=location)


def test_an_open_weight_near_the_light_end_of_the_range_is_answered_within_the_range(
    model: Estimator,
) -> None:
    """Of a flag of 1 m the model knows 0.0667 to 0.1133 kg/m²; the light cloth of two digits would
    be one of 0.066."""
    values = {field.name: getattr(model, field.name) for field in fields(model)}
    light = Light(**{**values, "card": {**model.card, "spread": 1.0}})
    found = measured(
        even(4 * FRAMES, rate=2 * RATE), light, size=FlagSize(length=1.0, height=0.667)
    )
    (finding,) = [one for one in found.bounds if one.kind == "weight-open"]
    assert "at 0.067 kg/m²" in finding.what


class Longer(Estimator):
    """A model that takes every flag for one twice as long as high."""

    def posterior(self, embeddings: Sequence[Tensor]) -> Mixture:
        found = super().posterior(embeddings)
        learned = self.learners[0].scaling.learned(
            torch.tensor([[4.0, 0.12, math.log(1.95)]], dtype=torch.float64)
        )
        deviations = torch.full((3,), 0.1, dtype=torch.float64)
        return Mixture(
            log_weight=found.log_weight,
            location=learned.double().expand_as(found.location),
            factor=torch.diag(deviations).expand_as(found.factor),
        )


def test_what_the_film_speaks_against_is_what_was_given(tmp_path: Path) -> None:
    aspects = estimator.load(
        written(tmp_path / "aspects", ("wind_speed", "area_weight", "log_aspect"))
    )
    longer = Longer(**{field.name: getattr(aspects, field.name) for field in fields(aspects)})
    film = even(2 * FRAMES)

    def contradicted(area_weight: Stated | None) -> Finding:
        found = measured(
            film, longer, size=FlagSize(length=1.5, height=1.5), area_weight=area_weight
        )
        (finding,) = [one for one in found.findings if one.kind.endswith("contradicted")]
        return finding

    shape = contradicted(None)
    assert shape.kind == "flag-size-contradicted"
    assert "area weight" not in shape.what
    both = contradicted(parse("0.12"))
    assert both.kind == "area-weight-contradicted"
    assert (
        "the area weight and the shape of the flag by its size, which were given, make the film"
        in both.what
    )


def test_a_weight_that_makes_the_film_improbable_is_called_a_contradiction(
    model: Estimator,
) -> None:
    believing = Believing(**{field.name: getattr(model, field.name) for field in fields(model)})

    def kinds(text: str) -> set[str]:
        return {
            finding.kind
            for finding in measured(even(2 * FRAMES), believing, area_weight=parse(text)).findings
        }

    assert "area-weight-contradicted" not in kinds("0.12")
    assert "area-weight-contradicted" not in kinds("0.11:0.17")
    assert "area-weight-contradicted" in kinds("0.16")  # more than four standard deviations away
    assert "area-weight-contradicted" in kinds("0.155:0.165")


def test_a_weighing_near_the_end_of_the_models_range_is_assumed_up_to_that_end(
    model: Estimator,
) -> None:
    area_weight = measured(even(FRAMES), model, area_weight=parse("0.165±0.01")).quantities[1]
    assert area_weight.assumed == pytest.approx((0.165 - 0.01645, 0.17))
    assert area_weight.span.high <= 0.17 or area_weight.span.bound is Bound.LEAST


def test_an_area_weight_is_that_of_the_flag_itself_whatever_its_size(model: Estimator) -> None:
    # a flag twice as long with 0.24 to 0.26 kg/m² moves like one of the training with 0.12 to 0.13
    film = even(6 * FRAMES)
    large = measured(
        film, model, size=FlagSize(length=3.0, height=2.0), area_weight=parse("0.24:0.26")
    ).quantities[1]
    assert large.assumed == (0.24, 0.26)
    assert 0.24 <= large.span.low < large.span.high <= 0.26


def test_an_area_weight_that_no_training_had_is_refused(model: Estimator) -> None:
    with pytest.raises(UsageError, match=r"knows 0\.1 to 0\.17"):
        measured(even(2 * FRAMES), model, area_weight=parse("0.15:0.30"))
    with pytest.raises(UsageError, match=r"knows 0\.2 to 0\.34"):
        measured(
            even(6 * FRAMES),
            model,
            size=FlagSize(length=3.0, height=2.0),
            area_weight=parse("0.12"),
        )


def test_windows_that_overlap_are_shown_and_not_counted_twice(model: Estimator) -> None:
    film = even(4 * FRAMES)
    apart, dense = (
        measure(
            film,
            model,
            gate=Listed(*[0.5] * 20),
            dependence=APART,
            options=Options(size=WHOLE, step=step),
        )
        for step in (None, 0.08)
    )
    assert (len(apart.windows), apart.combined) == (4, 4)
    assert len(dense.windows) > 4
    assert dense.combined == 4


def test_a_strange_window_of_a_familiar_film_is_left_out_of_the_answer(model: Estimator) -> None:
    film = even(4 * FRAMES)
    found = measure(
        film,
        model,
        gate=Listed(0.5, 0.001, 0.4, 0.6),
        dependence=APART,
        options=Options(size=WHOLE),
    )
    assert not found.verdict.refused
    assert (len(found.windows), found.combined) == (4, 3)
    (strange,) = [finding for finding in found.findings if finding.kind == "strange-windows"]
    assert strange.severity is Severity.WARNING
    assert "1 of 4 windows" in strange.what


def test_without_its_size_a_film_is_refused_as_it_is_with_each_size(model: Estimator) -> None:
    """Half of the windows are strange at every size: with the size that is refused, and so it is
    without it."""
    film = even(8 * FRAMES, rate=50.0)

    def judged(p: list[list[float]], size: FlagSize | None) -> Measurement:
        return measure(
            film,
            model,
            gate=Listed(*(value for row in p for value in row)),
            dependence=APART,
            options=Options(size=size, step=0.2),
        )

    count = len(judged([[0.5] * 3] * 40, None).windows)
    strange = [[0.001, 0.5, 0.001] if k % 2 else [0.5, 0.001, 0.5] for k in range(count)]
    assert judged(strange, None).verdict.refused
    assert judged([[0.001] if k % 2 else [0.5] for k in range(40)], WHOLE).verdict.refused


def test_a_size_at_which_the_film_would_be_refused_is_asked_for_and_no_part_of_the_answer(
    model: Estimator,
) -> None:
    film = even(8 * FRAMES, rate=50.0)
    found = measure(
        film, model, gate=Listed(*[0.001, 0.4, 0.5] * 40), dependence=APART, options=Options()
    )
    every = measure(
        film, model, gate=Listed(*[0.4, 0.4, 0.5] * 40), dependence=APART, options=Options()
    )
    assert [one.kind for one in found.verdict.reasons] == ["size-needed"]
    assert not every.verdict.refused
    assert found.sizes.scale.tolist() == every.sizes.scale.tolist()[1:]
    assert len(found.draws) == len(every.draws) * 2 // 3
    assert found.quantities[1].assumed[0] > every.quantities[1].assumed[0]
    assert "sizes-left-out" in {finding.kind for finding in found.findings}
    assert "sizes-left-out" not in {finding.kind for finding in every.findings}


@pytest.mark.parametrize("size", [WHOLE, FlagSize(length=0.375, height=0.25), None])
def test_a_wind_at_the_end_of_the_models_range_is_a_bound_at_any_size(
    model: Estimator, size: FlagSize | None
) -> None:
    found = measured(even(16 * FRAMES, rate=100.0), far(model, 0, 1.0), size=size)
    wind = found.quantities[0]
    assert (wind.value, wind.sigma, wind.span.high) == (None, None, np.inf)
    assert wind.span.low < wind.assumed[1]
    assert found.sentence.startswith("wind at least ")
    assert "wind-speed-at-end" in {finding.kind for finding in found.bounds}
    assert {window.quantity("wind_speed").value for window in found.windows} == {None}


def test_a_wind_near_calm_air_is_at_most_so_much_and_an_area_weight_at_an_end_is_a_bound(
    model: Estimator,
) -> None:
    film = even(4 * FRAMES)
    calm = measured(film, far(model, 0, -1.0)).quantities[0]
    assert (calm.span.bound, calm.span.low) == (Bound.MOST, 0.0)
    assert calm.value is not None
    light, heavy = (measured(film, far(model, 1, sign)).quantities[1] for sign in (-1.0, 1.0))
    assert (light.span.bound, light.span.low, light.value) == (Bound.MOST, 0.0, None)
    assert (heavy.span.bound, heavy.span.high, heavy.value) == (Bound.LEAST, np.inf, None)


def test_a_mean_over_windows_some_of_which_lie_at_the_end_is_a_bound(model: Estimator) -> None:
    """Two of eight windows of which nobody knows how strong their wind is, a quarter of all
    draws."""

    class Gusts(Estimator):
        def logits(self, embeddings: list[Tensor], *, seed: int, draws: int) -> Tensor:
            out = super().logits(embeddings, seed=seed, draws=draws)
            gust = seed in strong
            out[..., 0] = (4.0 if gust else 0.0) + 0.1 * out[..., 0]
            return out

    strong = {child_seed(0, "window", index) for index in (2, 5)}
    gusty = Gusts(**{field.name: getattr(model, field.name) for field in fields(model)})
    found = measured(even(8 * FRAMES), gusty)
    assert len(found.windows) == 8
    assert found.quantities[0].span.bound is Bound.LEAST
    assert found.quantities[0].span.low < 8.0
    one = measured(even(24 * FRAMES), gusty)  # two of 24 are fewer than a tenth
    assert one.quantities[0].value is not None
    (finding,) = [finding for finding in one.bounds if finding.kind == "windows-at-end"]
    assert finding.count == 2


@pytest.mark.parametrize("anyway", [False, True])
def test_a_still_film_and_a_black_one_are_given_no_number(model: Estimator, anyway: bool) -> None:
    still = pictures(1).repeat(2 * FRAMES, axis=0)
    for images in (still, np.zeros_like(still)):
        found = measured(Frames(time=np.arange(2 * FRAMES) / RATE, images=images), model)
        assert found.verdict.refused
        assert not found.shown(anyway=anyway)
        assert found.document(anyway=anyway)["quantities"] is None


def test_a_part_in_which_nothing_moves_is_no_part_of_the_answer_even_anyway(
    model: Estimator,
) -> None:
    images = np.concatenate([pictures(1).repeat(2 * FRAMES, axis=0), pictures(2 * FRAMES)])
    found = measured(Frames(time=np.arange(len(images)) / RATE, images=images), model)
    assert found.verdict.refused
    assert found.shown(anyway=True)
    assert found.verdict.blank == (True, True, False, False)
    assert (len(found.windows), found.combined) == (2, 2)
    assert found.windows[0].start == pytest.approx(2 * FRAMES / RATE)
    np.testing.assert_array_equal(found.clip, images[2 * FRAMES : 3 * FRAMES])


def test_the_clip_that_is_shown_and_refined_is_of_the_first_window_that_counts(
    model: Estimator,
) -> None:
    film = even(8 * FRAMES)
    gate = Listed(0.001, *(0.5,) * 7)
    found = measure(film, model, gate=gate, dependence=APART, options=Options(size=WHOLE))
    assert not found.verdict.refused
    assert found.verdict.strange.tolist() == [True, *(False,) * 7]
    np.testing.assert_array_equal(found.clip, film.images[FRAMES : 2 * FRAMES])


def test_a_refused_film_gives_no_estimate_unless_asked_for(model: Estimator) -> None:
    film = even(4 * FRAMES)
    found = measure(
        film,
        model,
        gate=Listed(0.001, 0.002, 0.003, 0.01),
        dependence=APART,
        options=Options(size=WHOLE),
    )
    assert found.verdict.refused
    shown, hidden = found.document(anyway=True), found.document(anyway=False)
    assert hidden["quantities"] is hidden["windows"] is hidden["sentence"] is None
    strong = measure(
        film,
        far(model, 0, 1.0),
        gate=Listed(*[0.001] * 4),
        dependence=APART,
        options=Options(size=WHOLE),
    )
    assert "m/s" not in str(strong.document(anyway=False))
    assert "m/s" in str(strong.document(anyway=True)["findings"])
    assert shown["sentence"] == found.sentence
    assert hidden["gate"]["reasons"][0]["kind"] == "listed"


def test_a_part_of_a_film_is_the_film_of_that_part(model: Estimator) -> None:
    images = pictures(3 * FRAMES)
    film = Frames(time=np.arange(len(images)) / RATE, images=images)
    part = Frames(time=np.arange(FRAMES) / RATE, images=images[FRAMES : 2 * FRAMES])
    cut = measured(film, model, first=FRAMES / RATE, last=(2 * FRAMES - 1) / RATE)
    np.testing.assert_array_equal(cut.draws, measured(part, model).draws)


def test_a_film_that_is_too_short_or_too_slow_is_refused_with_what_it_takes(
    model: Estimator,
) -> None:
    with pytest.raises(InputError, match=r"at least 0\.44 s"):
        measured(even(FRAMES - 3), model)
    with pytest.raises(RefusedError, match="too few frames a second"):
        measured(even(40, rate=10.0), model)


def test_a_film_full_of_gaps_is_refused(model: Estimator) -> None:
    times = np.delete(np.arange(60) / RATE, np.arange(5, 60, 8))
    with pytest.raises(UsageError, match=r"in the one at 0\.00 s 80 ms lie between two pictures"):
        measured(Frames(time=times, images=pictures(len(times))), model)


@pytest.mark.parametrize(("whole", "refused"), [(2, True), (4, False)])
def test_an_answer_of_fewer_than_a_third_of_the_windows_is_refused(
    whole: int, refused: bool, model: Estimator
) -> None:
    """Of nine windows so many have all their frames, and the others a gap in the middle of each."""
    lost = [k for k in range(whole * FRAMES + 2, 9 * FRAMES) if k % FRAMES in (5, 6)]
    times = np.delete(np.arange(9 * FRAMES) / RATE, lost)
    film = Frames(time=times, images=pictures(len(times)))
    found = measure(
        film, model, gate=Listed(*[0.5] * 9), dependence=APART, options=Options(size=WHOLE)
    )
    assert found.combined == whole
    assert [reason.kind for reason in found.verdict.faults] == ["few-windows"] * refused
    assert found.verdict.refused == refused
    if refused:
        assert re.search(
            rf": on {whole} of [89] windows, a third at least is needed$",
            found.verdict.faults[0].what,
        )


@pytest.mark.parametrize("hangs", [False, True])
def test_only_of_a_flag_it_is_a_fault_to_hang_from_above_and_beside_no_pole(
    hangs: bool, model: Estimator, cloth_model: Estimator
) -> None:
    faults = [
        Finding(kind=kind, severity=Severity.ERROR, what=kind, fix="")
        for kind in ("no-pole", "hangs-from-above", "cut-off")
    ]

    class Faulty(Frames):
        def findings(self) -> tuple[Finding, ...]:
            return tuple(faults)

    found = measured(
        Faulty(time=np.arange(40) / RATE, images=pictures(40)), cloth_model if hangs else model
    )
    expected = ["cut-off"] if hangs else [fault.kind for fault in faults]
    assert [reason.kind for reason in found.verdict.faults] == expected
    assert [finding.kind for finding in found.findings if finding in faults] == expected


def test_a_size_typed_height_first_is_named_where_the_film_is_too_slow_for_it(
    model: Estimator,
) -> None:
    """A flag of 1 m needs √1.5 times the pictures of one of 1.5 m, or 29.1 a second if one in
    twenty may be lacking."""
    different = (np.arange(200) // 20) * 9 + np.minimum(
        np.arange(200) % 20 // 2, 8
    )  # 27 of 60 frames a second
    film = Frames(time=np.arange(200) / 60.0, images=pictures(100)[different])
    with pytest.raises(RefusedError, match="there are too few frames a second") as caught:
        measured(film, model, size=FlagSize(length=1.0, height=1.5))
    assert "a flag of 1 m needs 29.1" in caught.value.what
    assert caught.value.fix is not None
    assert caught.value.fix.endswith("of a flag 1 m high and 1.5 m long give --flag-size 1.5x1")
    with pytest.raises(RefusedError, match=r"needs 29\.09") as slow:
        measured(even(40), model, size=FlagSize(length=1.0, height=1.5))
    assert slow.value.fix is not None
    assert slow.value.fix.endswith("give --flag-size 1.5x1")
    with pytest.raises(RefusedError) as small:
        measured(even(40), model, size=FlagSize(length=1.0, height=0.7))
    assert "--flag-size" not in str(small.value.fix)


@pytest.mark.parametrize(("every", "raised"), [(2, RefusedError), (FRAMES, UsageError)])
def test_repeated_frames_are_the_reason_where_they_are_many(
    every: int, raised: type[Exception], model: Estimator
) -> None:
    """Of half of the frames the reason is how the film was made, of one in a window that one."""
    images = pictures(6 * FRAMES)
    repeats = np.arange(5, len(images), every)
    images[repeats] = images[repeats - 1]
    with pytest.raises(raised, match="none of 6 windows has all its frames") as caught:
        measured(Frames(time=np.arange(len(images)) / RATE, images=images), model)
    assert ("many frames look alike" in str(caught.value)) == (every == 2)


def test_a_model_without_distributions_measures_nothing(model: Estimator) -> None:
    learner = model.learners[0]
    regression = type(learner)(
        learner.network, loss=Loss.REGRESSION, targets=tuple(learner.scaling.names)
    )
    with pytest.raises(UsageError, match="without intervals"):
        measured(even(2 * FRAMES), replace(model, learners=(regression,)))


def test_a_hanging_cloth_is_measured_in_its_own_ranges_and_size(cloth_model: Estimator) -> None:
    """1 m × 1 m is the size of its training: what the model says needs no scaling, and what is
    assumed is its range."""
    found = measured(even(3 * FRAMES), cloth_model, size=FlagSize(length=1.0, height=1.0))
    assert found.names == ("wind_speed", "area_weight", "bending_scale")
    assert found.sizes.scale == pytest.approx([1.0])
    assert "aspect-ratio" not in {finding.kind for finding in found.findings}
    wind, area_weight = found.quantities[:2]
    assert wind.assumed == pytest.approx((0.0, 6.0))
    assert area_weight.assumed == pytest.approx((0.079, 0.454))
    assert found.sentence.startswith(("wind", "area weight"))


def test_an_unknown_size_of_a_hanging_cloth_is_about_that_of_its_training(
    cloth_model: Estimator,
) -> None:
    found = measured(even(8 * FRAMES, rate=50.0), cloth_model, size=None)
    assert np.median(found.sizes.draws) == pytest.approx(1.0, abs=0.05)
    (assumed,) = [finding for finding in found.findings if finding.kind == "size-assumed"]
    assert "the cloth's size" in assumed.what
