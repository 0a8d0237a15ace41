"""A reading model as a Zarr folder of plain arrays. Nothing in it is executed when it is read."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.lake.mesh_sequences import check_format, read_part, store_errors, write_plain
from measure.film.similarity import FlagSize
from measure.measuring_model.novelty import Familiar
from measure.measuring_model.reading_model import ReadingModel
from measure.measuring_model.regression import Ridge
from measure.measuring_model.window_features import Place

FORMAT = 1
HEAD = "flagdata_anemometer"
_RIDGE = ("centre", "spread", "coefficients")
_FAMILIAR: Mapping[str, tuple[str, ...]] = {
    "centre": ("feature",),
    "spread": ("feature",),
    "coefficients": ("power", "feature"),
    "whitening": ("white", "feature"),
    "distances": ("rank",),
}


def write(path: Path, model: ReadingModel, about: Mapping[str, Any]) -> None:
    """Writes a new Zarr folder: the regression over `column`, the windows' `winds` and `errors`
    over `window`, what windows show beside the wind over `feature`, and the `hoist`, `background`
    and `bare` of each camera's place.

    Args:
        about: what is reported of the calibration, JSON values.
    """
    import zarr

    ridge, familiar = model.ridge, model.familiar
    group = zarr.open_group(path, mode="w-", zarr_format=3)
    group.update_attributes(
        {
            HEAD: {"format": FORMAT},
            "network": model.network,
            "identity": model.identity,
            "flag_size": [model.size.length, model.size.height],
            "step": model.step,
            "features": list(model.names),
            "ridge": {"offset": ridge.offset, "penalty": ridge.penalty},
            "block": model.block,
            "noise": familiar.noise,
            "compared": [familiar.low, familiar.high],
            "sides": [place.side for place in model.places],
            "answer": dict(about),
        }
    )
    for name in _RIDGE:
        write_plain(group, f"ridge_{name}", getattr(ridge, name), ("column",))
    write_plain(group, "winds", model.winds, ("window",))
    write_plain(group, "errors", model.errors, ("window",))
    for name, dims in _FAMILIAR.items():
        write_plain(group, f"familiar_{name}", getattr(familiar, name), dims)
    for number, place in enumerate(model.places):
        write_plain(group, f"hoist_{number}", place.hoist, ("end", "coordinate"))
        write_plain(
            group, f"background_{number}", place.background, (f"row_{number}", f"col_{number}")
        )
        write_plain(group, f"bare_{number}", place.bare, (f"row_{number}", f"col_{number}"))


def read(path: Path) -> ReadingModel:
    """Reads the reading model in an object of the lake.

    Raises:
        CorruptError: not such a folder, damaged, or of a newer format.
        LimitError: arrays larger than the limits of `flagdata.lake.mesh_sequences`.
    """
    from flagdata.lake.sized_chunks import open_group

    with store_errors(
        path, "the reading model is damaged", fix="run flagdata verify; calibrate again"
    ):
        group = open_group(path)
        check_format(group.attrs.get(HEAD), FORMAT, path, noun="reading models")
        about: dict[str, Any] = json.loads(json.dumps(dict(group.attrs)))

        def array(name: str) -> np.ndarray:
            return read_part(group, name, None, None, where=str(path))

        return ReadingModel(
            network=about["network"],
            identity=about["identity"],
            size=FlagSize(length=about["flag_size"][0], height=about["flag_size"][1]),
            step=about["step"],
            names=tuple(about["features"]),
            ridge=Ridge(**{part: array(f"ridge_{part}") for part in _RIDGE}, **about["ridge"]),
            winds=array("winds"),
            errors=array("errors"),
            block=about["block"],
            familiar=Familiar(
                noise=about["noise"],
                low=about["compared"][0],
                high=about["compared"][1],
                **{name: array(f"familiar_{name}") for name in _FAMILIAR},
            ),
            places=tuple(
                Place(
                    hoist=array(f"hoist_{number}"),
                    side=side,
                    background=array(f"background_{number}"),
                    bare=array(f"bare_{number}"),
                )
                for number, side in enumerate(about["sides"])
            ),
        )
