"""What a challenge consists of, as TOML (`recipes` beside it). Parsed here and nowhere else;
unknown keys refused.

All values are SI. A *range* is `{ low = …, high = …, scale = "linear" | "log" }`.

    title
    [composition]     null, one, pair, outside: shares of the sets
    [flag]            width, height, materials: names; density, bending: ranges of factors on the nominal material
    [recordings]      count, duration, settle, apart [m/s]; rates, noises: dealt out evenly; speed: a range
    [designs.NAME]    material, rate, noise, in place of the flag's materials and the recordings' rates and noises: sets
                      are dealt out evenly among designs, each of which has nulls of its own;
                      weight-sigma: standard error of the stated area weight (a share), from which the true one differs
                      in place of the flag's density; intensity: a range, where the wind varies and is logged
    [log]             share: of the sets whose wind varies, 0 beside designs; rate; intensity: a range;
                      length: integral scale
    [markers]         columns, rows; jitter: as a share of the spacing; one pattern for all sets
    [films]           where it is there, sets are films in place of markers, and share their winds and what is stated of
                      the camera's place; angles in degrees. rate, width, pixels-high, view: angle of the picture's
                      longer side; samples a pixel; azimuth: of the camera's axis to the wind; elevation, upwards;
                      distance; azimuth-sigma, elevation-sigma, distance-sigma (a share): their standard uncertainty,
                      by which the true place differs; height: of the flag's middle above the ground;
                      weight-sigma: standard error of the stated area weight (a share), 0 where none is stated;
                      backgrounds: kinds that are behind the flag, see `sim.render.render_prior`
    [numerics.NAME]   columns, rows, diagonals, integrator, step, thickness: of contact, none where it is 0; damping
    [effects.NAME]    parameter, range, negative: share of the sets with the other sign; an effect of the library;
                      values: magnitudes in place of a range; sets of this effect alone have them in turn
    [outside.NAME]    the same, of `tests.studies.challenge.outside`
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from math import lcm
from pathlib import Path
from typing import Annotated, Any, TypeAlias

from msgspec import Meta

from flagdata.errors import InputError, LimitError
from flagdata.recipes import typed_tables
from flagdata.recipes.registry import Registry
from flagdata.recipes.shelves import Shelf, parse_recipe
from flagdata.recipes.typed_tables import (
    POSITIVE,
    WHOLE_LIMIT,
    Count,
    Named,
    NotNegative,
    Positive,
    Range,
)
from sim.cloth import material


class _Beside(Shelf):
    """Recipes that lie beside this module."""

    def place(self) -> Path:
        """The folder in which the recipes are."""
        return Path(__file__).parent / self.folder


CHALLENGES = _Beside(folder="recipes", noun="challenge")
CELLS_LIMIT = 100_000
"""Most cells of a mesh, and most markers."""
_Mesh: TypeAlias = Annotated[int, Meta(ge=3, le=WHOLE_LIMIT)]
_Spots: TypeAlias = Annotated[int, Meta(ge=4, le=WHOLE_LIMIT)]
_Pixels: TypeAlias = Annotated[int, Meta(ge=64, le=WHOLE_LIMIT)]
_Draw: TypeAlias = Annotated[Range, POSITIVE]
_NOMINAL, _SPEED, _INTENSITY = (Range(low=number, high=number) for number in (1.0, 5.0, 0.1))
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

    columns: _Mesh = 20
    rows: _Mesh = 14
    diagonals: Diagonals = Diagonals.ALTERNATE
    integrator: Method = Method.SYMPLECTIC
    step: NotNegative = 0.0
    thickness: NotNegative = 0.0
    damping: Annotated[Range, POSITIVE] = field(default_factory=lambda: Range(low=1e-3, high=1e-3))


@dataclass(frozen=True, kw_only=True)
class Filming:
    """How sets are filmed; attributes as in the module's description."""

    rate: Count = 25
    width: _Pixels = 320
    pixels_high: _Pixels = 240
    view: Positive = 24.0
    samples: Count = 4
    azimuth: float = 80.0
    azimuth_sigma: NotNegative = 5.0
    elevation: float = 0.0
    elevation_sigma: NotNegative = 2.0
    distance: Positive = 8.0
    distance_sigma: NotNegative = 0.02
    height: Positive = 3.0
    weight_sigma: NotNegative = 0.03
    backgrounds: tuple[str, ...] = ("sky", "hills", "foliage", "buildings")


@dataclass(frozen=True, kw_only=True)
class SetDesign:
    """What sets of one design share; attributes as in the module's description."""

    material: str
    rate: Count
    noise: NotNegative
    weight_sigma: NotNegative = 0.0
    intensity: _Draw | None = None


@dataclass(frozen=True, kw_only=True)
class Strengths:
    """Strengths at which one effect is set.

    Attributes:
        parameter: which strength is drawn; everything else stays at its usual value.
        range: of its magnitude.
        negative: share of the sets in which it is negative.
        values: magnitudes that were fixed beforehand; none where the magnitude is drawn from the
            range.
    """

    parameter: str
    range: Range
    negative: float
    values: tuple[float, ...] = ()

    def size(self, turn: int | None, uniform: float) -> float:
        """The magnitude in a set: of fixed values that whose turn it is, or any where none has;
        else from the range.

        Args:
            turn: how many sets of this effect alone come before; `None` of an effect beside
                another.
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
    designs: dict[str, SetDesign] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.materials or not self.rates or not self.noises or not self.numerics:
            raise InputError(
                "materials, rates, noises or numerics are missing",
                where=self.title,
                fix="give at least one of each",
            )
        if self.designs and (self.films is not None or self.varying):
            raise InputError(
                "designs stand beside films, or beside a share of sets whose wind varies",
                where=self.title,
                fix="give designs of tracked markers alone, each with an intensity where its wind "
                "varies",
            )
        if (self.count - 1) * self.apart > self.speed.high - self.speed.low:
            raise InputError(
                f"{self.count} speeds {self.apart:g} m/s apart do not fit between "
                f"{self.speed.low:g} and "
                f"{self.speed.high:g} m/s",
                where=self.title,
                fix="widen the range, or bring them nearer",
            )
        needed = {
            Kind.ONE: (self.effects, 1),
            Kind.PAIR: (self.effects, 2),
            Kind.OUTSIDE: (self.outside, 1),
        }
        for kind, (table, least) in needed.items():
            if self.composition[kind] > 0 and len(table) < least:
                raise InputError(
                    f"too few effects for sets of kind {kind.value}",
                    where=self.title,
                    fix="add some",
                )
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
                raise LimitError(
                    f"{number:.3g} {what}", where=self.title, fix=f"have at most {most}"
                )

    def weight_sigma(self, *, material: str, rate: int, noise: float) -> float:
        """Standard error of the area weight that is stated for sets of a design (a share); 0 where
        none is."""
        return max(
            (
                one.weight_sigma
                for one in self.designs.values()
                if (one.material, one.rate, one.noise) == (material, rate, noise)
            ),
            default=0.0,
        )

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

    form = typed_tables.read(_Form, parse_recipe(text, where=where), where=where)
    flag, log, films, inside = form.flag, form.log, form.films, f"{where} [recordings]"
    designs, materials = form.designs, flag.materials
    for name in materials:
        material.named_material(name, where=f"{where} [flag]")
    for name, own in designs.items():
        material.named_material(own.material, where=f"{where} [designs] [{name}]")
    if designs and materials:
        raise InputError(
            "designs and materials are given", where=f"{where} [flag]", fix="give one of them"
        )
    if designs:
        run = typed_tables.read(_Recordings, form.recordings, where=inside)
        materials = tuple(dict.fromkeys(own.material for own in designs.values()))
        rates = tuple(own.rate for own in designs.values())
        noises = tuple(own.noise for own in designs.values())
    elif films is None:
        run = marked = typed_tables.read(_MarkerRecordings, form.recordings, where=inside)
        rates, noises = (
            tuple(_whole("rates", rate, where=inside) for rate in marked.rates),
            marked.noises,
        )
    else:
        run = typed_tables.read(_Recordings, form.recordings, where=inside)
        rates, noises = (films.rate,), (0.0,)
    for name, numerics in form.numerics.items():
        _check(numerics, where=f"{where} [numerics] [{name}]")
    return ChallengeRecipe(
        title=form.title or where,
        films=films,
        designs=dict(designs),
        composition={kind: getattr(form.composition, kind.value) for kind in Kind},
        width=flag.width,
        height=flag.height,
        materials=materials,
        density=flag.density,
        bending=flag.bending,
        count=run.count,
        duration=run.duration,
        settle=run.settle,
        rates=rates,
        noises=noises,
        speed=run.speed,
        apart=run.apart,
        varying=log.share,
        log_rate=log.rate,
        intensity=log.intensity,
        length=log.length,
        marker_columns=form.markers.columns,
        marker_rows=form.markers.rows,
        jitter=form.markers.jitter,
        numerics=dict(form.numerics),
        effects=_strengths(form.effects, EFFECTS, where=f"{where} [effects]"),
        outside=_strengths(form.outside, OUTSIDE, where=f"{where} [outside]"),
    )


@dataclass(frozen=True, kw_only=True)
class _Form:
    """The tables of a challenge."""

    title: str = ""
    composition: _Composition
    flag: _Flag
    recordings: Mapping[str, Any]
    log: _Log
    markers: _Markers
    films: Filming | None = None
    designs: Mapping[str, SetDesign] = field(default_factory=dict)
    numerics: Mapping[str, Numerics]
    effects: Mapping[str, Mapping[str, Any]]
    outside: Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True, kw_only=True)
class _Composition:
    null: NotNegative = 0.0
    one: NotNegative = 0.0
    pair: NotNegative = 0.0
    outside: NotNegative = 0.0


@dataclass(frozen=True, kw_only=True)
class _Flag:
    width: Positive = 1.5
    height: Positive = 1.0
    materials: tuple[str, ...] = ()
    density: _Draw = _NOMINAL
    bending: _Draw = _NOMINAL


@dataclass(frozen=True, kw_only=True)
class _Recordings:
    count: Count = 3
    duration: Positive = 10.0
    settle: Positive = 4.0
    speed: _Draw = _SPEED
    apart: NotNegative = 0.0


@dataclass(frozen=True, kw_only=True)
class _MarkerRecordings(_Recordings):
    rates: tuple[float, ...] = ()
    noises: tuple[float, ...] = ()


@dataclass(frozen=True, kw_only=True)
class _Log:
    share: NotNegative = 0.0
    rate: Count = 10
    intensity: _Draw = _INTENSITY
    length: Positive = 40.0


@dataclass(frozen=True, kw_only=True)
class _Markers:
    columns: _Spots = 17
    rows: _Spots = 11
    jitter: NotNegative = 0.0


def _whole(key: str, value: float, *, where: str) -> int:
    if value < 1 or value != int(value):
        raise InputError(
            f"{key} has {value!r}", where=where, fix="give whole numbers of at least 1"
        )
    return int(value)


def _check(numerics: Numerics, *, where: str) -> None:
    if numerics.integrator is Method.IMPLICIT and not numerics.step:
        raise InputError(
            "the implicit integrator has no step", where=where, fix="give step in seconds"
        )
    if numerics.integrator is Method.SYMPLECTIC and numerics.step:
        raise InputError(
            "a step stands beside the symplectic integrator, which finds its own",
            where=where,
            fix="leave it out",
        )


def _strengths(
    effects: Mapping[str, Mapping[str, Any]], known: Registry, *, where: str
) -> dict[str, Strengths]:
    found: dict[str, Strengths] = {}
    for name, content in effects.items():
        strengths: tuple[str, ...] = known[name].strengths()
        types = {
            "parameter": Annotated[str, Named("strength", strengths)],
            "values": tuple[float, ...],
            "range": _Draw,
            "negative": NotNegative,
        }
        inside = f"{where} [{name}]"
        usual = {"parameter": strengths[0], "range": _NOMINAL, "negative": 0.0}
        made = Strengths(**{**usual, **typed_tables.entries(types, content, where=inside)})
        if any(value <= 0 for value in made.values):
            raise InputError(
                "values has magnitudes that are not above 0",
                where=inside,
                fix="say by negative which sets differ",
            )
        if made.values and "range" in content:
            raise InputError("values and a range are given", where=inside, fix="give one of them")
        found[name] = made
    return found


def effect_type(name: str) -> Any:
    """The class of an effect, of the library or outside it."""
    from sim.effects import EFFECTS
    from tests.studies.challenge.outside import OUTSIDE

    return EFFECTS[name] if name in EFFECTS else OUTSIDE[name]
