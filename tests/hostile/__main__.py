"""A class of the campaign in this process; `tests.hostile.campaign.campaign` starts it."""

from __future__ import annotations

import argparse
from importlib import import_module
from pathlib import Path

from tests.hostile import KINDS
from tests.hostile.campaign import run

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    subjects = import_module(f"tests.hostile.{options.kind}").subjects()
    run(subjects, count=options.count, start=options.seed, out=options.out)
