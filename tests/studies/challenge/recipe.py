"""What a challenge consists of, as TOML (`recipes` beside it). Parsed here and nowhere else; unknown keys refused.

All values are SI. A *range* is `{ low = …, high = …, scale = "linear" | "log" }`.

    title
    [composition]     null, one, pair, outside: shares of the sets
    [flag]            width, height, materials: names; density, bending: ranges of factors on the nominal material
    [recordings]      count, duration, settle, apart [m/s]; rates, noises: dealt out evenly; speed: a range
    [log]             share: of the sets whose wind varies; rate; intensity: a range; length: integral scale
    [markers]         columns, rows; jitter: as a share of the spacing; one pattern for all sets
    [films]           where it is there, sets are films in place of markers, and share their winds and what is stated of
                      the camera's place; angles in degrees. rate, width, pixels-high, view: angle of the picture's
                      longer side; samples a pixel; azimuth: of the camera's axis to the wind; elevation, upwards;
                      distance; azimuth-sigma, elevation-sigma, distance-sigma (a share): their standard uncertainty,
                      by which the true place differs; height: of the flag's middle above the ground;
                      weight-sigma: standard error of the stated area weight (a share), 0 where none is stated;
                      backgrounds: kinds that are behind the flag, see `sim.render.prior`
    [numerics.NAME]   columns, rows, diagonals, integrator, step, thickness: of contact, none where it is 0; damping
    [effects.NAME]    parameter, range, negative: share of the sets with the other sign; an effect of the library;
                      values: magnitudes in place of a range; sets of this effect alone have them in turn
    [outside.NAME]    the same, of `tests.studies.challenge.outside`
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from math import lcm
from pathlib import Path
from typing import Any

from flagdata.errors import InputError, LimitError
from flagdata.recipes import Shelf, parsed
from flagdata.registry import Registry
from flagdata.tables import NOT_NEGATIVE, POSITIVE, Bounds, Range, Table
from sim import material


class _Beside(Shelf):
    """Recipes that lie beside this module."""

    def place(self) -> Path:
        """The folder in which the recipes are."""
        return Path(__file__).parent / self.folder


CHALLENGES = _Beside(folder="recipes", noun="challenge")
CELLS_LIMIT = 100_000
"""Most cells of a mesh, and most markers."""
TICKS_LIMIT = 10_000_000
"""Most instants of a recording, at the rate that all its rates divide."""


class Kind(StrEnum):
    """What is undeclared in a set."""

    NULL = "null"
    ONE = "one"
    PAIR = "pair"
    OUTSIDE = "outside"


class Diagonals(StrEnum):
    """How the cells of a mesh are cut in two."""

    ALTERNATE = "alternate"
    FORWARD = "forward"


class Method(StrEnum):
    """How steps are integrated."""

    SYMPLECTIC = "symplectic"
    IMPLICIT = "implicit"


@dataclass(frozen=True, kw_only=True)
class Numerics:
    """What the generator computes with.

    Attributes:
        columns, rows: cells of the mesh.
        diagonals: of them.
        integrator: with steps of `step` [s], or as long as is stable where that is 0.
        thickness: of contact [m]; 0 for none.
        damping: of the cloths it takes [s].
    """

    columns: int = 20
    rows: int = 14
    diagonals: Diagonals = Diagonals.ALTERNATE
    integrator: Method = Method.SYMPLECTIC
    step: float = 0.0
    thickness: float = 0.0
    damping: Range = field(default_factory=lambda: Range(low=1e-3, high=1e-3))


@dataclass(frozen=True, kw_only=True)
class Filming:
    """How sets are filmed; attributes as in the module's description."""

    rate: int = 25
    width: int = 320
    pixels_high: int = 240
    view: float = 24.0
    samples: int = 4
    azimuth: float = 80.0
    azimuth_sigma: float = 5.0
    elevation: float = 0.0
    elevation_sigma: float = 2.0
    distance: float = 8.0
    distance_sigma: float = 0.02
    height: float = 3.0
    weight_sigma: float = 0.03
    backgrounds: tuple[str, ...] = ("sky", "hills", "foliage", "buildings")


@dataclass(frozen=True, kw_only=True)
class Strengths:
    """Strengths at which one effect is set.

    Attributes:
        parameter: which strength is drawn; everything else stays at its usual value.
        range: of its magnitude.
        negative: share of the sets in which it is negative.
        values: magnitudes that were fixed beforehand; none where the magnitude is drawn from the range.
    """

    parameter: str
    range: Range
    negative: float
    values: tuple[float, ...] = ()

    def size(self, turn: int | None, uniform: float) -> float:
        """The magnitude in a set: of fixed values that whose turn it is, or any where none has; else from the range.

        Args:
            turn: how many sets of this effect alone come before; `None` of an effect beside another.
            uniform: a draw from 0 to 1.
        """
        if not self.values:
            return self.range.at(uniform)
        count = len(self.values)
        return self.values[int(uniform * count) if turn is None else turn % count]


@dataclass(frozen=True, kw_only=True)
class ChallengeRecipe:
    """A challenge before its keys are drawn; attributes as in the module's description."""

    title: str
    composition: dict[Kind, float]
    width: float
    height: float
    materials: tuple[str, ...]
    density: Range
    bending: Range
    count: int
    duration: float
    settle: float
    rates: tuple[int, ...]
    noises: tuple[float, ...]
    speed: Range
    apart: float
    varying: float
    log_rate: int
    intensity: Range
    length: float
    marker_columns: int
    marker_rows: int
    jitter: float
    numerics: dict[str, Numerics]
    effects: dict[str, Strengths]
    outside: dict[str, Strengths]
    films: Filming | None = None

    def __post_init__(self) -> None:
        if not self.materials or not self.rates or not self.noises or not self.numerics:
            raise InputError(
                "materials, rates, noises or numerics are missing", where=self.title, fix="give at least one of each"
            )
        if (self.count - 1) * self.apart > self.speed.high - self.speed.low:
            raise InputError(
                f"{self.count} speeds {self.apart:g} m/s apart do not fit between {self.speed.low:g} and "
                f"{self.speed.high:g} m/s",
                where=self.title,
                fix="widen the range, or bring them nearer",
            )
        needed = {Kind.ONE: (self.effects, 1), Kind.PAIR: (self.effects, 2), Kind.OUTSIDE: (self.outside, 1)}
        for kind, (table, least) in needed.items():
            if self.composition[kind] > 0 and len(table) < least:
                raise InputError(f"too few effects for sets of kind {kind.value}", where=self.title, fix="add some")
        if not sum(self.composition.values()) > 0:
            raise InputError("every share is zero", where=self.title, fix="give a share above 0")
        cells = max(numerics.columns * numerics.rows for numerics in self.numerics.values())
        ticks = (self.settle + self.duration) * self.ticks
        for what, number, most in (
            ("markers", self.marker_columns * self.marker_rows, CELLS_LIMIT),
            ("cells of a mesh", cells, CELLS_LIMIT),
            ("instants of a recording, at the rate that all rates divide", ticks, TICKS_LIMIT),
        ):
            if number > most:
                raise LimitError(f"{number:.3g} {what}", where=self.title, fix=f"have at most {most}")

    @property
    def ticks(self) -> int:
        """A second: every frame of every rate and every sample of the log is on one [Hz]."""
        return lcm(self.log_rate, *self.rates)


def load(source: str) -> ChallengeRecipe:
    """The recipe of that name in the catalog, or of a `.toml` file.

    Raises:
        NotFoundError: no such file.
        UnknownNameError, InputError: see `parse`.
    """
    found = CHALLENGES.find(source)
    return parse(found.text, where=found.where)


def parse(text: str, *, where: str) -> ChallengeRecipe:
    """A recipe from its text.

    Raises:
        UnknownNameError: a key, material, effect or parameter that is not known.
        InputError: a value that does not fit.
    """
    from sim.effects import EFFECTS
    from tests.studies.challenge.outside import OUTSIDE

    top = Table(parsed(text, where=where), where=where)
    shares, flag, run = top.table("composition"), top.table("flag"), top.table("recordings")
    log, markers, numerics = top.table("log"), top.table("markers"), top.table("numerics")
    effects, outside, title = top.table("effects"), top.table("outside"), top.text("title", where) or where
    materials = flag.texts("materials")
    for name in materials:
        material.named(name, where=flag.where)
    films = None
    if "films" in top.names():
        films = top.table("films").record(
            Filming,
            rate=POSITIVE,
            width=Bounds(least=64),
            pixels_high=Bounds(least=64),
            view=POSITIVE,
            samples=POSITIVE,
            distance=POSITIVE,
            azimuth_sigma=NOT_NEGATIVE,
            elevation_sigma=NOT_NEGATIVE,
            distance_sigma=NOT_NEGATIVE,
            height=POSITIVE,
            weight_sigma=NOT_NEGATIVE,
        )
    top.done()
    rates = tuple(_whole(run, "rates", rate) for rate in run.numbers("rates")) if films is None else (films.rate,)
    recipe = ChallengeRecipe(
        title=title,
        films=films,
        composition={kind: shares.number(kind.value, 0.0, least=0) for kind in Kind},
        width=flag.number("width", 1.5, above=0),
        height=flag.number("height", 1.0, above=0),
        materials=materials,
        density=flag.range("density", 1.0, above=0),
        bending=flag.range("bending", 1.0, above=0),
        count=run.whole("count", 3, least=1),
        duration=run.number("duration", 10.0, above=0),
        settle=run.number("settle", 4.0, above=0),
        rates=rates,
        noises=run.numbers("noises") if films is None else (0.0,),
        speed=run.range("speed", 5.0, above=0),
        apart=run.number("apart", 0.0, least=0),
        varying=log.number("share", 0.0, least=0),
        log_rate=log.whole("rate", 10, least=1),
        intensity=log.range("intensity", 0.1, above=0),
        length=log.number("length", 40.0, above=0),
        marker_columns=markers.whole("columns", 17, least=4),
        marker_rows=markers.whole("rows", 11, least=4),
        jitter=markers.number("jitter", 0.0, least=0),
        numerics={name: _numerics(numerics.table(name)) for name in numerics.names()},
        effects=_strengths(effects, EFFECTS),
        outside=_strengths(outside, OUTSIDE),
    )
    for table in (shares, flag, run, log, markers, numerics):
        table.done()
    return recipe


def _whole(table: Table, key: str, value: float) -> int:
    if value < 1 or value != int(value):
        raise InputError(f"{key} has {value!r}", where=table.where, fix="give whole numbers of at least 1")
    return int(value)


def _numerics(table: Table) -> Numerics:
    mesh = Bounds(least=3)
    found = table.record(Numerics, columns=mesh, rows=mesh, step=NOT_NEGATIVE, thickness=NOT_NEGATIVE, damping=POSITIVE)
    if found.integrator is Method.IMPLICIT and not found.step:
        raise InputError("the implicit integrator without a step", where=table.where, fix="give step in seconds")
    if found.integrator is Method.SYMPLECTIC and found.step:
        raise InputError(
            "a step beside the symplectic integrator, which finds its own",
            where=table.where,
            fix="leave it out",
        )
    return found


def _strengths(table: Table, known: Registry) -> dict[str, Strengths]:
    found: dict[str, Strengths] = {}
    for name in table.names():
        inner = table.table(name)
        strengths: tuple[str, ...] = known[name].strengths()
        parameter = inner.named("parameter", strengths[0], strengths, noun="strength")
        values, drawn = inner.numbers("values"), inner.range("range", 1.0, above=0)
        if any(value <= 0 for value in values):
            raise InputError(
                "values has magnitudes that are not above 0", where=inner.where, fix="say by negative which sets differ"
            )
        if values and "range" in inner.names():
            raise InputError("values and a range", where=inner.where, fix="give one of them")
        found[name] = Strengths(
            parameter=parameter, range=drawn, negative=inner.number("negative", 0.0, least=0), values=values
        )
        inner.done()
    return found


def effect_type(name: str) -> Any:
    """The class of an effect, of the library or outside it."""
    from sim.effects import EFFECTS
    from tests.studies.challenge.outside import OUTSIDE

    return EFFECTS[name] if name in EFFECTS else OUTSIDE[name]
