"""`make validate`: slow evidence on data no one here wrote, or on ensembles too large for a test."""

from __future__ import annotations

from tests.evidence import run_all

VALIDATIONS = {
    "clock-recovery": "tests.validation.clock_recovery",
    "flags": "tests.validation.flags",
    "flutter": "tests.validation.flutter",
}

if __name__ == "__main__":
    run_all("validate", VALIDATIONS)
