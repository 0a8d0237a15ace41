"""Who computes the jobs of a long command: this process, others of this machine, or workers of a
Dask scheduler.

with connected(scheduler, workers=4, say=say) as workers:
    for result in workers.results(jobs):
        …
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from sim.workers.connect import connect_workers
    from sim.workers.jobs import Job, WorkerError, Workers
    from sim.workers.kept_simulations import Simulatable, kept_file, simulate_missing
    from sim.workers.local import LocalWorkers, single_threaded
    from sim.workers.scheduled import Scheduled

__getattr__ = lazy_exports(__name__, __file__)
