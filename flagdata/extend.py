"""What packages that add to flagdata import: `from flagdata.extend import ForceEffect, strength`.

Effects, log formats, data sets, networks and renderers are added by entry points; docs/extending.md
shows one of each.
The names below are public: they are the same in a checkout and in an installation, where the
packages `sim` and `models` have other names. Each is imported when it is first used.
"""

from __future__ import annotations

from typing import Any

from flagdata.core.parts import attribute

GROUPS = {
    "flagdata.effects": "a subclass of one of the kinds of effect",
    "flagdata.formats": "a class like Format",
    "flagdata.datasets": "a pathlib.Path of a recipe, NAME.toml",
    "flagdata.networks": "a torch.nn.Module like Network",
    "flagdata.renderers": "a class like Renderer, made with assets=Assets()",
}
"""Entry-point group → what an entry leads to."""

_PLACES = {
    # effects on the cloth
    "ForceEffect": "sim.effects.effect:ForceEffect",
    "PressureEffect": "sim.effects.effect:PressureEffect",
    "WindEffect": "sim.effects.effect:WindEffect",
    "FlowEffect": "sim.effects.effect:FlowEffect",
    "ClothEffect": "sim.effects.effect:ClothEffect",
    "strength": "sim.effects.parameter:strength",
    "shape": "sim.effects.parameter:shape",
    "Value": "sim.effects.parameter:Value",
    "NOT_NEGATIVE": "sim.effects.parameter:NOT_NEGATIVE",
    "AirDensity": "sim.effects.quantities:AirDensity",
    "AIR_DENSITY": "sim.effects.quantities:AIR_DENSITY",
    "Cloth": "sim.cloth.cloth_batch:Cloth",
    "face_wind": "sim.cloth.air:face_wind",
    "Need": "sim.effects.weighing:Need",
    "Copied": "sim.effects.weighing:Copied",
    "CLASSES": "sim.effects.weighing:CLASSES",
    # formats of wind logs
    "Format": "flagdata.ingest.anemometer.formats.log_formats:Format",
    "Head": "flagdata.ingest.anemometer.sniffing:Head",
    "Guess": "flagdata.ingest.anemometer.sniffing:Guess",
    "TextFile": "flagdata.ingest.anemometer.text.text_file:TextFile",
    "WindOptions": "flagdata.ingest.anemometer.wind_options:WindOptions",
    "Reading": "flagdata.ingest.anemometer.log_reading:Reading",
    "Sensor": "flagdata.record.signals:Sensor",
    "SampleFlag": "flagdata.core.schema:SampleFlag",
    # networks
    "Network": "models.networks.network:Network",
    "INPUTS": "models.networks.network:INPUTS",
    # renderers
    "Renderer": "sim.render.renderer:Renderer",
    "Meshes": "sim.render.rendered_meshes:Meshes",
    "RenderParameters": "sim.render.parameters:RenderParameters",
    "Assets": "sim.assets:Assets",
    "stage": "sim.render.staging:stage",
    "plate": "sim.render.develop:plate",
    "develop": "sim.render.develop:develop",
}


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = attribute(_PLACES[name])
    return value


def __dir__() -> list[str]:
    return ["GROUPS", *sorted(_PLACES)]
