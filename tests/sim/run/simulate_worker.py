"""Simulates a recipe into a lake, in a process of its own that may be killed."""

import sys

from flagdata.lake import Lake
from sim.run import load, simulate

if __name__ == "__main__":
    simulate(Lake.open(sys.argv[1]), load(sys.argv[2]))
