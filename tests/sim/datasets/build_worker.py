"""The command line with small commits, for builds that are killed, and little patience with workers that are gone."""

import sim.datasets.build
import sim.datasets.cluster
from flagdata.cli import main

if __name__ == "__main__":
    sim.datasets.build.COMMIT_FILMS = 2
    sim.datasets.cluster.PATIENCE = 4.0
    main()
