"""The command line with small commits, for builds that are killed."""

import sim.datasets.build
from flagdata.cli import main

if __name__ == "__main__":
    sim.datasets.build.COMMIT_FILMS = 2
    main()
