"""The cloth of a drape test: scans of discs over a pedestal, simulated drapes, and the bending that
fits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flagdata.packages.lazy import lazy_exports

if TYPE_CHECKING:
    from measure.drape.drape_answer import answer_of
    from measure.drape.drape_shape import rim_of, shape_of
    from measure.drape.drape_simulation import (
        BENDING_LENGTH,
        CLOTH,
        CURVATURE,
        DrapeBatch,
        material,
        mesh,
        ratio,
        simulated_drapes,
    )
    from measure.drape.fit import Face, Fit, Model, Surface, fit_drapes, together

__getattr__ = lazy_exports(__name__, __file__)
