"""Simulates a recipe into a lake, in a process of its own that may be killed.

    python simulate_worker.py LAKE RECIPE [MEMBERS]

Once the lake has that many members it writes "paused" from within the simulation of another batch, and does not go on.
"""

import sys

from flagdata.lake import Lake
from sim.run import load, simulate


def work(address: str, recipe: str, members: str | None = None) -> None:
    lake = Lake.open(address)

    def pause(count: int) -> None:
        if members is not None and lake.rows(columns=["artifact"]).num_rows >= int(members):
            sys.stdout.write("paused\n")
            sys.stdout.flush()
            sys.stdin.read()

    simulate(lake, load(recipe), progress=pause)


if __name__ == "__main__":
    work(*sys.argv[1:])
