"""`make validate`: slow evidence on data no one here wrote, or on ensembles too large for a test."""

from __future__ import annotations

from tests.evidence import run_all
from tests.validation.page import draw_page

VALIDATIONS = {
    "arcsim": "tests.validation.arcsim",
    "arcsim-jittered": "tests.validation.arcsim_jittered",
    "arcsim-loop": "tests.validation.arcsim_loop",
    "clip-information": "tests.validation.clip_information",
    "clock-recovery": "tests.validation.clock_recovery",
    "datasets": "tests.validation.datasets",
    "flags": "tests.validation.flags",
    "flow-ablation": "tests.validation.flow_ablation",
    "flutter": "tests.validation.flutter",
    "forecast-floor": "tests.validation.forecast_floor",
    "foreign": "tests.validation.foreign",
    "gate": "tests.validation.gate",
    "hanging-cloth": "tests.validation.hanging_cloth",
    "hostile": "tests.validation.hostile",
    "measure-windows": "tests.validation.measure_windows",
    "paper-flag": "tests.validation.paper_flag.validate",
    "pictures": "tests.validation.pictures",
    "real-flag": "tests.validation.real_flag",
    "refinement": "tests.validation.refinement",
    "renderers": "tests.validation.renderers",
    "replicates": "tests.validation.replicates",
    "robot-cloth": "tests.validation.robot_cloth",
    "stressors": "tests.validation.stressors",
    "transfer": "tests.validation.transfer",
    "verification": "tests.validation.verification",
    "wave-ablation": "tests.validation.wave_ablation",
}

if __name__ == "__main__":
    draw_page(run_all("validate", VALIDATIONS))
