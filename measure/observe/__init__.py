"""Observed trajectories: the motion of a cloth, its specimen and its wind; read and checked before anything
is concluded from them."""

from measure.observe.experiment import Observed, observe
from measure.observe.gaps import fill
from measure.observe.observation import Known, Observation, Up, from_arrays
from measure.observe.setup import Hold, Setup, sheet
from measure.observe.trajectory import Experiment, Specimen, Trajectory, WindTrack

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
