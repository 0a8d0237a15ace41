"""The networks by name. A name in a recipe or a checkpoint is looked up here; the module is imported only then.

Installed packages add networks by entry points of the group `flagdata.networks`.
"""

from __future__ import annotations

from flagdata.registry import Registry
from models.network import INPUTS

NETWORKS = Registry(
    "network",
    {
        "sdn": "models.sdn:SpectralNetwork",
        "resnet18": "models.baselines:ResNetOfFrames",
        "wave": "models.wave:WaveNetwork",
        "flow": "models.flow_network:FlowNetwork",
        "flow-3": "models.flow_network:ThreeScaleFlowNetwork",
        "cardona": "models.baselines:Cardona",
        "yang": "models.baselines:Yang",
    },
    group="flagdata.networks",
    accepts=lambda entry: isinstance(entry, type) and getattr(entry, "takes", None) in INPUTS,
)
