"""Self-contact: layers of cloth keep a distance, and rub.

A vertex of rest area a closer than h to a face that is no neighbour of it is pushed off along the
line to the closest point, with the energy of the reference simulator, k a v³/(6 h), v = h −
distance (ArcSim 0.2.1; Narain, Samii, O'Brien 2012): force f = k a (v²/(2 h) + d v v̇/h), never
pulling, with the cloth's damping d. The face takes the opposite force at the closest point.
Friction is Coulomb's, −μ f w/max(|w|, w0) for a sliding velocity w, with sticking below w0
smoothed, and never more than √(k a m) w/2, which is what an explicit step can follow that follows
the repulsion.

A vertex near the seam of two faces is close to both. It touches the closest face, and the closest
of those that lie on the other side of it (a layer between two others).

Only vertices against faces are looked at, from both layers; edges crossing edges between vertices
are not. Every member of a batch has its own contacts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.errors import InputError
from flagdata.recipes.typed_tables import NotNegative, Positive
from sim.cloth.cloth_batch import Cloth
from sim.cloth.mesh import Mesh

# Sliding slower than this is sticking [m/s].
STICKING_SPEED = 0.02
# Vertices within this many thicknesses of a face's rim, at rest, are of its layer: the sides of a
# hairpin fold shorter than this do not repel each other, which is left to bending. It also spares
# looking at them in every step.
_NEIGHBOURHOOD = 6.0


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Self-contact of a cloth.

    Attributes:
        thickness: h, distance below which layers repel [m]; the paper's scenes say 10 mm.
        stiffness: k [N/m³]; the paper's scenes say 1e6.
        friction: μ of cloth on cloth, null value 0; ArcSim's default is 0.6.

    Raises:
        InputError: a value that is negative, not finite, or a thickness or stiffness of 0.
    """

    thickness: Positive = 0.01
    stiffness: Positive = 1e6
    friction: NotNegative = 0.6

    def __post_init__(self) -> None:
        for name, value in (("thickness", self.thickness), ("stiffness", self.stiffness)):
            if not (math.isfinite(value) and value > 0):
                raise InputError(
                    f"{name} {value!r} is not positive",
                    where="contact",
                    fix="leave contact out, or give it",
                )
        if not (math.isfinite(self.friction) and self.friction >= 0):
            raise InputError(
                f"friction {self.friction!r} is negative or not finite",
                where="contact",
                fix="give ≥ 0",
            )


@dataclass(frozen=True, kw_only=True)
class ContactPairs:
    """Vertices and faces that may touch: (pair,) indices of member, vertex and face."""

    member: Tensor
    vertex: Tensor
    face: Tensor


def layers(mesh: Mesh, contact: Contact) -> tuple[FloatArray, FloatArray]:
    """Layers at rest: (face, 2) centres, and (face,) how far from them another layer begins [m]."""
    corners = mesh.rest[mesh.faces]
    centre = corners.mean(axis=1)
    radius = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    return centre, radius + _NEIGHBOURHOOD * contact.thickness


def neighbours(mesh: Mesh, contact: Contact) -> BoolArray:
    """Masks pairs (vertex, face) that are too close at rest to count as different layers."""
    centre, separation = layers(mesh, contact)
    distance = np.linalg.norm(mesh.rest[:, None] - centre, axis=2)
    return distance < separation


def candidates(
    cloth: Cloth, contact: Contact, position: Tensor, adjacent: BoolArray
) -> ContactPairs:
    """Finds all pairs closer than the thickness by their bounding spheres, by looking at every pair
    of every member.

    Args:
        position: (vertex, 3, batch) [m].
        adjacent: from `neighbours`.
    """
    separate = torch.as_tensor(~adjacent, device=position.device)
    pairs = []
    for member in range(cloth.batch):
        x = position[..., member]
        corners = x[cloth.faces]
        centre = corners.mean(1)
        reach = (corners - centre[:, None]).norm(dim=2).amax(1) + contact.thickness
        close = (torch.cdist(x, centre) < reach) & separate
        vertex, face = torch.nonzero(close, as_tuple=True)
        pairs.append((torch.full_like(vertex, member), vertex, face))
    member, vertex, face = (torch.cat(parts) for parts in zip(*pairs, strict=True))
    return ContactPairs(member=member, vertex=vertex, face=face)


@dataclass(frozen=True, kw_only=True)
class Touch:
    """Pairs that touch.

    Attributes:
        pairs: who.
        weights: (pair, 3) barycentric coordinates of the closest point.
        normal: (pair, 3) from it to the vertex.
        violation: (pair,) v = h − distance, positive [m].
        area: (pair,) rest area of the vertex [m²].
    """

    pairs: ContactPairs
    weights: Tensor
    normal: Tensor
    violation: Tensor
    area: Tensor

    def relative(self, cloth: Cloth, field: Tensor) -> Tensor:
        """Subtracts a vertex field (vertex, 3, batch) at the closest point from that at the vertex:
        (pair, 3)."""
        p = self.pairs
        corners = field[cloth.faces[p.face], :, p.member[:, None]]
        return field[p.vertex, :, p.member] - (self.weights[..., None] * corners).sum(1)

    def spread(self, cloth: Cloth, push: Tensor, like: Tensor) -> Tensor:
        """Adds up forces (pair, 3) on the vertices, and their opposites on the faces at the closest
        points: (vertex, 3, batch)."""
        p = self.pairs
        total = torch.zeros_like(like).movedim(1, 2).contiguous()
        flat = total.view(-1, 3)
        flat.index_add_(0, p.vertex * cloth.batch + p.member, push)
        for corner in range(3):
            at = cloth.faces[p.face, corner] * cloth.batch + p.member
            flat.index_add_(0, at, -self.weights[:, corner, None] * push)
        return total.movedim(2, 1)


def touching(cloth: Cloth, contact: Contact, position: Tensor, pairs: ContactPairs) -> Touch:
    """Selects the pairs that are closer than the thickness, with their geometry, for positions
    (vertex, 3, batch) [m]."""
    point = position[pairs.vertex, :, pairs.member]
    corners = position[cloth.faces[pairs.face], :, pairs.member[:, None]]
    weights = closest(point, corners)
    offset = point - (weights[..., None] * corners).sum(1)
    distance = offset.norm(dim=1)
    close = torch.nonzero((distance < contact.thickness) & (distance > 0))[:, 0]
    normal = offset[close] / distance[close, None]
    vertex_of = pairs.vertex[close] * cloth.batch + pairs.member[close]
    first = _closest_of_each(vertex_of, distance[close], pairs.face[close])
    # The normal of each vertex's closest face, at all pairs of that vertex.
    groups = torch.zeros(
        (cloth.mesh.vertex_count * cloth.batch, 3), dtype=normal.dtype, device=normal.device
    )
    groups[vertex_of[first]] = normal[first]
    behind = torch.nonzero((normal * groups[vertex_of]).sum(1) < 0)[:, 0]
    second = behind[
        _closest_of_each(vertex_of[behind], distance[close][behind], pairs.face[close][behind])
    ]
    keep = close[torch.cat([first, second])]
    selected = ContactPairs(
        member=pairs.member[keep], vertex=pairs.vertex[keep], face=pairs.face[keep]
    )
    areas = torch.as_tensor(cloth.mesh.vertex_areas, dtype=position.dtype, device=position.device)
    return Touch(
        pairs=selected,
        weights=weights[keep],
        normal=offset[keep] / distance[keep, None],
        violation=contact.thickness - distance[keep],
        area=areas[selected.vertex],
    )


def _closest_of_each(group: Tensor, distance: Tensor, face: Tensor) -> Tensor:
    """Indices of the entry with the least distance in each group; the lower face where two are
    equal."""
    order = torch.argsort(face, stable=True)
    order = order[torch.argsort(distance[order], stable=True)]
    order = order[torch.argsort(group[order], stable=True)]
    ordered = group[order]
    fresh = torch.ones_like(ordered, dtype=torch.bool)
    fresh[1:] = ordered[1:] != ordered[:-1]
    return order[fresh]


def closest(point: Tensor, corners: Tensor) -> Tensor:
    """Computes barycentric coordinates (pair, 3) of the points of triangles (pair, corner, 3)
    closest to points (pair, 3).

    The foot on the plane where it is inside, else the closest of the three edges' clamped feet.
    """
    a, b, c = corners.unbind(1)
    e, f, r = b - a, c - a, point - a
    ee, ef, ff = (e * e).sum(1), (e * f).sum(1), (f * f).sum(1)
    re, rf = (r * e).sum(1), (r * f).sum(1)
    denominator = (ee * ff - ef * ef).clamp(min=torch.finfo(point.dtype).tiny)
    u = (ff * re - ef * rf) / denominator
    v = (ee * rf - ef * re) / denominator
    plane = torch.stack([1 - u - v, u, v], dim=1)
    best = plane
    inside = (plane >= 0).all(1)
    least = torch.where(inside, _square(point, corners, plane), torch.inf)
    for start, end in ((0, 1), (1, 2), (2, 0)):
        edge = corners[:, end] - corners[:, start]
        length = (edge * edge).sum(1).clamp(min=torch.finfo(point.dtype).tiny)
        share = (((point - corners[:, start]) * edge).sum(1) / length).clamp(0, 1)
        weights = torch.zeros_like(plane)
        weights[:, start], weights[:, end] = 1 - share, share
        square = _square(point, corners, weights)
        better = ~inside & (square < least)
        best = torch.where(better[:, None], weights, best)
        least = torch.where(better, square, least)
    return best


def _square(point: Tensor, corners: Tensor, weights: Tensor) -> Tensor:
    return ((point - (weights[..., None] * corners).sum(1)) ** 2).sum(1)


@dataclass(frozen=True, kw_only=True)
class LinearisedContact:
    """The contacts of one state, ready to be applied to many fields: k a v/h n nᵀ, and friction as
    a drag."""

    touch: Touch
    cloth: Cloth
    stiffness: Tensor
    push: Tensor
    rub: Tensor

    @classmethod
    def at(
        cls, cloth: Cloth, contact: Contact, position: Tensor, velocity: Tensor, pairs: ContactPairs
    ) -> LinearisedContact:
        touch = touching(cloth, contact, position, pairs)
        pressure = contact.stiffness * touch.area * touch.violation / contact.thickness
        push = pressure * touch.violation / 2
        relative = touch.relative(cloth, velocity)
        slide = relative - (relative * touch.normal).sum(1, keepdim=True) * touch.normal
        rub = contact.friction * push / slide.norm(dim=1).clamp(min=STICKING_SPEED)
        return cls(touch=touch, cloth=cloth, stiffness=pressure, push=push, rub=rub)

    def force(self, like: Tensor) -> Tensor:
        """Computes repulsion at this state: (vertex, 3, batch) [N]."""
        return self.touch.spread(self.cloth, self.push[:, None] * self.touch.normal, like)

    def product(self, field: Tensor) -> Tensor:
        """Stiffness times a field (vertex, 3, batch)."""
        normal = self.touch.normal
        along = (self.touch.relative(self.cloth, field) * normal).sum(1)
        return self.touch.spread(self.cloth, (self.stiffness * along)[:, None] * normal, field)

    def drag(self, field: Tensor) -> Tensor:
        """Multiplies friction's coefficients with a field (vertex, 3, batch) of velocities: what
        resists it [N]."""
        relative, normal = self.touch.relative(self.cloth, field), self.touch.normal
        slide = relative - (relative * normal).sum(1, keepdim=True) * normal
        return self.touch.spread(self.cloth, self.rub[:, None] * slide, field)


def force(
    cloth: Cloth, contact: Contact, position: Tensor, velocity: Tensor, pairs: ContactPairs
) -> Tensor:
    """Computes repulsion and friction: (vertex, 3, batch) [N]."""
    touch = touching(cloth, contact, position, pairs)
    relative = touch.relative(cloth, velocity)
    approach = -(relative * touch.normal).sum(1)
    damping = cloth.damping[touch.pairs.member]
    v, h = touch.violation, contact.thickness
    push = contact.stiffness * touch.area * (v * v / (2 * h) + damping * v * approach / h)
    push = push.clamp(min=0)
    slide = relative + approach[:, None] * touch.normal
    speed = slide.norm(dim=1)
    mass = cloth.mass[touch.pairs.vertex, touch.pairs.member]
    rub = torch.minimum(
        contact.friction * push / speed.clamp(min=STICKING_SPEED),
        (contact.stiffness * touch.area * mass).sqrt() / 2,
    )
    return touch.spread(cloth, push[:, None] * touch.normal - rub[:, None] * slide, position)


def energy(cloth: Cloth, contact: Contact, position: Tensor, pairs: ContactPairs) -> Tensor:
    """Computes the stored energy k a v³/(6 h): (batch,) [J]."""
    touch = touching(cloth, contact, position, pairs)
    stored = contact.stiffness * touch.area * touch.violation**3 / (6 * contact.thickness)
    return torch.zeros_like(cloth.damping).index_add(0, touch.pairs.member, stored)
