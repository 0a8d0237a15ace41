"""Predicts published numbers of flags by the base model: `python -m tests.studies published-flags
[NAME …]`."""

from __future__ import annotations

import argparse

from flagdata.answer.markdown import table
from tests.studies.validation.real_flags.published import PUBLISHED
from tests.studies.validation.real_flags.study import Bench, judged, with_errors
from tests.studies.validation.real_flags.validate import KEEP

if __name__ == "__main__":
    names = [one.name for one in PUBLISHED]
    parser = argparse.ArgumentParser(
        description="Predict published numbers of flags by the base model."
    )
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"of {', '.join(names)}; all if none is given"
    )
    options = parser.parse_args()
    if unknown := set(options.names) - set(names):
        parser.error(f"unknown: {', '.join(sorted(unknown))}; known: {', '.join(names)}")
    base = Bench(keep=KEEP).predictions({})
    rows = [
        [
            one.name,
            of,
            f"{band[0]:.3g} to {band[1]:.3g}",
            f"{value:.3g} ± {error:.2g}",
            judged(value, error, band),
        ]
        for one in PUBLISHED
        if one.name in (options.names or names)
        for (of, band), (value, error) in zip(
            one.bands.items(), with_errors(one, base), strict=False
        )
    ]
    print(table(["name", "of", "published", "base model", ""], rows))  # noqa: T201
