"""Effects the base model lacks: one a file, each with null value, unit, prior and source.

An entry here enrols it in the contract suites (`tests/contract/test_effects.py`,
`test_sensor_effects.py`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports
from flagdata.recipes.registry import Registry
from sim.effects.effect import Effect, apply
from sim.effects.parameter import Parameter, Role

if TYPE_CHECKING:
    from sim.effects.added_mass import AddedMass
    from sim.effects.anemometer_lag import AnemometerLag
    from sim.effects.cloth_geometry import horizontal, left_of, norm, origin
    from sim.effects.effect import ClothEffect, Effect, FlowEffect, ForceEffect, WindEffect, apply
    from sim.effects.effect_files import load
    from sim.effects.field import FieldEffect, Flat, Seen, heavier
    from sim.effects.finite_span_loading import FiniteSpanLoading
    from sim.effects.gusts import Gusts
    from sim.effects.hem_mass import HemMass
    from sim.effects.internal_damping import InternalDamping
    from sim.effects.lift import Lift
    from sim.effects.parameter import (
        NOT_NEGATIVE,
        Parameter,
        Parametrised,
        Role,
        Value,
        shape,
        strength,
    )
    from sim.effects.permeability import Permeability
    from sim.effects.porosity import Porosity
    from sim.effects.power_law_drag import PowerLawDrag
    from sim.effects.quantities import AIR_DENSITY
    from sim.effects.reactive_loading import ReactiveLoading
    from sim.effects.sensor import AnemometerEffect, Sampling
    from sim.effects.shear import Shear
    from sim.effects.slack import Slack
    from sim.effects.tangential_linear_drag import TangentialLinearDrag
    from sim.effects.vertical_wind import VerticalWind
    from sim.effects.weighing import CLASSES, Copied, Need


__all__ = ["EFFECTS", "SENSOR_EFFECTS", "Effect", "Parameter", "Role", "apply"]

EFFECTS = Registry(
    "effect",
    {
        "power-law-drag": "sim.effects.power_law_drag:PowerLawDrag",
        "tangential-linear-drag": "sim.effects.tangential_linear_drag:TangentialLinearDrag",
        "tangential-quadratic-drag": (
            "sim.effects.tangential_quadratic_drag:TangentialQuadraticDrag"
        ),
        "lift": "sim.effects.lift:Lift",
        "added-mass": "sim.effects.added_mass:AddedMass",
        "reactive-loading": "sim.effects.reactive_loading:ReactiveLoading",
        "finite-span-loading": "sim.effects.finite_span_loading:FiniteSpanLoading",
        "wagner-lag": "sim.effects.wagner_lag:WagnerLag",
        "air-density": "sim.effects.air_density:AirDensityChange",
        "permeability": "sim.effects.permeability:Permeability",
        "porosity": "sim.effects.porosity:Porosity",
        "hem-mass": "sim.effects.hem_mass:HemMass",
        "hem-stiffness": "sim.effects.hem_stiffness:HemStiffness",
        "vertical-wind": "sim.effects.vertical_wind:VerticalWind",
        "shear": "sim.effects.shear:Shear",
        "pole-wake": "sim.effects.pole_wake:PoleWake",
        "hysteresis": "sim.effects.hysteresis:Hysteresis",
        "rest-curvature": "sim.effects.rest_curvature:RestCurvature",
        "full-hoist": "sim.effects.full_hoist:FullHoist",
        "tilted-pole": "sim.effects.tilted_pole:TiltedPole",
        "slack": "sim.effects.slack:Slack",
        "direction-change": "sim.effects.direction_change:DirectionChange",
        "gusts": "sim.effects.gusts:Gusts",
        "logged-gusts": "sim.effects.logged_gusts:LoggedGusts",
        "wet-mass": "sim.effects.wet_mass:WetMass",
        "internal-damping": "sim.effects.internal_damping:InternalDamping",
    },
    group="flagdata.effects",
    accepts=lambda entry: isinstance(entry, type) and issubclass(entry, Effect),
)
"""On the cloth: kinds of `sim.effects.effect`, in the order in which verdicts weigh them; then
those of installed packages, from the entry points `flagdata.effects`. Of files, see
`sim.effects.effect_files`."""

SENSOR_EFFECTS = Registry(
    "sensor effect",
    {
        "anemometer-lag": "sim.effects.anemometer_lag:AnemometerLag",
        "overspeeding": "sim.effects.overspeeding:Overspeeding",
        "anemometer-gain": "sim.effects.anemometer_gain:AnemometerGain",
        "anemometer-offset": "sim.effects.anemometer_offset:AnemometerOffset",
        "anemometer-dead-zone": "sim.effects.anemometer_dead_zone:AnemometerDeadZone",
        "sensor-height": "sim.effects.sensor_height:SensorHeight",
        "sensor-distance": "sim.effects.sensor_distance:SensorDistance",
        "clock-offset": "sim.effects.clock_offset:ClockOffset",
        "clock-drift": "sim.effects.clock_drift:ClockDrift",
        "frame-rate-error": "sim.effects.frame_rate_error:FrameRateError",
        "exposure-blur": "sim.effects.exposure_blur:ExposureBlur",
        "rolling-shutter": "sim.effects.rolling_shutter:RollingShutter",
        "frame-jitter": "sim.effects.frame_jitter:FrameJitter",
    },
)
"""On the observation: kinds of `sim.effects.sensor`."""

__getattr__ = lazy_exports(__name__, __file__)
