"""What `flagdata measure` answers on a flag of heavy cloth, filmed in the looks of `ten-looks`.

Cloth of 0.383 kg/m² is near the end of the weights that `flow-outdoor` learned from, 0.40 kg/m².
Weight, winds and looks were fixed before a film was measured.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from flagdata.core.stated import Stated
from tests.studies.validation.ten_looks import Cloth, graded

HEAVY = Cloth(
    study="heavy-cloth",
    title="A flag of heavy cloth in ten looks",
    area_weight=0.383,
    stated=Stated(low=0.375, high=0.391),
    winds=(3.0, 5.0, 7.0),
)


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Answers on the films of heavy cloth."""
    return graded(HEAVY, seed=seed, out=out)
