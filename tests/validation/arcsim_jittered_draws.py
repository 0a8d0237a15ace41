"""How far verdicts depend on which kinds of numerics the nulls happen to be of: many smaller draws from a large bank.

The base model is fitted once, by the whole bank. For each draw of some of its kinds, without replacement, everything
that is learnt from nulls is learnt anew: the null model, what is usual of a statistic, and p. Draws from one bank have
kinds in common, of 40 of 120 a third, so that draws made anew differ by somewhat more: the variance of a mean over
kinds by a factor of 1/(1 − 40/120) = 1.5.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from flagdata.rng import stream
from measure.forecasting.regressors import names
from measure.forecasting.setting import Setting
from measure.inference.evidence import Evidence
from measure.inference.whitened_misfit import WhitenedMisfit
from measure.loop.run import fitted_base
from measure.nulls.reference import NullBank, Reference
from measure.observe.trajectory import Experiment
from measure.verdict.criteria import CRITERIA

_DRAWS = 50
_ENDS = (0.05, 0.95)
"""Quantiles between which nine draws of ten lie."""


def by_draws(
    experiments: Mapping[str, Experiment], bank: NullBank, *, kinds: Sequence[int], seed: int
) -> dict[str, dict[str, Any]]:
    """Experiment → p by all kinds of a bank with its interval, and by draws of so many kinds each."""
    fitted = {name: fitted_base(Setting.of(own), bank) for name, own in experiments.items()}
    told = {name: _whole(setting, fits.whitened, bank, seed) for name, (setting, fits) in fitted.items()}
    rng, known = stream(seed, "arcsim-jittered", "draws"), np.unique(bank.nulls.numerics)
    for count in kinds:
        drawn: dict[str, list[float]] = {name: [] for name in experiments}
        for _ in range(_DRAWS):
            chosen = np.isin(bank.nulls.numerics, rng.choice(known, count, replace=False))
            part = replace(bank, nulls=bank.nulls.select(chosen))
            for name, (setting, fits) in fitted.items():
                reference, statistic = _tested(setting, fits.whitened, part, seed)
                drawn[name].append(reference.conformal.p(statistic))
        for name, p in drawn.items():
            told[name]["draws"].append(_spread(np.array(p), count))
    return told


def _tested(setting: Setting, whitened: WhitenedMisfit, bank: NullBank, seed: int) -> tuple[Reference, float]:
    """Null distributions by a bank, and the statistic of the global test by them."""
    null = bank.model(setting.design).under(setting.prior)
    reference = bank.reference(len(setting.segments), noise=setting.design.noise, seed=seed, prior=setting.prior).at(
        setting.calibration
    )
    evidence = Evidence.of(whitened.found, whitened.speeds, null)
    return reference, reference.farthest(evidence, names())


def _whole(setting: Setting, whitened: WhitenedMisfit, bank: NullBank, seed: int) -> dict[str, Any]:
    reference, statistic = _tested(setting, whitened, bank, seed)
    test = reference.conformal
    low, high = test.interval(statistic, level=CRITERIA.interval)
    settling = test.settling(statistic, at=CRITERIA.level, level=CRITERIA.interval)
    return {
        "kinds": test.count, "statistic": statistic, "p": test.p(statistic), "p low": low, "p high": high,
        "settling": settling, "draws": [],
    }  # fmt: skip


def _spread(p: np.ndarray[Any, np.dtype[np.float64]], kinds: int) -> dict[str, Any]:
    low, high = np.quantile(p, _ENDS)
    return {
        "kinds": kinds, "count": len(p), "rejected": float(np.mean(p <= CRITERIA.level)), "median": float(np.median(p)),
        "low": float(low), "high": float(high),
    }  # fmt: skip


def page_of_all(told: Mapping[str, Any], *, heading: str) -> list[str]:
    """Lines of the page: p by all draws, beside the verdicts, and what smaller draws say."""
    first = next(iter(told.values()))
    whole = (
        f"p by the {first['kinds']} kinds of all draws, a figure beside the verdicts, which are by one draw each; and "
        f"how many kinds would settle whether it is below {CRITERIA.level:g}, if the same share of them is as far."
    )
    parts = (
        "By smaller draws from these kinds: the share of draws that reject the base model, the median of p, and what "
        "nine of ten of them lie between."
    )
    lines = [
        f"## {heading}", "", whole, "", "| what acted | statistic | p | settled by |", "|---|---|---|---|"
    ]  # fmt: skip
    for name, own in told.items():
        settled = "more than 1,000 kinds" if own["settling"] is None else f"{own['settling']} kinds"
        p = f"{own['p']:.3f} [{own['p low']:.3f}, {own['p high']:.3f}]"
        lines.append(f"| {name} | {own['statistic']:.2f} | {p} | {settled} |")
    heads = [f"{part['kinds']} kinds" for part in first["draws"]]
    lines += ["", parts, "", f"| what acted | {' | '.join(heads)} |", "|---" * (1 + len(heads)) + "|"]
    for name, own in told.items():
        spread = [
            f"{100 * part['rejected']:.0f} %, {part['median']:.3f} [{part['low']:.3f}, {part['high']:.3f}]"
            for part in own["draws"]
        ]
        lines.append(f"| {name} | {' | '.join(spread)} |")
    return [*lines, ""]
