"""Hands a sample's tensors to the compiled kernel."""

from __future__ import annotations

import ctypes
import functools

import torch
from torch import Tensor

from sim.compiler import compile_library
from sim.render.pixel_view import RasterView
from sim.render.scene_geometry import Geometry
from sim.render.scene_light import Light
from sim.render.shadow import SIZE, basis
from sim.render.staging import POLE_ALBEDO
from sim.render.texture import Pyramid

_COUNTS = ("frames", "width", "height", "vertices", "pole_start", "levels", "suns", "map")
_POINTERS = (
    "vertex_offset",
    "face_offset",
    "cloth_faces",
    "corner",
    "position",
    "place",
    "depth",
    "uv",
    "texels",
    "level_width",
    "level_height",
    "level_start",
    "basis",
    "out",
)
_NUMBERS = ("sun", "sky", "translucency", "samples")


class _Sample(ctypes.Structure):
    """Mirrors `Sample` of raster.cpp field by field."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in _COUNTS),
        *((name, ctypes.c_void_p) for name in _POINTERS),
        ("pole_albedo", ctypes.c_float * 4),
        ("camera", ctypes.c_float * 4),
        *((name, ctypes.c_float) for name in _NUMBERS),
    ]


class _Film(ctypes.Structure):
    """Mirrors `Film` of raster.cpp field by field."""

    _fields_ = [
        *((name, ctypes.c_int64) for name in ("frames", "pixels")),
        *((name, ctypes.c_void_p) for name in ("scene", "behind", "out")),
        ("gain", ctypes.c_float),
    ]


@functools.cache
def library() -> ctypes.CDLL | None:
    """Compiles the kernel; None, with one warning, where it cannot be built."""
    return compile_library(
        "sim.render",
        ("raster.cpp",),
        without="the raster renderer runs as plain torch, many times slower",
    )


def add_sample(
    code: ctypes.CDLL,
    out: Tensor,
    geometry: Geometry,
    *,
    view: RasterView,
    light: Light,
    pyramid: Pyramid,
) -> None:
    """Adds a sample as `raster_torch.add_sample`, on the CPU."""
    places, depth = view.project(geometry.positions)
    frames, height, width, _ = out.shape
    suns = torch.tensor([basis(direction) for direction in light.to_sun], dtype=torch.float32)
    tensors = {
        "vertex_offset": geometry.vertex_offset,
        "face_offset": geometry.face_offset,
        "cloth_faces": geometry.cloth_faces,
        "corner": geometry.corners,
        "position": geometry.positions,
        "place": places,
        "depth": depth,
        "uv": geometry.uv,
        "texels": pyramid.padded,
        "level_width": pyramid.width,
        "level_height": pyramid.height,
        "level_start": pyramid.start,
        "basis": suns,
    }
    tensors = {name: tensor.contiguous() for name, tensor in tensors.items()}
    sample = _Sample(
        frames=frames,
        width=width,
        height=height,
        vertices=len(geometry.positions),
        pole_start=int(geometry.vertex_offset[-1]),
        levels=len(pyramid),
        suns=len(suns),
        map=SIZE,
        sun=light.point,
        sky=light.sky,
        translucency=light.translucency,
        samples=view.samples,
        out=out.data_ptr(),
    )
    sample.pole_albedo[:] = [*POLE_ALBEDO, 0.0]
    sample.camera[:] = [*view.camera.position, 0.0]
    for name, tensor in tensors.items():
        setattr(sample, name, tensor.data_ptr())
    code.add_sample(ctypes.byref(sample))


def develop(code: ctypes.CDLL, scene: Tensor, behind: Tensor, *, gain: float) -> Tensor:
    """Develops as `develop.develop`, on the CPU."""
    frames, height, width, _ = scene.shape
    out = torch.empty((frames, height, width, 3), dtype=torch.uint8)
    film = _Film(
        frames=frames,
        pixels=height * width,
        gain=gain,
        scene=scene.data_ptr(),
        behind=behind.data_ptr(),
        out=out.data_ptr(),
    )
    code.develop(ctypes.byref(film))
    return out
