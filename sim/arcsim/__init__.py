"""ArcSim 0.2.1's scenes and materials, read as typed scenes and written back.

Which of its stages are simulated, and with which defaults, is in `sim.arcsim.arcsim_reading`.
"""

from sim.arcsim.arcsim_reading import (
    REMESHED_SWEEPS,
    STAGES,
    SWEEPS,
    ArcsimScene,
    read_material,
    read_scene,
)
from sim.arcsim.writing import write_scene

__all__ = [
    "REMESHED_SWEEPS",
    "STAGES",
    "SWEEPS",
    "ArcsimScene",
    "read_material",
    "read_scene",
    "write_scene",
]
