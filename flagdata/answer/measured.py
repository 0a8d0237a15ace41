"""What `flagdata.measure` returns: the posterior of a film as arrays, or why the film was
refused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NoReturn

from flagdata.answer.answer import Answer, Array
from flagdata.answer.quantity import Quantity
from flagdata.answer.wind_elsewhere import WindComparison
from flagdata.core.arrays import FloatArray
from flagdata.core.findings import Finding
from flagdata.errors import RefusedError

if TYPE_CHECKING:
    import xarray as xr

DRAW, WINDOW = "draw", "window"
"""Dimensions of what a film says."""
DRAWN = "_draws"
"""Behind the name of a quantity in that of its draws."""
GUSTS = "gust_intensity"
"""Name of the gusts' intensity among the quantities."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Windows:
    """The windows of a film, each by itself, in order.

    Attributes:
        names: of the quantities.
        arrays: "start", "end" and "p", and of each quantity its value, "…_low" and "…_high".
    """

    names: tuple[str, ...]
    arrays: Mapping[str, Array]

    @property
    def start(self) -> FloatArray:
        """(k,) of their frames [s from the film's first frame]."""
        return self.arrays["start"].values

    @property
    def end(self) -> FloatArray:
        """(k,) of their frames [s from the film's first frame]."""
        return self.arrays["end"].values

    @property
    def p(self) -> FloatArray:
        """(k,) probability that a familiar clip is at least as strange."""
        return self.arrays["p"].values

    @property
    def value(self) -> Mapping[str, FloatArray]:
        """Quantity → (k,) means; NaN where only a bound is known."""
        return {name: self.arrays[name].values for name in self.names}

    @property
    def low(self) -> Mapping[str, FloatArray]:
        """Quantity → (k,) lower ends of the intervals; infinite where nothing bounds them."""
        return {name: self.arrays[f"{name}_low"].values for name in self.names}

    @property
    def high(self) -> Mapping[str, FloatArray]:
        """Quantity → (k,) upper ends of the intervals; infinite where nothing bounds them."""
        return {name: self.arrays[f"{name}_high"].values for name in self.names}


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Measured(Answer):
    """A film, measured or refused.

    A refused film has no quantities and no arrays, unless it was measured `anyway`: asking it for
    one raises `RefusedError`, with the reason and what to do.

    Attributes:
        film: its name.
        rate, duration: of it [Hz, s].
        network: that measured it.
        refused: whether the gate refused it.
        verdict: of the gate, in one sentence.
        reasons: why the film is refused, the weightiest first; `value` is the figure of a counted
            fault, or the p of a window that is unlike the training clips.
        figures: of how the film was made fit: camera, flags, crop; as in `--json` under
            "conditioning". None of a film that is too short for that.
        elsewhere: how the wind differs from one that was stated as `wind`; None where none was, or
            no answer is shown.
    """

    film: str
    rate: float
    duration: float
    network: str
    refused: bool
    verdict: str
    reasons: tuple[Finding, ...]
    figures: Mapping[str, Any] | None
    elsewhere: WindComparison | None = None

    def __post_init__(self) -> None:
        if not self.arrays:
            object.__setattr__(self, "quantities", _Withheld(self))

    def raise_refusal(self) -> NoReturn:
        """Raises:
        RefusedError: always: why the film was refused, and what to do.
        """
        fix = self.reasons[0].fix or "look at it with anyway=True"
        raise RefusedError(self.verdict, where=self.film, fix=fix)

    @property
    def wind(self) -> Quantity:
        """The wind speed [m/s], of a long film the mean over its windows.

        Raises:
            RefusedError: the film was refused, and was not measured `anyway`; or there is nothing
                to measure in it.
        """
        return self.quantities["wind_speed"]

    @property
    def draws(self) -> Mapping[str, FloatArray]:
        """Name → (n,) draws of the joint posterior, in the same order for all names. Raises as
        `wind`."""
        return {
            name.removesuffix(DRAWN): one.values
            for name, one in self._along(DRAW).items()
            if not one.coordinate
        }

    @property
    def windows(self) -> Windows:
        """The windows, each by itself. Raises as `wind`."""
        return Windows(names=tuple(self.draws), arrays=self._along(WINDOW))

    @property
    def gusts(self) -> Quantity | None:
        """Intensity of the gusts, standard deviation over mean wind [1]; None where the windows are
        not taken as one series, as of a film of one window. Raises as `wind`."""
        self._along(WINDOW)
        return self.quantities.get(GUSTS)

    def to_xarray(self) -> xr.Dataset:
        """Return draws, windows and the anemometer beside them as a data set, with units as
        attributes. Raises as `wind`.

        Raises:
            MissingExtraError: xarray is not installed.
        """
        return super().to_xarray()

    def _check_arrays(self) -> None:
        self._along(WINDOW)

    def _along(self, dimension: str) -> Mapping[str, Array]:
        if not self.arrays:
            self.raise_refusal()
        return {name: one for name, one in self.arrays.items() if one.dimensions == (dimension,)}


class _Withheld(dict[str, Quantity]):
    """Quantities of a refused film: none, and its refusal where one is asked for."""

    def __init__(self, film: Measured) -> None:
        super().__init__()
        self._film = film

    def __missing__(self, name: str) -> Quantity:
        self._film.raise_refusal()
