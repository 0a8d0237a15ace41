"""The command line with small commits, for builds that are killed, and little patience with workers that are gone.

    python build_worker.py ARTIFACTS build RECIPE …

Once the lake has that many artifacts it pauses with another object that it has stored and not committed, once.
"""

import sys
from pathlib import Path

import sim.datasets.build
import sim.workers.scheduled
from flagdata.cli import main
from flagdata.lake import Transaction
from tests.pausing import pause


def pause_at(artifacts: int) -> None:
    put, paused = Transaction.put, []

    def pausing_put(transaction: Transaction, path: Path) -> str:
        name = put(transaction, path)
        if not paused and transaction._lake.rows(columns=["artifact"]).num_rows >= artifacts:
            paused.append(name)
            pause()
        return name

    Transaction.put = pausing_put


if __name__ == "__main__":
    sim.datasets.build.COMMIT_FILMS = 2
    sim.workers.scheduled.PATIENCE = 2.0
    pause_at(int(sys.argv.pop(1)))
    main()
