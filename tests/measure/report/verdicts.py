"""Made-up verdicts of every kind: shapes as a real one has, numbers from plain formulas and a fixed
seed."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from flagdata.answer import Quantity
from measure.verdict import (
    Candidate,
    Comparison,
    Conclusion,
    NullTest,
    Parameter,
    Residual,
    Verdict,
)

EFFECTS = (
    "lift",
    "shear",
    "tangential-linear-drag",
    "internal-damping",
    "pole-wake",
    "hem-mass",
    "corrective-field",
)


def changed(one: Quantity, **ends: float) -> Quantity:
    """The same with another value or another end."""
    given = {"value": one.point, "low": one.low, "high": one.high, **ends}
    return Quantity.of(
        given["value"],
        given["low"],
        given["high"],
        unit=one.unit,
        level=one.level,
        bound=one.bound,
    )


def about(value: float, half: float, unit: str = "m") -> Quantity:
    return Quantity.of(value=value, low=value - half, high=value + half, unit=unit)


@dataclass(frozen=True, kw_only=True)
class Size:
    """How much a recording holds."""

    across: int = 9
    up: int = 6
    frames: int = 100
    stretch: int = 10


FULL = Size(across=15, up=10, frames=250, stretch=50)


def residual(
    name: str, speed: float, *, held_out: bool, with_after: bool, seed: int, size_of: Size
) -> Residual:
    """A flag of 1.2 × 0.8 m with a travelling wave."""
    rng = np.random.default_rng(seed)
    u, v = (
        a.ravel()
        for a in np.meshgrid(np.linspace(0, 1.2, size_of.across), np.linspace(0, 0.8, size_of.up))
    )
    frames = size_of.frames
    times = np.arange(frames) / 25
    size = 0.003 * (speed / 5) * (0.4 + u / 1.2)
    stretch = times[: size_of.stretch, None]
    shape = np.stack(
        [u + 0 * stretch, 0.12 * u * np.sin(5 * u - 9 * stretch), v - 0.1 * u**2 + 0 * stretch],
        axis=-1,
    )
    wobble = rng.normal(size=shape.shape)
    frequencies = np.fft.rfftfreq(128, 1 / 25)
    power = 1e-5 / (1 + frequencies**2) + 2e-6 * np.exp(-((frequencies - 3) ** 2))
    return Residual(
        recording=name,
        speed=speed,
        held_out=held_out,
        times=times.tolist(),
        in_time=(0.003 * speed / 5 * (1 + 0.3 * np.abs(rng.normal(size=frames)))).tolist(),
        in_time_after=(0.0012 * (1 + 0.3 * np.abs(rng.normal(size=frames)))).tolist()
        if with_after
        else [],
        markers=np.stack([u, v], axis=1).tolist(),
        in_space=size.tolist(),
        in_space_after=(0.4 * size[::-1]).tolist() if with_after else [],
        mean=np.stack([0.2 * size, -0.6 * size * np.sin(4 * v), 0.3 * size], axis=1).tolist(),
        frequencies=frequencies.tolist(),
        spectrum=power.tolist(),
        spectrum_after=(0.2 * power).tolist() if with_after else [],
        observed=shape.tolist(),
        before=(shape + size[:, None] * wobble).tolist(),
        after=(shape + 0.4 * size[:, None] * wobble).tolist() if with_after else [],
    )


def candidates(named: tuple[str, ...], recordings: int) -> tuple[Candidate, ...]:
    units = ("1", "1", "kg/(m² s)", "s", "1", "kg/m", "N")
    ranked = []
    for place, (effect, unit) in enumerate(zip(EFFECTS, units, strict=True)):
        value = (0.62, -0.11, 0.0231, 0.004, 0.3, 1.7e-5, 0.018)[place]
        spread = (0.08, 0.14, 0.004, 0.003, 0.5, 2.1e-5, 0.004)[place]
        ranked.append(
            Candidate(
                effect=effect,
                parameter="coefficient",
                strength=about(value, spread, unit),
                z=12.3 - 2.7 * place,
                p_value=min(1.0, 0.005 * 2**place),
                p_family=min(1.0, 0.005 * 3**place),
                gain=120.0 - 31.5 * place,
                gain_error=14.2,
                behind=1.9 * place,
                leftover=max(0.005, 0.41 - 0.1 * place),
                by_recording=tuple(
                    about(value * (1 + 0.1 * n), 1.6 * spread * (1 + n / 3), unit)
                    for n in range(recordings)
                ),
                heterogeneity=0.83 if recordings > 1 else None,
                why_not=""
                if effect in named
                else f"held-out error {1.9 * place:.1f} standard errors behind the best",
            )
        )
    return tuple(ranked)


def comparison(what: str, before: float, *, with_after: bool) -> Comparison:
    missing = Quantity.of(value=math.nan, low=math.nan, high=math.nan, unit="m")
    after = 0.4 * before
    return Comparison(
        what=what,
        frames=250,
        before=about(before, 0.00021),
        after=about(after, 0.00011) if with_after else missing,
        reduction=about(before - after, 0.00017) if with_after else missing,
        floor=about(0.00081, 0.00004),
        share=0.94 if with_after else None,
        control=about(0.93 * before, 0.0002) if with_after else None,
        control_name="tangential-linear-drag" if with_after else "",
        apart=about(2.4, 0.9, unit="1") if with_after else None,
    )


def verdict(conclusion: Conclusion, size: Size = Size()) -> Verdict:
    """Of the kind asked for, on three recordings."""
    rng = np.random.default_rng(4)
    untested = conclusion is Conclusion.UNTESTED
    sufficient = untested or conclusion in (Conclusion.SUFFICIENT, Conclusion.UNDECIDED)
    named = {
        Conclusion.UNTESTED: (),
        Conclusion.SUFFICIENT: (),
        Conclusion.UNDECIDED: (),
        Conclusion.EFFECT: ("lift",),
        Conclusion.ONE_OF: ("lift", "shear"),
        Conclusion.PARTLY: ("lift",),
        Conclusion.OUTSIDE: (),
    }[conclusion]
    null = rng.lognormal(0.0, 0.3, size=199)
    statistic = 1.13 if sufficient else 41.27 if conclusion is Conclusion.EFFECT else 2.61
    p = (1 + int((null >= statistic).sum())) / 200
    names = (
        ("tunnel 4.0 m/s", 4.0, False),
        ("tunnel 5.5 m/s", 5.5, False),
        ("tunnel 7.0 m/s", 7.0, True),
    )
    return Verdict(
        conclusion=conclusion,
        named=named,
        words={
            Conclusion.UNTESTED: "The base model cannot be tested at a level of 0.01 by 20 kinds "
            "of numerics.",
            Conclusion.SUFFICIENT: "With its parameters calibrated, the base model predicts all "
            "three recordings as "
            "well as it predicts data simulated from itself.",
            Conclusion.UNDECIDED: "The base model is not rejected, and not shown to suffice.",
            Conclusion.EFFECT: "The air pushes sideways where the base model has only drag: with "
            "lift of coefficient "
            "0.62 the model predicts an unseen wind speed as well as it predicts itself.",
            Conclusion.ONE_OF: "Something that grows across the hoist is missing. Lift and shear "
            "predict unseen data "
            "equally well, within one standard error.",
            Conclusion.PARTLY: "Lift removes most of the error, but what is left is still larger "
            "than in nulls.",
            Conclusion.OUTSIDE: "No effect of the library reduces the error on unseen data by more "
            "than the "
            "control does.",
        }[conclusion],
        test=NullTest(
            statistic=statistic,
            null=null.tolist(),
            p_value=Quantity.of(value=p, low=0.5 * p, high=min(2.5 * p, 1.0), unit="1"),
            kinds=20 if untested else 199,
            level=0.01,
            critical=None if untested else float(np.sort(null)[-2]),
            nulls="199 simulations at parameters drawn from the posterior, with half the step and "
            "a finer mesh.",
        ),
        parameters=(
            Parameter(
                name="dynamic-pressure scale",
                before=about(0.91, 0.03, "1"),
                after=None if sufficient else about(0.98, 0.03, "1"),
                shift=None if sufficient else 3.4,
            ),
            Parameter(
                name="bending scale",
                before=about(1.4, 0.5, "1"),
                after=None if sufficient else about(1.2, 0.4, "1"),
                shift=None if sufficient else -0.6,
            ),
            Parameter(
                name="internal damping",
                before=about(0.0021, 0.0004, "s"),
                after=None if sufficient else about(0.0019, 0.0004, "s"),
                shift=None if sufficient else -0.7,
            ),
        ),
        ranking=candidates(named, 3),
        comparisons=tuple(
            comparison(what, before, with_after=not sufficient)
            for what, before in (
                ("tunnel 7.0 m/s, unseen", 0.0042),
                ("last part of tunnel 5.5 m/s", 0.0033),
            )
        ),
        residuals=tuple(
            residual(
                name, speed, held_out=held_out, with_after=not sufficient, seed=n, size_of=size
            )
            for n, (name, speed, held_out) in enumerate(names)
        ),
        assumptions=(
            "The pole is rigid and upright.",
            "Density of air 1.2 kg/m³, from the log's temperature.",
        ),
        separating="Fly the flag at half its height: shear halves, lift stays; 10 s at 7 m/s "
        "separate them by 4 σ."
        if conclusion is Conclusion.ONE_OF
        else "",
        proposal="The corrective field is tangential and grows as the square of the distance from "
        "the pole: f = k u² t."
        if conclusion in (Conclusion.OUTSIDE, Conclusion.PARTLY)
        else "",
        open=("the observables depart too far",) if conclusion is Conclusion.UNDECIDED else (),
        findings=(
            (
                "few-frames",
                "tunnel 4.0 m/s has 250 frames; 3 markers were filled over gaps of 2 frames.",
            ),
        ),
        unweighed=(("slack", "it needs films: attachments lie farther out by it"),),
        copied=(("wet-mass", "done as well by the area weight, as far as not stated"),),
        provenance={
            "seed": 17,
            "code": "0.1.0+abc1234",
            "parents": ["3f2a", "91bc"],
            "recipe": {"hash": "77aa"},
        },
        seconds=213.4,
    )


def with_holes(whole: Verdict) -> Verdict:
    """The same with what measurement leaves out: lost markers, candidates that could not be
    weighed."""
    nan = math.nan
    first, *others = whole.residuals
    lost = replace(
        first,
        in_space=[nan, *first.in_space[1:]],
        in_time=[*first.in_time[:40], *[nan] * 20, *first.in_time[60:]],
        mean=[[nan, nan, nan], *first.mean[1:]],
        speed=nan,
        observed=[[[nan, nan, nan], *frame[1:]] for frame in first.observed],
    )
    best, *rest = whole.ranking
    unweighed = replace(
        rest[-1],
        strength=Quantity.of(value=nan, low=nan, high=nan, unit="N"),
        z=nan,
        p_value=nan,
        p_family=nan,
        gain=nan,
        gain_error=nan,
        behind=nan,
        leftover=nan,
        by_recording=(),
    )
    open_ended = replace(best, strength=changed(best.strength, high=math.inf))
    return replace(whole, residuals=(lost, *others), ranking=(open_ended, *rest[:-1], unweighed))
