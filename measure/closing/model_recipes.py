"""The models of a verdict as recipes that `flagdata simulate` runs at once: the base model, and
that with the effects.

They run with the fit's own mesh and steps, whose damping is part of what was calibrated, in the
frame of the fit: pole base at the origin, wind along +x.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from measure.forecasting.alignment import align_experiment
from measure.trajectories.trajectory import Experiment, Specimen
from measure.verdict.verdict_record import Candidate, Conclusion, Verdict
from sim.cloth import handles
from sim.cloth.air import AIR_FORCES, AirForce
from sim.cloth.handles import ARCSIM_STIFFNESS
from sim.cloth.material import MATERIALS, Material, named_material
from sim.cloth.mesh import grid
from sim.cloth.scene import upright
from sim.effects import EFFECTS
from sim.integrate.split import SplitEuler

_SETTLE = 3.0  # s, as of the nulls
_FRAMES = 100
_ROUGH = 2e-3  # m; a start that is flat to the last bit may stay so


@dataclass(frozen=True, kw_only=True, eq=False)
class NamedModel:
    """A model with a name.

    Attributes:
        name: what it is called.
        content: of its recipe, as `sim.run.simulation_toml` says.
    """

    name: str
    content: Mapping[str, Any]


def models(
    verdict: Verdict, experiment: Experiment, *, name: str, seed: int
) -> tuple[NamedModel, ...]:
    """Makes the base model as calibrated and, where effects act, the larger one; none of a carried
    cloth, since recipes hold cloth still.

    Args:
        name: that theirs begin with.
        seed: of their starts.
    """
    if experiment.carried:
        return ()
    turned = align_experiment(experiment)
    common = _common(turned, seed)
    models_made = [_model(f"{name}-base", verdict, common, turned.specimen, ())]
    if effects := acting(verdict):
        models_made.append(
            _model(
                "-".join(dict.fromkeys([name, *(c.effect for c in effects)])),
                verdict,
                common,
                turned.specimen,
                effects,
            )
        )
    return tuple(models_made)


def acting(verdict: Verdict) -> tuple[Candidate, ...]:
    """Lists the effects of the larger model: all that are named as acting, or the first of those
    that may be."""
    if not verdict.named:
        return ()
    unrejected = tuple(candidate for candidate in verdict.ranking if not candidate.why_not)
    return unrejected if verdict.conclusion is Conclusion.EFFECT else unrejected[:1]


def fitted_parameters(verdict: Verdict, effects: Sequence[Candidate]) -> dict[str, float]:
    """Parameters of the cloth, calibrated with the effects where there are any, by their names."""
    return {
        p.name: (p.after if effects and p.after is not None else p.before).point
        for p in verdict.parameters
    }


def acting_effects(effects: Sequence[Candidate]) -> dict[str, dict[str, dict[str, float]]]:
    """Makes the table `effects` of a recipe, with the fitted strengths; nothing where there are
    none."""
    strengths: dict[str, dict[str, float]] = {}
    for candidate in effects:
        kind = EFFECTS[candidate.effect]
        described = kind.parameters()[candidate.parameter]
        of_effect = strengths.setdefault(candidate.effect, {})
        of_effect[candidate.parameter.replace("_", "-")] = described.nearest(
            candidate.strength.point
        )
        of_effect.update(kind.weighed_shapes)
    return {"effects": strengths} if strengths else {}


def _model(
    name: str,
    verdict: Verdict,
    common: Mapping[str, Any],
    specimen: Specimen,
    effects: Sequence[Candidate],
) -> NamedModel:
    fit = fitted_parameters(verdict, effects)
    material = _material(specimen.material)
    material |= {
        "area-weight": specimen.material.area_weight * fit["area_weight"],
        "bending-factor": fit["bending"],
        "damping": fit["damping"],
    }
    return NamedModel(
        name=name,
        content={"title": name, **common, "material": material, **acting_effects(effects)},
    )


def _common(experiment: Experiment, seed: int) -> dict[str, Any]:
    speeds = [recording.wind.speed for recording in experiment.recordings]
    speed: Any = speeds[0]
    if min(speeds) < max(speeds):
        speed = {"low": min(speeds), "high": max(speeds)}
    specimen = experiment.specimen
    return {
        "seed": seed,
        "batch": 1,
        "scene": _scene(specimen),
        "wind": {"speed": speed, **_force(specimen.air)},
        "integrator": {"name": "implicit", "step": SplitEuler().base.step},
        "time": {"settle": _SETTLE, "frames": _FRAMES, "rate": experiment.recordings[0].rate},
    }


def _scene(specimen: Specimen) -> dict[str, Any]:
    start: dict[str, Any] = {"start-noise": _ROUGH, "gravity": -specimen.gravity[2]}
    if math.isinf(specimen.stiffness):
        start["rigid"] = True
    elif specimen.stiffness != ARCSIM_STIFFNESS:
        start["stiffness"] = specimen.stiffness
    return {**(_flag(specimen) or _mesh(specimen)), **start}


def _flag(specimen: Specimen) -> dict[str, Any] | None:
    """Makes the scene of a plain flag; None for any other cloth."""
    rest = specimen.mesh.rest - specimen.mesh.rest.min(axis=0)
    width, height = (float(side) for side in rest.max(axis=0))
    columns = len(np.unique(rest[:, 0])) - 1
    rows = max(1, round(columns * height / width))
    flat = grid(width=width, height=height, columns=columns, rows=rows)
    if (
        flat.rest.shape != rest.shape
        or not np.allclose(flat.rest, rest)
        or not np.array_equal(flat.faces, specimen.mesh.faces)
    ):
        return None
    if not np.allclose(specimen.anchors, upright(flat)[list(specimen.held)], atol=1e-3 * width):
        return None
    for attachment, vertices in (
        ("corners", handles.corners(flat.rest)),
        ("hoist", handles.full_hoist(flat.rest)),
    ):
        if specimen.held == vertices:
            return {
                "shape": "flag",
                "width": width,
                "height": height,
                "columns": columns,
                "attachment": attachment,
            }
    return None


def _mesh(specimen: Specimen) -> dict[str, Any]:
    return {
        "shape": "mesh",
        "rest": specimen.mesh.rest.tolist(),
        "faces": specimen.mesh.faces.tolist(),
        "held": list(specimen.held),
        "anchors": specimen.anchors.tolist(),
    }


def _material(nominal: Material) -> dict[str, Any]:
    """Names the material, where the catalog's tables are its; else gives its tables."""
    if nominal.name in MATERIALS.names():
        catalogued = named_material(nominal.name)
        if np.array_equal(catalogued.stretching, nominal.stretching) and np.array_equal(
            catalogued.bending, nominal.bending
        ):
            return {"name": nominal.name}
    table = {
        "title": nominal.name,
        "source": nominal.source,
        "area-weight": nominal.area_weight,
        "stretching": nominal.stretching.tolist(),
        "bending": nominal.bending.tolist(),
        "damping": nominal.damping,
    }
    return {"table": table}


def _force(air: AirForce) -> dict[str, Any]:
    name = next(kind for kind in AIR_FORCES if isinstance(air, AIR_FORCES[kind]))
    return {"force": name, **vars(air)}
