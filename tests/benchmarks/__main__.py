"""`make bench`: speed, with accuracy beside it and a peer in the same run."""

from __future__ import annotations

from tests.evidence import run_all

BENCHMARKS = {
    "catalog": "tests.benchmarks.bench_catalog",
    "effects": "tests.benchmarks.bench_effects",
    "first-batch": "tests.benchmarks.bench_first_batch",
    "lake": "tests.benchmarks.bench_lake",
    "logs": "tests.benchmarks.bench_logs",
    "measure": "tests.benchmarks.bench_measure",
    "models": "tests.benchmarks.bench_models",
    "newcomer": "tests.benchmarks.bench_newcomer",
    "pairs": "tests.benchmarks.bench_pairs",
    "peers": "tests.benchmarks.bench_peers",
    "records": "tests.benchmarks.bench_records",
    "render": "tests.benchmarks.bench_render",
    "sim": "tests.benchmarks.bench_sim",
    "sim-cost": "tests.benchmarks.bench_sim_cost",
    "start": "tests.benchmarks.bench_start",
    "storage": "tests.benchmarks.bench_storage",
    "verdict": "tests.benchmarks.bench_verdict",
}

if __name__ == "__main__":
    run_all("bench", BENCHMARKS)
