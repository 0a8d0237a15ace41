"""Simulates a recipe into a lake, in a process of its own that may be killed.

    python simulate_worker.py LAKE RECIPE [MEMBERS]

Once the lake has that many members it pauses within the simulation of another batch.
"""

import sys

from flagdata.lake import Lake
from sim.run import load, simulate
from tests.pausing import pause


def work(address: str, recipe: str, members: str | None = None) -> None:
    lake = Lake.open(address)

    def progress(count: int) -> None:
        if members is not None and lake.rows(columns=["artifact"]).num_rows >= int(members):
            pause()

    simulate(lake, load(recipe), progress=progress)


if __name__ == "__main__":
    work(*sys.argv[1:])
