"""Who computes the steps: torch, which defines them, the compiled kernel, or Warp's."""

from __future__ import annotations

from enum import StrEnum

import torch
from torch import Tensor

from flagdata.errors import UsageError
from sim.cloth.state import State
from sim.cloth.system import Drive, System
from sim.kernel.fused import Kernel
from sim.kernel_warp.warp_batch import WarpKernel


class Backend(StrEnum):
    """What computes the forces."""

    AUTO = "auto"
    """The kernel where it can; torch on other devices, where gradients are wanted, and, with one
    warning, where the kernel cannot be built."""
    TORCH = "torch"
    KERNEL = "kernel"
    WARP = "warp"
    """The Warp kernel, for graphics processors; never taken unless it is asked for."""


def kernel_for(
    system: System, state: State, backend: Backend, *, kind: str | None = None
) -> Kernel | None:
    """Chooses the compiled kernel where the backend allows it and it can run; None where torch is
    to do the work.

    Args:
        kind: of its functions, see `Kernel.of`.

    Raises:
        UsageError: the kernel was asked for and cannot run this system, or gradients are wanted
            from it; the Warp kernel was asked for where steps are not leapfrog's.
    """
    if backend is Backend.WARP:
        raise UsageError(
            "the Warp kernel has only leapfrog steps, no implicit integration",
            where="integrator",
            fix="use the integrator symplectic, or another backend",
        )
    differentiated = _is_differentiated(system, state)
    if backend is Backend.TORCH or (backend is Backend.AUTO and differentiated):
        return None
    kernel = Kernel.of(system, kind=kind)
    if backend is Backend.KERNEL and (kernel is None or differentiated):
        raise UsageError(
            "the compiled kernel cannot run this batch",
            where="integrator",
            fix="it needs a C++ compiler, a CPU, float32 or 64 and no gradients; or leave the "
            "choice to AUTO",
        )
    return kernel


def warp_kernel_for(system: System, state: State) -> WarpKernel:
    """Makes the Warp kernel for a system.

    Raises:
        UsageError: it cannot run this system (see `WarpKernel.of`), or gradients are wanted from
            it.
    """
    if _is_differentiated(system, state):
        raise UsageError(
            "the Warp kernel gives no gradients", where="integrator", fix="use the backend torch"
        )
    return WarpKernel.of(system)


def _is_differentiated(system: System, state: State) -> bool:
    return torch.is_grad_enabled() and any(
        tensor.requires_grad for tensor in (state.position, state.velocity, *system.tensors())
    )


def extra_force(
    kernel: Kernel | None,
    system: System,
    drive: Drive,
    share: float,
    time: float,
    position: Tensor,
    velocity: Tensor,
    *,
    memory: tuple[Tensor, ...],
) -> Tensor:
    """Computes `System.extra_force`, by the kernel of the system where that has all that acts:
    (vertex, 3, batch) [N]."""
    if kernel is None or kernel.beside is None:
        return system.extra_force(drive, share, time, position, velocity, memory=memory)
    return kernel.extra(drive, share, position, velocity, velocity, memory=system.checked(memory))
