"""All thresholds that a verdict depends on, in one frozen object that every verdict records with
its hash.

What is simulated and how errors are brought down to numbers is the method, in its modules. What is
decided by comparing two numbers is here, each with what it was taken from. Changing one changes the
hash.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import ClassVar

from scipy.stats import norm

from flagdata.core.provenance import recipe_hash
from flagdata.errors import UsageError
from flagdata.recipes.retired_names import hashed_names


@dataclass(frozen=True, kw_only=True)
class Criteria:
    """Thresholds of closing the loop.

    Attributes:
        level: of the global test, and of the same test of what a model with effects leaves:
            rejected at p ≤ level.
        interval: level of all intervals.
        fewest_kinds: kinds of numerics below which their spread cannot be estimated.
        simulated_kinds: kinds of numerics that are simulated at least where no bank is given,
            before the base model is rejected. A level of 0.05 can be tested by 19; of 40, one kind
            whose groups are all as far does not save the base model.
        first_kinds: kinds after which no more are simulated where the interval of p lies above the
            level: what twenty leave open is decided by twice as many. Rejecting needs all of
            `simulated_kinds`, so that the level holds.
        alike_noise: difference of the markers' noise up to which nulls stand for the data [m]: it
            moves statistics little beside the 20 mm that meshes do.
        refitted: candidates that are refitted at least, of each of two orders (held-out gain,
            statistic); all that are in the confidence set are.
        lead: standard errors of the paired difference of held-out scores by which a model must be
            behind to leave the confidence set, and by which one must lead a model that it contains.
        strength_factor: standard deviation of the logarithm of a strength by what the fit's mesh
            and a mistold cloth do to an effect, which nulls do not show: the root mean square of
            ln(reported/true) of eight strengths that were named rightly (decision 030).
        least_turned: a wind that varies across its mean by less than this share of what it does
            along it is not turbulence (see `course`).
        least_obstructed: one that certainly varies across its mean by less than this share varies
            along itself alone, as a fan makes it: passing obstacles turn it by 0.15 to 0.23
            (decision 012).
        most_within: nor is one whose variance within two seconds is more than so many times that
            between stretches.
        area_weight_between: standard deviation of the logarithm of the area weight by which
            simulators of other authors differ; this and the next two are of twenty nulls of MuJoCo
            (decision 023).
        bending_between: the same of the bending stiffness.
        damping_between: standard deviation of the internal damping by which they differ [s].
        damping_factor: standard deviation of the logarithm of the internal damping by which a fit
            that begins at 2.5 ms ends elsewhere than at that of a cloth that is damped more
            (decision 029).
        near: factor of the level within which p lets more nulls be simulated: of 40 kinds, p is
            decided by one at 2/41.
        room: share of the squared error before that must lie above the floor, for a reduction to be
            a share of it.
        film_kinds: kinds of numerics of eight flags each that are simulated for films, which are
            counted by flags: 160 of them put p of 5 % at the eighth farthest.
        borderline: factor of the level within which p of a base model that is not rejected leaves
            it undecided; this and the next two were fixed on 2026-11-28, before any verdict was
            made by them.
        departure: root mean square departure of observables from the base model fitted to them, in
            their scatters, above which it is not said to suffice.
        least_power: mean chance of seeing an effect of its expected strength below which a base
            model that is not rejected is not said to suffice.
        course_share: of the level, for the test of the wind's course: gusts have no direction.
        passing: p of the directed test, with a named effect free, at or below which another effect
            of the library acts beside it; where kinds are too few to show it, the least p.
        alike_scores: deviations between directed scores within which recordings do not separate
            effects: the true one was within it in 55 of 57 sets, among 1.5 on average.
        errs: floors by which an observable has to err at most on unseen data, for a model to be
            said to explain it.

    Raises:
        UsageError: a level or share that is not between 0 and 1.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = ()

    level: float = 0.05
    interval: float = 0.9
    fewest_kinds: int = 4
    simulated_kinds: int = 40
    first_kinds: int = 20
    alike_noise: float = 1.5e-3
    refitted: int = 2
    lead: float = 2.0
    strength_factor: float = 0.5
    least_turned: float = 0.3
    least_obstructed: float = 0.15
    most_within: float = 2.0
    area_weight_between: float = 0.07
    bending_between: float = 0.6
    damping_between: float = 2.4e-3
    damping_factor: float = 1.1
    near: float = 2.0
    room: float = 0.02
    film_kinds: int = 20
    borderline: float = 2.0
    departure: float = 2.0
    least_power: float = 0.3
    course_share: float = 0.2
    passing: float = 0.01
    alike_scores: float = 1.0
    errs: float = 3.0

    def __post_init__(self) -> None:
        for name in ("level", "interval", "strength_factor", "room", "least_power"):
            value = getattr(self, name)
            if not 0 < value < 1:
                raise UsageError(
                    f"{name} is {value!r}", where="criteria", fix="give one between 0 and 1"
                )

    @property
    def reach(self) -> float:
        """Standard errors to either side of an interval."""
        return float(norm.ppf(0.5 + self.interval / 2))

    @property
    def hash(self) -> str:
        """SHA-256 of all of them, hex."""
        return recipe_hash(hashed_names(asdict(self)))


Criteria.JSON_NAMES = (*(one.name for one in fields(Criteria)), "hash")


CRITERIA = Criteria()
"""Those that verdicts are made by; the level of the global test may be given with the options."""
