"""Fields on the faces and hinges of a mesh by the compiled library: what effects look at in every
step.

The torch source (`sim.cloth.air`, `sim.cloth.cloth_batch`, `sim.cloth.inertia`,
`sim.cloth.bending`) is the definition, and what runs where gradients are wanted, on other devices,
and where the library cannot be built. A chain of torch calls writes and reads a whole field for
every operation; here all of them are done while a face is in registers.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

import torch
from torch import Tensor

from sim.compiler import library

_NAMES = {torch.float32: "f32", torch.float64: "f64"}


class _View(ctypes.Structure):
    """Mirrors `on_mesh::View` of on_mesh.hpp."""

    _fields_ = [
        ("data", ctypes.c_void_p),
        ("vertex", ctypes.c_int64),
        ("component", ctypes.c_int64),
    ]


def usable(*tensors: Tensor) -> bool:
    """Returns whether the library can take these: on a CPU, of one type that it knows, not traced,
    and no gradient wanted."""
    first = tensors[0]
    if torch.compiler.is_compiling() or first.dtype not in _NAMES:
        return False
    grad = torch.is_grad_enabled()
    if any(
        t.device.type != "cpu" or t.dtype != first.dtype or (grad and t.requires_grad)
        for t in tensors
    ):
        return False
    return library() is not None


def face_wind(
    faces: Tensor, position: Tensor, velocity: Tensor, wind: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """Computes unit normals (face, 3, batch), relative wind (face, 3, batch) and its part along the
    normals (face, 1, batch), see `sim.cloth.air.FaceWind`.

    Args:
        faces: (face, 3) vertices.
        position, velocity: (vertex, 3, batch) [m, m/s].
        wind: (3, batch) or (vertex, 3, batch) [m/s].
    """
    batch = position.shape[-1]
    x, v, u = (_side_by_side(field, batch) for field in (position, velocity, wind))
    normal, relative, across = (
        position.new_empty((len(faces), parts, batch)) for parts in (3, 3, 1)
    )
    _call(
        "face_wind",
        faces,
        len(faces),
        batch,
        _view(x),
        _view(v),
        _view(u),
        normal,
        relative,
        across,
    )
    return normal, relative, across


def sixths(faces: Tensor, position: Tensor) -> Tensor:
    """Computes (x₁ − x₀) × (x₂ − x₀)/6 of faces (face, 3) at positions (vertex, 3, batch): (face,
    3, batch)."""
    batch = position.shape[-1]
    x, sixth = _side_by_side(position, batch), position.new_empty((len(faces), 3, batch))
    _call("normals", faces, len(faces), batch, _view(x), sixth)
    return sixth


def sixth_rates(faces: Tensor, position: Tensor, velocity: Tensor) -> Tensor:
    """Computes the time derivative of `sixths`: (face, 3, batch)."""
    batch = position.shape[-1]
    x, v = (_side_by_side(field, batch) for field in (position, velocity))
    sixth = position.new_empty((len(faces), 3, batch))
    _call("normal_rates", faces, len(faces), batch, _view(x), _view(v), sixth)
    return sixth


def gather_sum(corners: Sequence[Tensor], slots: Tensor) -> Tensor:
    """Sums as `sim.cloth.cloth_batch.gather_sum`, to the bit."""
    contiguous = [corner.contiguous() for corner in corners]
    elements, parts, batch = contiguous[0].shape
    total = contiguous[0].new_empty((slots.shape[1], parts, batch))
    _call(
        "gather",
        _places(contiguous),
        len(contiguous),
        elements,
        slots,
        *slots.shape,
        parts * batch,
        total,
    )
    return total


def fold(hinges: Tensor, position: Tensor) -> tuple[Tensor, tuple[Tensor, Tensor, Tensor, Tensor]]:
    """Computes fold angles (hinge, batch) of hinges (hinge, 4) and their gradients at the corners:
    see `sim.cloth.bending.Fold`."""
    i, j, k, opposite = (position.new_empty((len(hinges), 3, position.shape[-1])) for _ in range(4))
    return _fold_angles(hinges, position, _places([i, j, k, opposite])), (i, j, k, opposite)


def fold_angle(hinges: Tensor, position: Tensor) -> Tensor:
    """Computes fold angles (hinge, batch) alone."""
    return _fold_angles(hinges, position, None)


def _fold_angles(
    hinges: Tensor, position: Tensor, gradients: ctypes.Array[ctypes.c_void_p] | None
) -> Tensor:
    batch = position.shape[-1]
    x, angle = _side_by_side(position, batch), position.new_empty((len(hinges), batch))
    _call("fold", hinges, len(hinges), batch, _view(x), angle, gradients)
    return angle


def _side_by_side(field: Tensor, batch: int) -> Tensor:
    """Expands a field of vectors so that its members lie side by side."""
    field = field.expand(*field.shape[:-1], batch)
    return field if field.stride(-1) == 1 else field.contiguous()


def _view(field: Tensor) -> _View:
    """Makes a view of (vertex, 3, batch), or of (3, batch) that is the same at all vertices. The
    tensor must outlive it."""
    vertex = field.stride(0) if field.ndim == 3 else 0
    return _View(data=field.data_ptr(), vertex=vertex, component=field.stride(-2))


def _places(tensors: Sequence[Tensor]) -> ctypes.Array[ctypes.c_void_p]:
    return (ctypes.c_void_p * len(tensors))(*(tensor.data_ptr() for tensor in tensors))


def _call(
    name: str, *arguments: Tensor | int | _View | ctypes.Array[ctypes.c_void_p] | None
) -> None:
    """Calls a function of the library, for numbers of the type of the last tensor that is
    passed."""
    dtype = next(a.dtype for a in reversed(arguments) if isinstance(a, Tensor))
    function = getattr(library(), f"{name}_{_NAMES[dtype]}")
    function.restype = None
    function(*map(_pass_argument, arguments))


def _pass_argument(argument: Tensor | int | _View | ctypes.Array[ctypes.c_void_p] | None) -> object:
    if isinstance(argument, Tensor):
        return ctypes.c_void_p(argument.data_ptr())
    return ctypes.c_int64(argument) if isinstance(argument, int) else argument
