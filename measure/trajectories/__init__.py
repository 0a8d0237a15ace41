"""Observed trajectories: the motion of a cloth, its specimen and its wind; read and checked before
anything is concluded from them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports
from measure.trajectories.experiment import Observed, observe
from measure.trajectories.gaps import fill
from measure.trajectories.observation import Known, Observation, Up, from_arrays
from measure.trajectories.setup import Hold, Setup, sheet
from measure.trajectories.trajectory import Experiment, Specimen, Trajectory, WindTrack

if TYPE_CHECKING:
    from measure.trajectories.attachment_anchors import as_seen, carry_attachments
    from measure.trajectories.checks.attachment import hoist_stands_still
    from measure.trajectories.cloth_mesh import model_mesh
    from measure.trajectories.experiment import hold, observe
    from measure.trajectories.experiment_recipe import load, parse, read
    from measure.trajectories.interpolation import onto
    from measure.trajectories.mesh_observations import from_folder, from_sequence, sample
    from measure.trajectories.observation import Known, Observation, Up, from_arrays
    from measure.trajectories.setup import Hold, Setup, sheet
    from measure.trajectories.trajectory import (
        AREA_WEIGHT_UNCERTAINTY,
        AttachmentTrack,
        Experiment,
        Specimen,
        Trajectory,
        WindTrack,
    )
    from measure.trajectories.wind_tracks import LogPlacement, from_log


__all__ = [
    "Experiment",
    "Hold",
    "Known",
    "Observation",
    "Observed",
    "Setup",
    "Specimen",
    "Trajectory",
    "Up",
    "WindTrack",
    "fill",
    "from_arrays",
    "observe",
    "sheet",
]

__getattr__ = lazy_exports(__name__, __file__)
