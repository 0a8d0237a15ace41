"""What lights one sample of a scene."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sim.render.parameters import RenderParameters
from sim.render.sampling import Samples

Direction = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Light:
    """The sky and some points of the sun.

    Attributes:
        to_sun: unit vectors towards the points of the sun that this sample sees.
        point: radiance of white cloth that faces one of them and sees nothing else, so scaled that
            a sample's points light as much as the whole sun does [W/(m² sr)].
        sky: radiance of the sky, from everywhere [W/(m² sr)].
        translucency: share of the diffuse light that leaves cloth on the far side.
    """

    to_sun: tuple[Direction, ...]
    point: float
    sky: float
    translucency: float

    @classmethod
    def of(cls, parameters: RenderParameters, samples: Samples, index: int) -> Light:
        """Selects the light of one of the samples."""
        points = samples.to_sun[index].tolist()
        return cls(
            to_sun=tuple((x, y, z) for x, y, z in points),
            sky=parameters.sky_strength,
            point=samples.sun_weight * parameters.raster_samples / math.pi,
            translucency=parameters.translucency,
        )
