"""The networks by name. A name in a recipe or a checkpoint is looked up here; the module is
imported only then.

Installed packages add networks by entry points of the group `flagdata.networks`.
"""

from __future__ import annotations

from flagdata.recipes.registry import Registry
from models.networks.network import INPUTS

NETWORKS = Registry(
    "network",
    {
        "sdn": "models.networks.sdn:SpectralNetwork",
        "resnet18": "models.networks.baselines:ResNetOfFrames",
        "wave": "models.networks.wave:WaveNetwork",
        "flow": "models.networks.flow_network:FlowNetwork",
        "flow-3": "models.networks.flow_network:ThreeScaleFlowNetwork",
        "cardona": "models.networks.baselines:Cardona",
        "yang": "models.networks.baselines:Yang",
    },
    group="flagdata.networks",
    accepts=lambda entry: isinstance(entry, type) and getattr(entry, "takes", None) in INPUTS,
)
