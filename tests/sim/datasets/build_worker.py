"""The command line with small commits, for builds that are killed, and little patience with workers
that are gone.

    python build_worker.py ARTIFACTS build RECIPE …

Once the lake has that many artifacts it pauses with another object that it has stored and not
committed, once.
"""

import sys

import sim.datasets.build
import sim.workers.scheduled
from flagdata.cli import main
from flagdata.lake import Deposit, Transaction
from tests.pausing import pause


def pause_at(artifacts: int) -> None:
    rely, paused = Transaction.rely, []

    def pausing_rely(transaction: Transaction, deposit: Deposit) -> str:
        name = rely(transaction, deposit)
        if not paused and transaction._lake.rows(columns=["artifact"]).num_rows >= artifacts:
            paused.append(name)
            pause()
        return name

    Transaction.rely = pausing_rely


if __name__ == "__main__":
    sim.datasets.build.COMMIT_RESULTS = 2
    sim.workers.scheduled.PATIENCE = 2.0
    pause_at(int(sys.argv.pop(1)))
    main()
