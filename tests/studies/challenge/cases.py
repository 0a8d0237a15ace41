"""Keys and filings made by hand, and a challenge small enough to simulate in a second."""

from __future__ import annotations

from typing import Any

from flagdata.answer import Quantity
from measure.verdict import Candidate, Comparison, Conclusion, NullTest, Verdict
from tests.studies.challenge.answer_key import Acting, AnswerKey
from tests.studies.challenge.filing import Filing, verdict_json
from tests.studies.challenge.recipe import Kind

TINY = """
title = "tiny"
[composition]
null = 0.25
one = 0.25
pair = 0.25
outside = 0.25
[flag]
materials = ["camel-ponte-roma"]
density = { low = 0.8, high = 1.25, scale = "log" }
bending = { low = 0.3, high = 3.0, scale = "log" }
[recordings]
count = 2
duration = 0.2
settle = 0.2
rates = [25, 60]
noises = [0.0, 0.001]
speed = { low = 3.0, high = 8.0 }
apart = 1.5
[log]
share = 0.5
rate = 10
intensity = { low = 0.05, high = 0.1 }
[markers]
columns = 6
rows = 5
jitter = 0.2
[numerics.only]
columns = 6
rows = 4
diagonals = "forward"
[effects.lift]
range = 1.0
[effects.shear]
range = 0.4
[outside.tether]
parameter = "stiffness"
range = 5.0
"""


def acting(effect: str, value: float = 1.0, parameter: str = "coefficient") -> Acting:
    return Acting(effect=effect, parameter=parameter, value=value, unit="1")


def key(
    name: str,
    kind: Kind,
    *effects: Acting,
    impact: float = 0.01,
    noise: float = 0.001,
    rate: int = 25,
) -> AnswerKey:
    return AnswerKey(
        name=name,
        kind=kind,
        effects=effects,
        impact=impact if effects else 0.0,
        material="camel-ponte-roma",
        density=1.0,
        bending=1.0,
        damping=1e-3,
        speeds=(3.0, 5.0, 7.0),
        toward=0.0,
        heading=0.0,
        intensity=0.0,
        rate=rate,
        noise=noise,
        numerics="only",
    )


def estimate(value: float, half: float = 0.1) -> Quantity:
    return Quantity.of(value=value, low=value - half, high=value + half, unit="1")


def candidate(effect: str, *, strength: float = 1.0, half: float = 0.1) -> Candidate:
    return Candidate(
        effect=effect,
        parameter="coefficient",
        strength=estimate(strength, half),
        z=5.0,
        p_value=0.001,
        p_family=0.01,
        gain=10.0,
        gain_error=1.0,
        behind=0.0,
        leftover=0.5,
    )


def comparison(
    *, share: float | None = 0.9, after: float = 1e-3, control: float | None = 4e-3
) -> Comparison:
    """Errors in metres; the reduction's interval is 1 mm to either side."""
    return Comparison(
        what="unseen",
        frames=100,
        before=estimate(5e-3, 1e-3),
        after=estimate(after, 1e-3),
        reduction=estimate(5e-3 - after, 1e-3),
        floor=estimate(5e-4, 1e-4),
        share=share,
        control=None if control is None else estimate(control, 1e-3),
        control_name="another",
        apart=None if control is None else estimate(control - after, 1e-3),
    )


def verdict(conclusion: Conclusion, *named: str, **options: Any) -> Verdict:
    return Verdict(
        conclusion=conclusion,
        named=named,
        words="",
        parameters=(),
        test=NullTest(
            statistic=1.0,
            null=[],
            p_value=estimate(0.5),
            kinds=40,
            level=0.05,
            critical=None,
            nulls="",
        ),
        ranking=options.get("ranking", tuple(candidate(name) for name in named)),
        comparisons=options.get("comparisons", (comparison(),) if named else ()),
        residuals=(),
        apart=options.get("apart", estimate(1.0, 0.5) if named else None),
    )


def filing(name: str, said: Verdict | None, *, seconds: float = 1.0) -> Filing:
    return Filing(
        name=name,
        data="",
        seed=1,
        verdict=None if said is None else verdict_json(said),
        refusal=None
        if said is not None
        else {"kind": "bad-input", "what": "", "where": None, "fix": ""},
        seconds=seconds,
    )
