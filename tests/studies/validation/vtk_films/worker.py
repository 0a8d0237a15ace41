"""Draws a scene by VTK, in VTK's environment: `python -I worker.py JOB.npz`; raw frames, RGB, go to
standard output.

Without a display VTK draws by EGL or OSMesa in software. JOB.npz holds `settings` (JSON) and the
arrays that it names; see `tests.studies.validation.vtk_films.scene` for what they mean.
"""

from __future__ import annotations

import json
import os
import sys
from typing import Any

import numpy as np
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkLogger, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkImageData, vtkPolyData
from vtkmodules.vtkRenderingCore import (
    vtkActor,
    vtkCamera,
    vtkLight,
    vtkPolyDataMapper,
    vtkRenderer,
    vtkRenderWindow,
    vtkTexture,
    vtkWindowToImageFilter,
)

_LINEAR = np.rint(np.power(np.arange(256) / 255, 2.2) * 65535).astype(np.uint32)
_SHOWN = np.rint(np.power(np.arange(65536) / 65535, 1 / 2.2) * 255).astype(np.uint8)


class Body:
    """A mesh whose vertices move, or stand still where it has one frame only."""

    def __init__(self, settings: dict[str, Any], arrays: Any) -> None:
        name = settings["name"]
        self.positions = arrays[f"{name}_positions"]
        self.faces = arrays[f"{name}_faces"].astype(np.int64)
        self.mesh = vtkPolyData()
        cells = vtkCellArray()
        cells.SetCells(
            len(self.faces),
            numpy_to_vtkIdTypeArray(
                np.insert(self.faces, 0, self.faces.shape[1], axis=1).ravel(), deep=True
            ),
        )
        self.mesh.SetPolys(cells)
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(self.mesh)
        self.actor = vtkActor()
        self.actor.SetMapper(mapper)
        material = self.actor.GetProperty()
        material.SetColor(*settings["colour"])
        material.SetAmbient(settings["ambient"])
        material.SetDiffuse(settings["diffuse"])
        material.SetSpecular(settings["gloss"])
        material.SetSpecularPower(12)
        material.SetLighting(settings["lit"])
        material.SetInterpolationToPhong()
        if f"{name}_texture" in arrays:
            coordinates = numpy_to_vtk(arrays[f"{name}_uv"].astype(np.float32), deep=True)
            coordinates.SetName("uv")
            self.mesh.GetPointData().SetTCoords(coordinates)
            self.actor.SetTexture(texture(arrays[f"{name}_texture"]))
        self.show(0)

    def show(self, frame: int) -> None:
        if frame and len(self.positions) == 1:
            return
        places = np.ascontiguousarray(self.positions[frame], dtype=np.float32)
        points = vtkPoints()
        points.SetData(numpy_to_vtk(places, deep=True))
        self.mesh.SetPoints(points)
        first, second, third = (places[self.faces[:, k]] for k in range(3))
        across = np.cross(second - first, third - first)
        normals = np.stack(
            [
                np.bincount(
                    self.faces.ravel(),
                    np.repeat(across[:, k], self.faces.shape[1]),
                    minlength=len(places),
                )
                for k in range(3)
            ],
            axis=1,
        )
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        self.mesh.GetPointData().SetNormals(numpy_to_vtk(normals.astype(np.float32), deep=True))
        self.mesh.Modified()


def texture(picture: np.ndarray) -> vtkTexture:
    """Of a picture (height, width, 3) uint8, its first row on top."""
    height, width, _ = picture.shape
    image = vtkImageData()
    image.SetDimensions(width, height, 1)
    image.GetPointData().SetScalars(
        numpy_to_vtk(np.ascontiguousarray(picture[::-1]).reshape(-1, 3), deep=True)
    )
    made = vtkTexture()
    made.SetInputData(image)
    made.InterpolateOn()
    made.MipmapOn()
    return made


def aim(camera: vtkCamera, settings: dict[str, Any], turned: np.ndarray) -> None:
    """Point the camera, then turn it by yaw, pitch and roll [degrees]."""
    camera.SetPosition(*settings["eye"])
    camera.SetFocalPoint(*settings["target"])
    camera.SetViewUp(0, 0, 1)
    camera.SetViewAngle(settings["view_angle"])
    camera.Yaw(float(turned[0]))
    camera.Pitch(float(turned[1]))
    camera.Roll(float(turned[2]))
    camera.SetClippingRange(0.5, 200.0)


def main() -> None:
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    os.environ.pop("DISPLAY", None)
    arrays = np.load(sys.argv[1])
    settings = json.loads(str(arrays["settings"]))
    width, height = settings["size"]
    renderer = vtkRenderer()
    renderer.SetBackground(0, 0, 0)
    renderer.RemoveAllLights()
    renderer.AutomaticLightCreationOff()
    for light in settings["lights"]:
        made = vtkLight()
        made.SetLightTypeToSceneLight()
        made.SetPosition(*light["towards"])
        made.SetFocalPoint(0, 0, 0)
        made.SetColor(*light["colour"])
        made.SetIntensity(light["intensity"])
        renderer.AddLight(made)
    bodies = [Body(one, arrays) for one in settings["bodies"]]
    for body in bodies:
        renderer.AddActor(body.actor)
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(width, height)
    window.AddRenderer(renderer)
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.ShouldRerenderOff()
    turned, each = arrays["turned"], settings["subframes"]
    for frame in range(settings["frames"]):
        total = np.zeros((height, width, 3), dtype=np.uint32)
        for part in range(each):
            for body in bodies:
                body.show(frame * each + part)
            aim(renderer.GetActiveCamera(), settings, turned[frame * each + part])
            window.Render()
            grab.Modified()
            grab.Update()
            picture = vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars()).reshape(
                height, width, 3
            )[::-1]
            if each > 1:
                total += _LINEAR[picture]
        shown = picture if each == 1 else _SHOWN[total // each]
        sys.stdout.buffer.write(np.ascontiguousarray(shown).tobytes())
    sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
