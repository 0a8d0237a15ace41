"""The reference simulator's own flag, cut anew from frame to frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from flagdata.ingest import read_folder
from flagdata.lake import RaggedMeshSequence
from sim.render import Camera, Meshes, stage
from sim.render.shutter import VertexMotion
from tests.sim.render.conftest import camera_of, look
from tests.sim.render.pieces import linear


@pytest.mark.reference
def test_a_remeshed_flag_is_seen_where_its_vertices_project_and_moves_between_frames(
    reference_data: Path,
) -> None:
    sequence = read_folder(reference_data / "arcsim" / "raw_remeshed")
    assert isinstance(sequence, RaggedMeshSequence)
    meshes = Meshes.flag(sequence, heading=0.0)
    assert not meshes.one_topology
    zeta = look(raster_samples=4, exposure_time=0.01, camera_height=-0.5, view_angle=0.7)
    image = camera_of().render(meshes, zeta)
    assert image.shape == (len(sequence), 300, 300, 3)
    placed = stage(meshes, zeta)
    for index in range(len(meshes)):
        covered = linear(image[index])[..., 0] > 0.02
        ys, xs = np.nonzero(covered)
        low, high = _bounds(meshes, index, placed.shift, placed.camera)
        # A vertex on the outline has light on at most half a pixel beside it; the exposure moves it
        # by a pixel or two.
        assert (
            np.abs(
                [
                    xs.min() - low[0],
                    ys.min() - low[1],
                    xs.max() + 1 - high[0],
                    ys.max() + 1 - high[1],
                ]
            ).max()
            < 4
        )
    # At 6 m/s of wind no part of it moves faster than the wind does, nor does material jump where
    # the mesh is cut anew.
    motion = VertexMotion.of(meshes)
    fastest = float(motion.forth.norm(dim=1).max()) * meshes.rate
    assert 0.5 < fastest < 12.0


def _bounds(
    meshes: Meshes, index: int, shift: tuple[float, float, float], camera: Camera
) -> tuple[list[float], list[float]]:
    places, _ = camera.project(meshes.frame(index).positions + torch.tensor(shift))
    return places.amin(dim=0).tolist(), places.amax(dim=0).tolist()
