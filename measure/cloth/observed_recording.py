"""What is calibrated on: the observables of a film's windows, the log of the wind beside it, and
their summary.

A summary is each observable at the log's mean wind, and how it changes with wind,

    y_w = a + b ln(U_w/⟨U⟩) + n_w

by least squares over the windows that show it. a and b of a simulation scatter about those of
another one of the same cloth as n_w lets them, correlated between neighbouring windows or not: so
no correlation has to be modelled.

A part of an observable's error by pixels lasts: it is the same in all windows of a film. How large
that part is differs
by observable: an area is off by the same amount in every window, a frequency by another one in
each. Of what lasts in a film a part is the flag's look, its colours, background and view, and the
same in all recordings of it; the rest is the film's, whose wind bends the flag otherwise and whose
light is another. Errors of observables that are read from the same outline are correlated. All is
from films whose geometry is known (`python -m tests.studies looks`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol, TypeVar

import numpy as np

from flagdata.answer.circumstances import Circumstances
from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.core.findings import Finding, Severity
from flagdata.core.rng import stream
from flagdata.errors import InputError, RefusedError
from measure.cloth.blown_wind import STEADY, Log
from measure.cloth.flag_simulation import OBSERVED
from measure.observables.film_window import FilmWindow
from measure.observables.observable import WINDOW

SHOWN = 0.6
"""Share of the windows that are to show an observable. Higher drops observables that some windows
hide; lower lets a few windows stand for a recording."""
LEAST_WINDOWS = 4
"""Fewest windows of a recording: 10 s. Fewer give means that one gust decides."""
LEAST_IN_ALL = 8
"""Fewest windows of all recordings of a cloth together: 20 s."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Projection:
    """From windows to summaries.

    Attributes:
        speed: (window,) mean of the logged wind [m/s].
        changes: whether slopes are taken: not where the wind is constant.
    """

    speed: FloatArray
    changes: bool

    @property
    def regressors(self) -> FloatArray:
        """Returns the regressors (window, 1 or 2)."""
        relative = np.log(self.speed / np.exp(np.log(self.speed).mean()))
        constant = np.ones_like(relative)
        return np.stack([constant, relative], axis=1) if self.changes else constant[:, None]

    def of(self, readings: FloatArray) -> FloatArray:
        """Projects readings to (…, 1 or 2, observable), from (…, window, observable); NaN where too
        few windows show one."""
        x = self.regressors
        finite = np.isfinite(readings)
        y = np.where(finite, readings, 0.0)
        products = np.einsum("wi,wj,...wk->...kij", x, x, finite.astype(np.float64))
        enough = finite.mean(axis=-2) >= SHOWN
        products = np.where(enough[..., None, None], products, np.eye(x.shape[1]))
        right = np.einsum("wi,...wk->...ki", x, y)
        coefficients = np.linalg.solve(products, right[..., None])[..., 0]
        return np.swapaxes(np.where(enough[..., None], coefficients, np.nan), -1, -2)

    def at(self, summaries: FloatArray) -> FloatArray:
        """Returns (…, window, observable) that summaries stand for."""
        return np.einsum("wi,...ik->...wk", self.regressors, summaries)


def shown(readings: FloatArray) -> BoolArray:
    """Returns (observable,) whether enough windows (window, observable) show it."""
    return np.asarray(np.isfinite(readings).mean(axis=0) >= SHOWN)


LASTING = np.array([0.70, 0.93, 0.79, 0.31, 0.57, 0.31, 0.56, 0.97])
"""(observable of `simulation.OBSERVED`) share of the variance that lasts: of 118 windows of 64
films by VTK, whose deviation is `Observable.sigma` (docs/results/validate-looks.md)."""
COMMON = 0.63
"""Share of what lasts in a film that is the same in all recordings of the flag: 0.37 to 0.77, of
two films each of twelve looks by the raster renderer, of all observables together."""
LASTING_TOGETHER = {
    ("extension", "area"): 0.77,
    ("frequency", "bandwidth"): 0.85,
    ("middle-speed", "amplitude-across"): 0.56,
    ("amplitude-up", "amplitude-across"): 0.56,
}
"""Correlations of these films' mean errors. All others are within three standard errors of none."""
PASSING_TOGETHER = {("frequency", "bandwidth"): 0.75, ("bandwidth", "amplitude-up"): -0.44}
"""The same of the differences of their two windows."""


def pixel_errors(
    projection: Projection, windows: int, count: int, *, name: str, seed: int
) -> FloatArray:
    """Draws (count, 1 or 2, observable) errors of summaries of films whose windows err by a
    standard deviation of one.

    Args:
        projection: of the film's windows.
        windows: how many they are.
        name: of the recording.
    """
    size = len(OBSERVED)
    passing = (
        stream(seed, "pixels", "passing", name).standard_normal((count, windows, size)) @ _PASSING.T
    )
    look, film = (
        stream(seed, "pixels", "lasting", *names).standard_normal((count, size))
        for names in ((), (name,))
    )
    lasting = (np.sqrt(COMMON) * look + np.sqrt(1 - COMMON) * film) @ _LASTING.T
    errors = projection.of(np.sqrt(1 - LASTING) * passing)
    errors[:, 0] += np.sqrt(LASTING) * lasting
    return errors


def correlations(together: Mapping[tuple[str, str], float]) -> FloatArray:
    """Returns (observable, observable) of pairs of names."""
    matrix = np.eye(len(OBSERVED))
    for (first, second), value in together.items():
        a, b = OBSERVED.index(first), OBSERVED.index(second)
        matrix[a, b] = matrix[b, a] = value
    return matrix


_LASTING, _PASSING = (
    np.linalg.cholesky(correlations(one)) for one in (LASTING_TOGETHER, PASSING_TOGETHER)
)
LONGEST = 120.0
"""s of a film that are simulated: two minutes cost minutes."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Excerpt:
    """A window of the film in pictures.

    Attributes:
        number: of the window.
        window: its pictures, and where its hoist is in them.
    """

    number: int
    window: FilmWindow

    @classmethod
    def of(cls, windows: Sequence[FilmWindow | None]) -> Excerpt | None:
        """Returns the window nearest to the middle of a film's second half; None where no window of
        that half was read."""
        half = len(windows) // 2
        later = [
            cls(number=half + k, window=window)
            for k, window in enumerate(windows[half:])
            if window is not None
        ]
        return min(
            later, key=lambda excerpt: abs(excerpt.number - (half + len(windows)) / 2), default=None
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Observed:
    """A recording.

    Attributes:
        name: what people call it.
        source: identity of what it was read from.
        readings: (window, observable) of windows of `WINDOW` seconds that follow one another, in
            the order of `simulation.OBSERVED`; NaN where a window does not show one.
        sigma: (observable,) what a window's readings of a film are off by; 0 for geometry.
        log: of the wind, its times since the first window begins.
        first: where the first window begins in the film or table [s].
        place: what is shared by recordings from one place with one anemometer, whose gain and view
            are one; None for a recording of a place of its own.
        findings: what was noticed.
        excerpt: some of its film; None where there is no film.
        circumstances: when, where and with what it was recorded.

    Raises:
        InputError: shapes that disagree, or too few windows.
        RefusedError: no observable is shown in enough of them.
    """

    name: str
    source: str
    readings: FloatArray
    log: Log
    first: float = 0.0
    place: str | None = None
    sigma: FloatArray = field(default_factory=lambda: np.zeros(len(OBSERVED)))
    findings: tuple[Finding, ...] = ()
    excerpt: Excerpt | None = None
    circumstances: Circumstances = field(default_factory=Circumstances)

    def __post_init__(self) -> None:
        count = len(OBSERVED)
        if (
            self.readings.ndim != 2
            or self.readings.shape[1] != count
            or self.sigma.shape != (count,)
        ):
            raise InputError(
                f"readings of shape {self.readings.shape}",
                where=self.name,
                fix=f"give (window, {count}) of {OBSERVED}",
            )
        check_duration(len(self.readings) * WINDOW, where=self.name)
        if not shown(self.readings).any():
            most = int(np.isfinite(self.readings).sum(axis=0).max())
            raise RefusedError(
                f"no observable could be read in {SHOWN:.0%} of the windows, the best in {most} of "
                f"{len(self.readings)}: the outline is lost in the others, or what is followed is "
                "not the flag",
                where=self.name,
                fix="look at the flag on the page of flagdata measure --report, and choose it by "
                "--crop or --flag, or "
                "a part by --start and --end; flagdata observe with its --flag-size says why "
                "windows show nothing",
            )

    @property
    def duration(self) -> float:
        """Returns the duration [s]."""
        return len(self.readings) * WINDOW

    @property
    def speed(self) -> FloatArray:
        """Returns (window,) mean of the logged wind [m/s]."""
        starts = np.arange(len(self.readings)) * WINDOW
        return self.log.mean_speed(starts, starts + WINDOW)

    @property
    def steady(self) -> bool:
        """Returns whether the wind is constant."""
        speed = self.speed
        return float(speed.std()) < STEADY * float(speed.mean())

    @property
    def projection(self) -> Projection:
        """Returns what leads from its windows to its summary."""
        return Projection(speed=self.speed, changes=not self.steady)

    @property
    def summary(self) -> FloatArray:
        """Returns its summary (summary,)."""
        return self.projection.of(self.readings).ravel()

    def pixels(self, count: int, *, seed: int) -> FloatArray:
        """Draws (count, 1 or 2, observable) of what errors of pixels add to its summary."""
        return self.sigma * pixel_errors(
            self.projection, len(self.readings), count, name=self.name, seed=seed
        )


def constant_wind(recordings: Sequence[Observed]) -> tuple[Finding, ...]:
    """Reports what recordings of a flag leave open where all their winds are one."""
    speed = np.concatenate([recording.speed for recording in recordings])
    if speed.std() >= STEADY * speed.mean():
        return ()
    text = (
        f"the wind hardly changes ({speed.mean():.1f} m/s, its windows within {speed.std():.2f} "
        "m/s): "
        "air density, drag coefficient, the anemometer's gain and the weight act alike, and the "
        "weight rests on "
        "what is assumed of the others"
    )
    fix = "add recordings in other winds: flagdata calibrate takes several of one flag"
    return (Finding.of("constant-wind", text, fix=fix),)


def cut(observed: Observed, first: float, last: float | None) -> Observed:
    """Cuts out the windows from `first` to `last` [s], `LONGEST` at most.

    Raises:
        InputError: the log does not cover them, or too few are left.
    """
    begin = math.ceil(first / WINDOW - 1e-9)
    end = len(observed.readings) if last is None else math.floor(last / WINDOW + 1e-9)
    most = begin + round(LONGEST / WINDOW)
    findings = observed.findings
    if min(end, len(observed.readings)) > most:
        findings = (*findings, first_part((min(end, len(observed.readings)) - begin) * WINDOW))
    readings = observed.readings[begin : min(end, most)]
    log = observed.log.cut(begin * WINDOW, (begin + len(readings)) * WINDOW)
    return replace(
        observed,
        readings=readings,
        log=log,
        first=observed.first + begin * WINDOW,
        findings=findings,
    )


def check_duration(seconds: float, *, where: str) -> None:
    """Refuse a recording that has too few windows.

    Raises:
        InputError: so it is.
    """
    if seconds < LEAST_WINDOWS * WINDOW:
        raise InputError(
            f"only {max(seconds, 0.0):.3g} s of film have a log beside them",
            where=where,
            fix=f"give {LEAST_WINDOWS * WINDOW:g} s or more; two minutes are better",
        )


class _Lasting(Protocol):
    @property
    def name(self) -> str: ...

    @property
    def duration(self) -> float: ...


def check_in_all(recordings: Sequence[_Lasting], *, left_out: Sequence[Finding] = ()) -> None:
    """Refuses recordings of one flag that are together too short to weigh it.

    Args:
        left_out: a warning for each of those that do not count.

    Raises:
        InputError: so they are.
    """
    seconds = sum(recording.duration for recording in recordings)
    if seconds < LEAST_IN_ALL * WINDOW - 1e-9:
        without = "".join(f"; {finding.what}" for finding in left_out)
        raise InputError(
            f"only {seconds:.3g} s of film have a log beside them{without}",
            where=", ".join(recording.name for recording in recordings),
            fix=f"give {LEAST_IN_ALL * WINDOW:g} s or more in all; two minutes are better",
        )


def first_part(duration: float) -> Finding:
    """Reports that of a recording of that duration [s] above `LONGEST` a part is used."""
    text = f"of {duration:.1f} s the first {LONGEST:g} are used"
    return Finding.of("first-part", text, fix="choose others with --start and --end")


S = TypeVar("S")
T = TypeVar("T")
LEFT_OUT = "left-out"
"""Kind of the finding that names one."""


def usable(
    recordings: Sequence[S], use: Callable[[S], T], *, name: Callable[[S], str]
) -> tuple[list[T], tuple[Finding, ...]]:
    """Uses the recordings that can be used, with a warning for each that cannot. Errors of a kind
    that is not the recording's, such as a name that nothing has, are raised.

    Args:
        use: raises InputError or RefusedError where a recording cannot be used.
        name: by which a person knows it.

    Raises:
        InputError, RefusedError: the error of a single recording.
        RefusedError: none of several can be used.
    """
    results: list[T] = []
    failed: list[tuple[str, InputError | RefusedError]] = []
    for recording in recordings:
        try:
            results.append(use(recording))
        except (InputError, RefusedError) as error:
            if len(recordings) == 1:
                raise
            failed.append((name(recording), error))
    if failed and not results:
        reasons = "; ".join(f"{who}: {error.what}" for who, error in failed)
        raise RefusedError(
            f"none of {len(failed)} recordings can be used: {reasons}",
            where=", ".join(who for who, _ in failed),
            fix="; ".join(dict.fromkeys(error.fix for _, error in failed)),
        )
    return results, tuple(
        Finding(
            kind=LEFT_OUT,
            severity=Severity.WARNING,
            what=f"{who} is left out: {error.what}",
            fix=error.fix,
        )
        for who, error in failed
    )
