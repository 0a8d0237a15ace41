"""Bending over weight from drapes: a response surface of simulated ones, and the cloths under which
it shows the same.

Each figure of a drape is a quadratic polynomial of the logarithms of bending length and shear, of
anisotropy and of rest curvature, fitted to simulated drapes by least squares; their scatter about
it is that of the resting shapes that one cloth has. What is compared are means over drapes of one
face. A lobe of the rim has the direction of the stiffer thread, so that lobes are taken along their
common direction; the threads that the cloth curls along may be either.

Posterior draws are weighted draws of the prior, at first of all of it, then of the ranges in which
cloths were near. Evidences of models follow as mean weights.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import ClassVar

import numpy as np
from scipy.stats import chi2

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.core.rng import stream
from flagdata.errors import InputError
from flagdata.recipes.typed_tables import Range, Scale
from measure.cloth import Uncertain, draws
from measure.drape.drape_simulation import ANISOTROPY, BENDING_LENGTH, CLOTH, CURVATURE, SHEAR
from sim.run.cusick_drape import DISC, PEDESTAL

COEFFICIENT, LOBE = 0, 1
NUMERICS = (0.01, 0.004)
"""What a finer mesh changes of drape coefficient and lobe, as standard deviations: the means of
twelve drapes on meshes of 6, 9 and 12 rows differ by less."""
UNLIKE = 0.01
"""Tail probability of the misfit below which no simulated cloth drapes as the scans do, as for
films."""
WET_MASS = Uncertain(
    name="wet_mass",
    unit="1",
    prior=Range(low=0.0, high=0.5),
    source="share of the cloth's weight; moist air adds up to a tenth, a wet cloth its own weight",
    limits=(0.0, np.inf),
)
SIDEDNESS = Uncertain(
    name="sidedness",
    unit="1",
    prior=Range(low=-0.2, high=0.2),
    source="logarithm of the bending length with the first face up over that of the mean: bending "
    "by up to 3 to 1",
)
_DRAWS = 1 << 16
_ROUNDS = 2
"""How often the ranges are narrowed."""
_NEAR = 12.0
"""Logarithm of the likelihood, below the best draw's, beyond which cloths are not drawn again."""
_KEPT = 4000


class Model(StrEnum):
    """What may differ between two faces of a cloth, or be beside its bending."""

    BASE = "base"
    CURLED = "rest-curvature"
    """Its sign turns over with the cloth."""
    ALIKE = "rest-curvature not turned over"
    """The same on both faces, which no cloth can have: what the strength fits without its sign."""
    WET = "wet-mass"
    """More weight than was stated, on both faces."""
    SIDED = "bending by face"
    """Bending length that is larger with one face up and smaller with the other: of no effect in
    the library."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Face:
    """Drapes with one face of the cloth up.

    Attributes:
        shapes: (drape, 7), see `Shape.numbers`.
        specimen: (drape,) number of the piece of cloth that each is of; drapes of one are no
            independent ones.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = ("count", "drape_coefficient", "folds", "area")

    shapes: FloatArray
    specimen: IntArray

    @property
    def count(self) -> int:
        """Of drapes."""
        return len(self.specimen)

    @property
    def drape_coefficient(self) -> float:
        """Mean of the drapes."""
        return float(self.shapes[:, 0].mean())

    @property
    def folds(self) -> float:
        """Mean number."""
        return float(self.shapes[:, 4].mean())

    @property
    def area(self) -> float:
        """Mean, over that of the flat cloth."""
        return float(self.shapes[:, 6].mean())

    def of(self, specimens: Sequence[int]) -> Face:
        """Selects some pieces of cloth."""
        chosen = np.isin(self.specimen, specimens)
        return Face(shapes=self.shapes[chosen], specimen=self.specimen[chosen])

    def means(self, direction: float) -> FloatArray:
        """Computes (specimen, 2) mean drape coefficient and lobe along a direction [rad]."""
        lobe = (self.shapes[:, 1] + 1j * self.shapes[:, 2]) * np.exp(-2j * direction)
        figures = np.stack([self.shapes[:, 0], lobe.real], axis=1)
        return np.stack(
            [figures[self.specimen == number].mean(axis=0) for number in np.unique(self.specimen)]
        )

    @property
    def scatter(self) -> float:
        """Returns the standard deviation of drape coefficients about the mean of their specimen;
        NaN without repeats."""
        groups = [self.shapes[self.specimen == number, 0] for number in np.unique(self.specimen)]
        freedom = sum(len(group) - 1 for group in groups)
        squares = sum(float(np.square(group - group.mean()).sum()) for group in groups)
        return float(np.sqrt(squares / freedom)) if freedom else float("nan")

    @property
    def lost(self) -> float:
        """Returns the share of the area that the scans lack in the mean, below 0 where they have
        too much."""
        return 1 - self.area


def together(faces: Sequence[Face]) -> Face:
    """Joins drapes of both faces."""
    return Face(
        shapes=np.concatenate([face.shapes for face in faces]),
        specimen=np.concatenate([f.specimen for f in faces]),
    )


def direction_of(faces: Sequence[Face]) -> float:
    """Returns the direction of the rim's wider lobe in the flat cloth, from its u axis [rad]."""
    shapes = together(faces).shapes
    return float(np.angle(shapes[:, 1].mean() + 1j * shapes[:, 2].mean()) / 2)


@dataclass(frozen=True, kw_only=True, eq=False)
class Surface:
    """Drape coefficient and lobe as polynomials of the cloth.

    Attributes:
        coefficients: (term, 2).
        inverse: (term, term) of the normal equations.
        residual: (2,) standard deviation of one drape about it.
    """

    coefficients: FloatArray
    inverse: FloatArray
    residual: FloatArray

    @classmethod
    def fit(cls, values: Mapping[str, FloatArray], shapes: FloatArray) -> Surface:
        """Fits it to simulated drapes.

        Raises:
            InputError: fewer drapes than twice its terms.
        """
        terms = _terms(values)
        count, several = terms.shape
        if count < 2 * several:
            raise InputError(
                f"{count} simulated drapes are too few for {several} terms",
                where="drapes",
                fix=f"give {2 * several}",
            )
        inverse = np.asarray(np.linalg.inv(terms.T @ terms), dtype=np.float64)
        figures = shapes[:, [COEFFICIENT, LOBE]]
        coefficients = inverse @ terms.T @ figures
        squares = np.square(figures - terms @ coefficients).sum(axis=0)
        return cls(
            coefficients=coefficients,
            inverse=inverse,
            residual=np.sqrt(squares / (count - several)),
        )

    def at(self, values: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Computes the mean figures (cloth, 2) and the variances of these means."""
        terms = _terms(values)
        leverage = ((terms @ self.inverse) * terms).sum(axis=1)
        return terms @ self.coefficients, leverage[:, None] * self.residual**2


def _terms(values: Mapping[str, FloatArray]) -> FloatArray:
    """Computes (cloth, term): all products of up to two scaled quantities, and the cube of the
    bending length's."""
    scaled = []
    for about in CLOTH:
        low, high = about.at(np.array([0.0, 1.0]))
        column = np.asarray(values[about.name], dtype=np.float64)
        if about in (BENDING_LENGTH, SHEAR):
            low, high, column = np.log(low), np.log(high), np.log(column)
        scaled.append(2 * (column - low) / (high - low) - 1)
    x = np.stack(scaled, axis=1)
    pairs = [x[:, i] * x[:, j] for i in range(x.shape[1]) for j in range(i, x.shape[1])]
    return np.stack([np.ones(len(x)), *x.T, *pairs, x[:, 0] ** 3, x[:, 0] ** 2 * x[:, 1]], axis=1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """Cloths that drape as the scans do.

    Attributes:
        model: what was let differ.
        cloth: name → (n,) posterior draws; anisotropy of the direction of the lobes over that
            across it.
        across: (n,) whether the cloth curls across that direction.
        predicted: (n, face, 2) mean drape coefficient and lobe of each draw.
        direction: of the lobes [rad].
        evidence: logarithm.
        tail: probability of a misfit as large as that of the best cloth.
        effective: how many independent draws the weighted ones are worth (Kish 1965).
    """

    model: Model
    cloth: Mapping[str, FloatArray]
    across: BoolArray
    predicted: FloatArray
    direction: float
    evidence: float
    tail: float
    effective: float


def fit_drapes(surface: Surface, faces: Sequence[Face], *, model: Model, seed: int) -> Fit:
    """Finds the cloths that drape as scans of one face do, or of two.

    Raises:
        InputError: no face, more than two, a face of less than two specimens, or one face where
            faces are to differ.
    """
    if not 1 <= len(faces) <= 2 or any(len(np.unique(face.specimen)) < 2 for face in faces):
        raise InputError(
            f"{len(faces)} sets of drapes, the smallest of "
            f"{min((len(f.specimen) for f in faces), default=0)} pieces",
            where="drapes",
            fix="give one folder of drapes, or two for two faces, with two pieces of cloth or more "
            "in each",
        )
    direction = direction_of(faces)
    quantities = (*CLOTH, WET_MASS, SIDEDNESS)
    drawn = _weigh_draws(surface, faces, direction, model, quantities, seed=seed)
    narrowed = quantities
    for _ in range(_ROUNDS):
        near = drawn.log_weight > drawn.log_weight.max() - _NEAR
        narrowed = tuple(_narrow_range(about, drawn.values[about.name][near]) for about in narrowed)
        drawn = _weigh_draws(surface, faces, direction, model, narrowed, seed=seed)
    volume = sum(
        _log_share(about, within) for about, within in zip(quantities, narrowed, strict=True)
    )
    best = drawn.log_weight.max()
    weight = np.exp(drawn.log_weight - best)
    chosen = stream(seed, "drape", "resample").choice(_DRAWS, _KEPT, p=weight / weight.sum())
    cloth = {name: column[chosen] for name, column in drawn.values.items()}
    cloth[ANISOTROPY.name] = np.where(drawn.across[chosen], -1.0, 1.0) * cloth[ANISOTROPY.name]
    return Fit(
        model=model,
        cloth=cloth,
        across=drawn.across[chosen],
        predicted=drawn.predicted[chosen],
        direction=direction,
        evidence=float(best + np.log(weight.mean())) + volume,
        tail=float(chi2.sf(drawn.misfit.min(), 2 * len(faces))),
        effective=float(weight.sum() ** 2 / np.square(weight).sum()),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Weighed:
    """Draws of cloths and how well they drape as the scans do.

    Attributes:
        values: name → (n,), with anisotropy of the thread that the cloth curls along over the
            other.
        across: (n,) whether it curls across the lobes' direction.
        predicted: (n, face, 2).
        log_weight: (n,) logarithms of their likelihood.
        misfit: (n,) χ².
    """

    values: Mapping[str, FloatArray]
    across: BoolArray
    predicted: FloatArray
    log_weight: FloatArray
    misfit: FloatArray


def _weigh_draws(
    surface: Surface,
    faces: Sequence[Face],
    direction: float,
    model: Model,
    quantities: tuple[Uncertain, ...],
    *,
    seed: int,
) -> _Weighed:
    values = draws(quantities, _DRAWS, seed=seed, name=f"drape fit {model.value}")
    # The lobe has the direction of the stiffer thread; the cloth curls along it or across it.
    across = stream(seed, "drape", "thread").random(_DRAWS) < 0.5
    predicted, deviation = np.empty((2, _DRAWS, len(faces), 2))
    measured, repeats = np.empty((2, len(faces), 2))
    lost = np.zeros((len(faces), 2))
    for number, face in enumerate(faces):
        figures, variance = surface.at(_of_face(values, model, number))
        figures[:, LOBE] = np.where(across, -figures[:, LOBE], figures[:, LOBE])
        means = face.means(direction)
        measured[number], repeats[number] = (
            means.mean(axis=0),
            means.var(axis=0, ddof=1) / len(means),
        )
        lost[number, COEFFICIENT] = (
            face.lost * DISC**2 / (DISC**2 - PEDESTAL**2) * measured[number, COEFFICIENT]
        )
        predicted[:, number], deviation[:, number] = figures, np.sqrt(variance)
    misfit, determinant = np.zeros((2, _DRAWS))
    for figure in (COEFFICIENT, LOBE):
        # The surface, the mesh and lost area err alike on both faces; repeats do not.
        alike = deviation[:, :, figure]
        covariance = alike[:, :, None] * alike[:, None, :] + NUMERICS[figure] ** 2
        covariance = (
            covariance + np.outer(lost[:, figure], lost[:, figure]) + np.diag(repeats[:, figure])
        )
        apart = (measured - predicted)[:, :, figure, None]
        misfit += (apart * np.linalg.solve(covariance, apart)).sum(axis=(1, 2))
        determinant += np.linalg.slogdet(2 * np.pi * covariance)[1]
    log_weight = -(misfit + determinant) / 2
    return _Weighed(
        values=values, across=across, predicted=predicted, log_weight=log_weight, misfit=misfit
    )


def _narrow_range(about: Uncertain, near: FloatArray) -> Uncertain:
    """Returns a quantity within the range of draws that are not too far off."""
    if not isinstance(about.prior, Range):
        return about
    low, high = float(near.min()), float(near.max())
    if low == high:
        return about
    return replace(about, prior=replace(about.prior, low=low, high=high))


def _log_share(about: Uncertain, within: Uncertain) -> float:
    """Computes the logarithm of the share of a range that a narrower one is."""
    whole, part = (np.array(one.ends or (0.0, 1.0)) for one in (about, within))
    if isinstance(about.prior, Range) and about.prior.scale is Scale.LOG:
        whole, part = np.log(whole), np.log(part)
    return float(np.log(np.diff(part) / np.diff(whole))[0])


def _of_face(
    prior: Mapping[str, FloatArray], model: Model, number: int
) -> Mapping[str, FloatArray]:
    """Returns the cloths as they drape with a face up: 0 the first, 1 the other."""
    values = dict(prior)
    sign = {Model.CURLED: (1.0, -1.0), Model.ALIKE: (1.0, 1.0)}.get(model, (0.0, 0.0))[number]
    values[CURVATURE.name] = sign * prior[CURVATURE.name]
    if model is Model.WET:
        values[BENDING_LENGTH.name] = prior[BENDING_LENGTH.name] / np.cbrt(1 + prior[WET_MASS.name])
    if model is Model.SIDED:
        values[BENDING_LENGTH.name] = prior[BENDING_LENGTH.name] * np.exp(
            (1 - 2 * number) * prior[SIDEDNESS.name]
        )
    return values
