"""From the network's draws for each window to the film's answer: posterior draws in SI units,
combined over windows and over the flag sizes considered."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
import torch
from numpy.typing import NDArray

from flagdata.answer import Quantity
from flagdata.core.arrays import Float32Array, FloatArray
from flagdata.core.findings import Finding
from flagdata.core.rng import child_seed, stream
from flagdata.core.stated import Stated
from measure.estimate.combine import OWN, Dependence, combine_windows, effective
from measure.estimate.film_answer import quantities
from measure.estimate.gusty_series import Course, GustPrior, Gusty, SeriesErrors, log_moments
from measure.estimate.measuring_options import Options
from measure.film.similarity import POWERS, Sizes, scaled_back
from measure.film.windows import WindowLayout
from measure.gate.gate_verdict import Reason
from models.networks.mixture import Mixture
from models.trained.estimator import Estimator
from models.trained.restriction import Known, Restricted

DRAWS = 2000
"""How many draws there are of each window's posterior, for each size of flag. The draws place an
end of a 90 % interval to about a twentieth of the posterior's standard deviation."""
WIND, WEIGHT = "wind_speed", "area_weight"
_LIGHT_AND_HEAVY = (0.1, 0.9)
"""Quantiles of the answer's area weights at which the wind is given where the weight is open."""
_MATTERS = 0.25
"""Share of the wind's interval by which it changes between these where the weight matters."""
_NORMAL = 1.645
"""Standard deviations either way that hold 90 % of a normal distribution."""


@dataclass(frozen=True, kw_only=True, eq=False)
class WindowAnswer:
    """What one window said by itself.

    Attributes:
        start, end: of its frames, at the smallest and largest size considered [s from the film's
            first frame].
        quantities: with their intervals.
        p: probability that a familiar clip is at least as strange.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = (
        "start",
        "end",
        "p",
        "quantities=by_name",
    )

    start: float
    end: float
    quantities: tuple[Quantity, ...]
    p: float

    def quantity(self, name: str) -> Quantity:
        """Returns the quantity of that name."""
        return next(quantity for quantity in self.quantities if quantity.name == name)

    @property
    def by_name(self) -> Mapping[str, Quantity]:
        """Name → quantity."""
        return {quantity.name: quantity for quantity in self.quantities}


@dataclass(frozen=True, kw_only=True, eq=False)
class Look:
    """One window as the network sees it, at each size considered (i).

    Attributes:
        start: of its frames [s from the film's first frame].
        posterior: without what is known.
        logits: (i, n, target) draws with it.
        summaries: (i, dimension) of the first network.
        reasons: why the window cannot be measured, for each size.
        log_factor: (i, n) log Bayes factor of what is known, 0 if nothing is.
    """

    start: float
    posterior: Mixture
    logits: FloatArray
    summaries: Float32Array
    reasons: tuple[list[Reason], ...]
    log_factor: FloatArray

    @property
    def blank(self) -> bool:
        """Whether there is nothing to measure, at any size."""
        return all(reasons[0].blank for reasons in self.reasons)

    def only(self, places: Sequence[int]) -> Look:
        """Returns the same at some of the sizes."""
        chosen = list(places)
        return replace(
            self,
            posterior=self.posterior.rows(chosen),
            logits=self.logits[chosen],
            summaries=self.summaries[chosen],
            reasons=tuple(self.reasons[size] for size in chosen),
            log_factor=self.log_factor[chosen],
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Among:
    """Windows among those of a gusty series.

    Attributes:
        series: of the film.
        places: of the windows in it.
    """

    series: Gusty
    places: Sequence[int]


@dataclass(frozen=True, kw_only=True, eq=False)
class JointDraws:
    """The joint posterior of several windows.

    Attributes:
        draws: (n, target), the wind the mean of the windows'.
        places: (m, target) the windows' own values as shares, 0 to 1, of the network's range.
        rows: (n,) of the draws at all sizes in a row, that these are.
        series: the gusty series, its draws in the order of these; None without one.
    """

    draws: FloatArray
    places: FloatArray
    rows: NDArray[np.intp]
    series: Gusty | None

    def wind(self, place: int) -> WindowWind | None:
        """Returns the wind of the window at a place in the series; None without one."""
        return (
            None
            if self.series is None
            else WindowWind(winds=self.series.winds[:, place], rows=self.rows)
        )

    @property
    def intensity(self) -> FloatArray | None:
        """(n,) intensity of the gusts, draw by draw; None without a series."""
        return None if self.series is None else self.series.intensity.ravel()[self.rows]


@dataclass(frozen=True, kw_only=True, eq=False)
class WindowWind:
    """A window's wind in a gusty series.

    Attributes:
        winds: (i, n) draws at each size considered, of a flag of the network's own size [m/s].
        rows: of these in a row, the film's answer.
    """

    winds: FloatArray
    rows: NDArray[np.intp]


@dataclass(frozen=True, kw_only=True, eq=False)
class FilmAnswer:
    """Combines the windows' draws into the film's answer, and gives each window's own answer."""

    model: Estimator
    sizes: Sizes
    options: Options

    @property
    def names(self) -> tuple[str, ...]:
        return self.model.learners[0].scaling.quantities

    @cached_property
    def known(self) -> tuple[Known, ...]:
        """What is known besides the film, of a flag of the network's own size."""
        return self.options.known(self.sizes, self.model)

    @cached_property
    def _before(self) -> Restricted:
        """Restricts the prior to what is known before the film."""
        prior_seed = child_seed(self.options.seed, "prior")
        return self.model.given(
            self.model.prior(len(self.sizes.scale)), self.known, seed=prior_seed, draws=DRAWS
        )

    def given(self, posterior: Mixture, *, seed: int) -> tuple[FloatArray, FloatArray]:
        """Draws logits (i, n, target) of a window's posterior given what is known, and their log
        Bayes factors (i, n)."""
        restricted = self.model.given(posterior, self.known, seed=seed, draws=DRAWS)
        factor = torch.where(
            restricted.log_mass > -torch.inf,
            restricted.log_mass - self._before.log_mass,
            -torch.inf,
        )
        return restricted.logits.cpu().numpy(), factor.cpu().numpy()

    def by_weight(
        self,
        looks: Sequence[Look],
        dependence: Dependence,
        quantities: Sequence[Quantity],
        draws: FloatArray,
        series: Callable[[FilmAnswer, Sequence[Look]], Gusty] | None = None,
    ) -> Finding | None:
        """Reports how the wind would change with the area weight, where that is open and matters:
        the answers for a light and a heavy cloth of those that the answer leaves possible; None
        where it does not.

        Args:
            quantities: the answer's quantities.
            draws: (n, target) of the answer.
            series: makes the gusty series of windows; None where the answer has none.
        """
        wind = next(quantity for quantity in quantities if quantity.name == WIND)
        if (
            wind.value is None
            or not wind.constrained
            or WEIGHT not in self.names
            or self.options.area_weight is not None
        ):
            return None
        column = self.names.index(WEIGHT)
        ends = np.quantile(draws[:, column], _LIGHT_AND_HEAVY)
        weights = [float(np.clip(float(f"{end:.2g}"), *self.assumed[column])) for end in ends]
        winds = []
        for weight in weights:
            at_weight = replace(self, options=replace(self.options, area_weight=Stated.of(weight)))
            reweighted = []
            for number, look in enumerate(looks):
                logits, log_factor = at_weight.given(
                    look.posterior, seed=child_seed(self.options.seed, WEIGHT, number)
                )
                reweighted.append(replace(look, logits=logits, log_factor=log_factor))
            among = None
            if series is not None:
                among = Among(series=series(at_weight, reweighted), places=range(len(reweighted)))
            found = at_weight.joint(reweighted, dependence, among)
            winds.append(float(found.draws[:, self.names.index(WIND)].mean()))
        if abs(winds[1] - winds[0]) < _MATTERS * (wind.span.high - wind.span.low):
            return None
        light, heavy = (
            f"at {weight:.2g} kg/m² {wind_speed:.1f} m/s"
            for weight, wind_speed in zip(weights, winds, strict=True)
        )
        return Finding.of(
            "weight-open",
            f"the wind depends on the weight of the cloth, which was not given: {light}, {heavy}",
            value=winds[1] - winds[0],
            fix="weigh the cloth and give --area-weight",
        )

    def joint(
        self, looks: Sequence[Look], dependence: Dependence, among: Among | None = None
    ) -> JointDraws:
        """Combines all windows.

        Args:
            among: the gusty series that the windows belong to; None where each has the wind that it
                says by itself.
        """
        wind_columns = [column for column, name in enumerate(self.names) if name in OWN]
        cloth_columns = [column for column, name in enumerate(self.names) if name not in OWN]
        parts, places, orders = [], [], []
        for stratum in range(len(self.sizes.scale)):
            prior = self.prior_logits[stratum]
            winds, shared = combine_windows(
                np.stack([look.logits[stratum] for look in looks]),
                names=self.names,
                centre=prior.mean(axis=0),
                spread=prior.std(axis=0),
                dependence=dependence,
                exact=self.stated_exactly,
                generator=stream(self.options.seed, "combine", stratum),
            )
            logits = np.empty((*winds.shape[:2], len(self.names)))
            logits[..., wind_columns] = winds
            logits[..., cloth_columns] = shared
            values = self._values(logits)
            if among is not None:
                # The series has no cloth: its draws go with the cloth's in the order of the winds
                # that have one.
                column, of_windows = (
                    self.names.index(WIND),
                    among.series.winds[stratum][list(among.places)],
                )
                order = np.empty(len(shared), dtype=np.intp)
                order[np.argsort(values[..., column].mean(axis=0))] = np.argsort(
                    of_windows.mean(axis=0)
                )
                values[..., column] = of_windows[:, order]
                orders.append(order)
            parts.append(scaled_back(values.mean(axis=0), self.names, self.sizes.draws[stratum]))
            places.append(self._places(values))
        rows = self._film_rows(looks, dependence)
        draws = np.concatenate(parts)[rows]
        for name, stated_value in self.options.stated(self.model).items():
            if (
                not stated_value.sigma
            ):  # combining windows moves draws a little, some out of the range
                column = self.names.index(name)
                draws[:, column] = np.clip(draws[:, column], stated_value.low, stated_value.high)
        return JointDraws(
            draws=draws,
            places=np.concatenate(places, axis=1)[:, rows].reshape(-1, len(self.names)),
            rows=rows,
            series=None if among is None else among.series.reorder_draws(orders),
        )

    def _film_rows(self, looks: Sequence[Look], dependence: Dependence) -> NDArray[np.intp]:
        """Selects the draws, those of all sizes in a row, that make the film's answer."""
        tempered = effective(len(looks), dependence.cloth) / len(looks)
        return self._rows(tempered * np.sum([look.log_factor for look in looks], axis=0), "answer")

    def window(
        self, look: Look, layout: WindowLayout, p: float, wind: WindowWind | None = None
    ) -> WindowAnswer:
        """Gives a window's own answer.

        Args:
            wind: of the window in the film's gusty series; None for what the window says by itself.
        """
        values = [self._values(logits) for logits in look.logits]
        draws, places = self._placed_draws(values)
        rows = self._rows(look.log_factor, "window")
        draws, places = draws[rows], places[rows]
        if wind is not None:
            column = self.names.index(WIND)
            for of_size, winds in zip(values, wind.winds, strict=True):
                of_size[:, column] = winds
            series_draws, series_places = self._placed_draws(values)
            draws[:, column], places[:, column] = (
                series_draws[wind.rows, column],
                series_places[wind.rows, column],
            )
        return WindowAnswer(
            start=look.start,
            end=look.start + layout.length,
            quantities=self.quantities(draws, places),
            p=p,
        )

    def _placed_draws(self, values: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Returns draws of all sizes in a row, at the flag's own size [SI], and their places in the
        network's range."""
        draws = [
            scaled_back(v, self.names, s) for v, s in zip(values, self.sizes.draws, strict=True)
        ]
        return np.concatenate(draws), np.concatenate([self._places(v) for v in values])

    def series(
        self,
        looks: Sequence[Look],
        layout: WindowLayout,
        errors: SeriesErrors,
        *,
        apart: Sequence[int],
    ) -> Gusty:
        """Takes the windows as one gusty series, at each size considered.

        Args:
            looks: two or more, in the order of their starts.
            errors: of the model in windows of one film.
            apart: places of windows that do not overlap.
        """
        area_weight = self.options.area_weight
        pair = errors.stated if area_weight is not None and area_weight.exact else errors.opened
        winds, intensity = [], []
        for stratum, scale in enumerate(self.sizes.scale.tolist()):
            moments = [log_moments(self._winds(look.logits[stratum])) for look in looks]
            course = Course(
                logs=np.array([mean for mean, _ in moments]),
                sigmas=np.array([sigma for _, sigma in moments]),
                starts=np.array([look.start for look in looks]) / math.sqrt(scale),
                window=layout.frames * max(layout.spacings) / math.sqrt(scale),
                apart=apart,
                pair=pair,
                halves=errors.halves,
                neighbours=errors.neighbours,
                prior=GustPrior.standard(size=scale),
            )
            drawn = course.draws(DRAWS, stream(self.options.seed, "gusts", stratum))
            winds.append(drawn[0])
            intensity.append(drawn[1])
        return Gusty(winds=np.array(winds), intensity=np.array(intensity))

    def _winds(self, logits: FloatArray) -> FloatArray:
        """Returns winds (n,) of draws of logits (n, target), of a flag of the network's own size
        [m/s]."""
        return self._values(logits)[:, self.names.index(WIND)]

    def _rows(self, log_factor: FloatArray, *names: str) -> NDArray[np.intp]:
        """Selects the draws, those of all sizes in a row, that make the answer: each as often as
        the Bayes factor (i, n) of what is known makes its size probable, by systematic resampling.

        A size s is as probable before as the prior of sizes has it, and a statement about the cloth
        says nothing of it. With the film x_s, which the network looks at as that of a flag of this
        size, and with p(x_s) alike for all sizes, as where nothing is known, p(s | x, L) ∝ p(s)
        p(x_s | L, s)/p(x_s) = p(s) Z/Z_π (`models.trained.restriction`).
        """
        total = log_factor.ravel()
        if np.ptp(total) == 0:
            return np.arange(len(total))
        share = np.exp(total - total.max()).cumsum()
        first = stream(self.options.seed, "sizes", *names).uniform()
        return np.searchsorted(share / share[-1], (first + np.arange(len(total))) / len(total))

    def quantities(self, draws: FloatArray, places: FloatArray) -> tuple[Quantity, ...]:
        return quantities(
            draws,
            self.prior,
            self.names,
            level=self.options.level,
            assumed=self.assumed,
            places=places,
            stated_values=self.options.stated(self.model),
        )

    def _places(self, values: FloatArray) -> FloatArray:
        """Places of values (…, target) in the network's range, 0 to 1: the range moves with the
        flag's size."""
        low, high = self._ends
        return (values - low) / (high - low)

    @property
    def _ends(self) -> FloatArray:
        """(2, target) of the range that the model learned."""
        return np.array([[t.low for t in self.model.targets], [t.high for t in self.model.targets]])

    @cached_property
    def prior(self) -> FloatArray:
        """(n, target) draws of what is assumed of a flag of these sizes."""
        logits = self.prior_logits
        return scaled_back(
            self._values(logits.reshape(-1, len(self.names))), self.names, self.sizes.draws.ravel()
        )

    @cached_property
    def prior_logits(self) -> FloatArray:
        """(i, n, target) draws of the same as the model knows them, for each size of flag."""
        learner, shape = self.model.learners[0], self.sizes.draws.shape
        if self.known:
            return self._before.logits.cpu().numpy()
        normal = stream(self.options.seed, "prior").standard_normal((*shape, len(self.names)))
        return (
            learner.centre.double().cpu().numpy() + learner.spread.double().cpu().numpy() * normal
        )

    @cached_property
    def assumed(self) -> FloatArray:
        """Returns the range (target, 2) that was simulated, at these sizes; where not simulated
        evenly, 90 % of it."""
        ends = self._ends
        smallest, largest = np.quantile(self.sizes.draws, [0.05, 0.95])
        low, high = (
            scaled_back(ends[0], self.names, smallest),
            scaled_back(ends[1], self.names, largest),
        )
        even = np.array([name in POWERS for name in self.names])[:, None]
        ranges = np.where(
            even, np.stack([low, high], axis=1), np.quantile(self.prior, [0.05, 0.95], axis=0).T
        )
        for name, stated_value in self.options.stated(self.model).items():
            column = self.names.index(name)
            within = np.array(stated_value.within(_NORMAL))
            ranges[column] = np.clip(within, *ranges[column]) if stated_value.sigma else within
        return ranges

    @property
    def stated_exactly(self) -> tuple[str, ...]:
        """Returns the targets whose value was given."""
        return tuple(
            name
            for name, stated_value in self.options.stated(self.model).items()
            if stated_value.exact
        )

    def _values(self, logits: FloatArray) -> FloatArray:
        return self.model.learners[0].scaling.values(torch.from_numpy(logits)).numpy()
