"""Draws sequences of operations on two lakes, each killed before one of its steps or not, beside a
plain model.

The machine is that of `tests.flagdata.lake.lake_machine`, of which the tests draw a few sequences.
Here are as many as are asked for, and a table of what was tried. A sequence that shows something
else than the model is made shorter, if that is asked for, and printed as the calls that lead to it.

    python -m tests.studies state-machine --examples 500 --seed 7
"""

from __future__ import annotations

import argparse
import os
import tempfile
import uuid
from collections.abc import Iterator
from contextlib import contextmanager

from tests.flagdata.lake.lake_machine import RULES, LakeMachine, machine_of, try_machine
from tests.s3 import BUCKET, SECRETS, moto


@contextmanager
def bucket() -> Iterator[str]:
    """The address of a folder in a bucket on loopback, to which this process is directed for
    good."""
    with moto() as address, tempfile.TemporaryDirectory() as cache:
        os.environ |= {
            **SECRETS,
            "AWS_ENDPOINT_URL": address,
            "AWS_REGION": "us-east-1",
            "FLAGDATA_CACHE": cache,
        }
        yield f"s3://{BUCKET}/{uuid.uuid4().hex}"


def table() -> str:
    """What was tried: how often each operation ended in which way."""
    return "\n".join(f"{count:8} {what}" for what, count in sorted(LakeMachine.tally.items()))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--examples", type=int, default=100, help="sequences")
    parser.add_argument("--steps", type=int, default=30, help="operations of each at most")
    parser.add_argument("--seed", type=int, default=1, help="of what is drawn")
    parser.add_argument("--in-bucket", action="store_true", help="lakes in a bucket on loopback")
    parser.add_argument(
        "--among", nargs="+", choices=sorted(RULES), default=sorted(RULES), help="operations drawn"
    )
    parser.add_argument(
        "--shrink", action="store_true", help="make a sequence that shows something shorter"
    )
    options = parser.parse_args()
    drawn = {
        "examples": options.examples,
        "steps": options.steps,
        "number": options.seed,
        "shrinking": options.shrink,
    }
    try:
        if options.in_bucket:
            with bucket() as place:
                try_machine(machine_of(options.among, in_bucket=place), **drawn)
        else:
            try_machine(machine_of(options.among), **drawn)
    finally:
        print(table())  # noqa: T201
