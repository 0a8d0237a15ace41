"""All thresholds that a verdict depends on, in one frozen object that every verdict records with its hash.

What is simulated and how errors are brought down to numbers is the method, in its modules. What is decided by comparing
two numbers is here, each with what it was taken from. Changing one changes the hash.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from scipy.stats import norm

from flagdata.errors import UsageError
from flagdata.provenance import recipe_hash


@dataclass(frozen=True, kw_only=True)
class Criteria:
    """Thresholds of closing the loop.

    Attributes:
        level: of the global test: the base model is rejected at p ≤ level.
        interval: level of all intervals.
        tail: share of the null groups beyond which chances are those of an exponential tail.
        fewest_nulls: null recordings below which no test at 2 % can be held.
        fewest_kinds: kinds of numerics below which their spread cannot be told.
        simulated_kinds: kinds of numerics that are simulated at least where no bank is given.
        alike_noise: difference of the markers' noise up to which nulls stand for the data [m]: it moves statistics
            little beside the 20 mm that meshes do.
        refitted: candidates that are refitted, of each of two orders (held-out gain, statistic).
        lead: standard errors of the paired difference by which the named effect must lead.
        tied: standard errors within which held-out gains say nothing.
        rival: a rival whose squared z is lower by more than the square of this fits worse, whatever its held-out gain.
        plausible: a strength more than so many times what is expected of it, beyond its error, is not physical.
        field: a corrective field whose statistic is larger by this factor says that the library has no answer.
        usual: an effect is not named if in so large a share of the nulls some column is as far. Of 26 effects that were
            named rightly in two challenges it was 0.19 at most; of a null's and two of what is not in the library 0.39
            to 0.8.
        enough: level at which a larger model is rejected, if the base model's is not lower: nulls say what numerics do
            to the base model, and somewhat less than what they do to one with an effect. In three challenges effects
            that were named rightly left p = 0.021 or more, one of two 0.012 or less.
        enough_gusts: the same where a pressure that is free in every segment stands for gusts, whose other parts are
            left: of eight true ones it had p = 0.009 to 0.84.
        heterogeneous: level at which a strength is found to differ between recordings (Cochran's Q).
        taken: share of a line's power, of the moments' misfit, or of a swing of the wind's course, that an effect takes
            away if these are its own: of the flutter that a lift of 1.9 had left it took 0.4, of a vortex street's
            lines no effect takes more than 0.03; of their own moments lifts and reactive loads took 0.42 to 0.54, and
            left what the mesh does to them, a drag that a turning pole passed for took none.
        response: relative standard error of a strength by what the fit's mesh does to an effect, which nulls do not
            show: strengths of 22 effects that were named rightly in two challenges scattered by so much beyond their
            errors.
        least_turned: a wind that varies across its mean by less than this share of what it does along it is not
            turbulence (see `course`).
        most_within: nor is one whose variance within two seconds is more than so many times that between stretches.
        room: share of the squared error before that must lie above the floor, for a reduction to be a share of it.
        never_second: effects that are not named beside another: they show at the attachments, whose observed places are
            the model's.

    Raises:
        UsageError: a level or share that is not between 0 and 1.
    """

    level: float = 0.03
    interval: float = 0.9
    tail: float = 0.1
    fewest_nulls: int = 24
    fewest_kinds: int = 4
    simulated_kinds: int = 20
    alike_noise: float = 1.5e-3
    refitted: int = 2
    lead: float = 2.0
    tied: float = 1.0
    rival: float = 3.0
    plausible: float = 3.0
    field: float = 1.5
    usual: float = 0.25
    enough: float = 0.015
    enough_gusts: float = 0.005
    heterogeneous: float = 0.02
    taken: float = 0.25
    response: float = 0.25
    least_turned: float = 0.3
    most_within: float = 2.0
    room: float = 0.02
    never_second: tuple[str, ...] = ("tilted-pole",)

    def __post_init__(self) -> None:
        for name in ("level", "interval", "tail", "usual", "enough", "enough_gusts", "heterogeneous", "taken", "room"):
            value = getattr(self, name)
            if not 0 < value < 1:
                raise UsageError(f"a {name} of {value!r}", where="criteria", fix="give one between 0 and 1")

    @property
    def reach(self) -> float:
        """Standard errors to either side of an interval."""
        return float(norm.ppf(0.5 + self.interval / 2))

    @property
    def hash(self) -> str:
        """SHA-256 of all of them, hex."""
        return recipe_hash(self._plain())

    def as_dict(self) -> dict[str, Any]:
        """JSON values, with their hash."""
        return {**self._plain(), "hash": self.hash}

    def _plain(self) -> dict[str, Any]:
        return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}


CRITERIA = Criteria()
"""Those that verdicts are made by; the level of the global test may be given with the options."""
