"""`make validate`: slow evidence on data no one here wrote, or on ensembles too large for a test."""

from __future__ import annotations

from tests.evidence import run_all

VALIDATIONS = {
    "anemometer": "tests.validation.anemometer",
    "arcsim": "tests.validation.arcsim",
    "arcsim-jittered": "tests.validation.arcsim_jittered",
    "carried-cloth": "tests.validation.carried_cloth",
    "card-flag": "tests.validation.card_flag",
    "clock-recovery": "tests.validation.clock_recovery",
    "datasets": "tests.validation.datasets",
    "films": "tests.validation.films",
    "flags": "tests.validation.flags",
    "flutter": "tests.validation.flutter",
    "foreign": "tests.validation.foreign",
    "gate": "tests.validation.gate",
    "gate-films": "tests.validation.gate_films",
    "hanging-cloth": "tests.validation.hanging_cloth",
    "flips": "tests.validation.flips",
    "hostile": "tests.validation.hostile",
    "looks": "tests.validation.looks",
    "lake-in-a-bucket": "tests.validation.lake_in_a_bucket",
    "loop-on-films": "tests.validation.loop_on_films",
    "measure-windows": "tests.validation.measure_windows",
    "numerics": "tests.validation.numerics",
    "object-storage": "tests.validation.object_storage",
    "observables": "tests.validation.observables",
    "paper-flag": "tests.validation.paper_flag.validate",
    "power": "tests.validation.power",
    "real-flag": "tests.validation.real_flag",
    "real-flags": "tests.validation.real_flags.validate",
    "refinement": "tests.validation.refinement",
    "renderers": "tests.validation.renderers",
    "robot-cloth": "tests.validation.robot_cloth",
    "stressors": "tests.validation.stressors",
    "transfer": "tests.validation.transfer",
    "weighed": "tests.validation.weighed",
    "weighed-briefly": "tests.validation.weighed_briefly",
    "verification": "tests.validation.verification",
}

if __name__ == "__main__":
    run_all("validate", VALIDATIONS)
