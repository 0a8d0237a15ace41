"""The base model's steps on a graphics processor, one flag a thread block, all steps of a call in
one launch.

The torch source (sim/cloth: membrane.py, bending.py, air.py, system.py;
sim/integrate/symplectic.py) is the definition, as it is of the C++ kernel. Positions, velocities
and everything that threads hand to each other are tiles in shared memory; device memory is read for
what does not change, and for the state before the first step. Warp has no shared
arrays: a thread writes its element of a tile by `tile_scatter_masked`, which all threads of the
block call and which ends with a barrier, and reads any element by `tile_extract`. There are no
atomics; sums at the vertices are gathered in the order of `sim.cloth.cloth_batch.incidence`.

A step has four passes over threads:

1. faces: normal, and for the edge opposite each corner its share in the rate of the fold and its
   inverse altitude;
2. hinges: the moment −k S/2 (θ + d θ̇), from the normals of their faces;
3. faces: stress, air, and the moments of their three edges, as forces on the three corners;
4. vertices: sum of these, springs, kick and drift.

A fold's gradient at the opposite corner is n/h and at the edge's ends −(1 − w) n/h and −w n/h for
each of its faces (see `sim.cloth.bending`), so that a face needs of a hinge only its moment.
"""

# The kernel's body is Warp's language, of which its stubs type a part.
# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false
# pyright: reportIndexIssue=false, reportAttributeAccessIssue=false
# pyright: reportInvalidTypeForm=false, reportGeneralTypeIssues=false
# pyright: reportAssignmentType=false

from __future__ import annotations

import functools
from typing import Any

import warp as wp

wp.config.log_level = wp.LOG_WARNING  # it would greet on stdout, which is for results

THREADS = 256
"""Threads of a block."""
BLOCKS = 3
"""Blocks that a multiprocessor is to hold at once: 68 kB of shared memory each for 651 vertices,
and 80 registers a thread."""
OPTIONS = {"fast_math": True}
"""Of the compiler: divisions and roots are right to two or three units of the last place."""

_MIN_ALTITUDE = wp.constant(1e-3)  # see sim.cloth.bending
_TINY = wp.constant(1e-30)


@wp.struct
class Sheet:
    """A mesh. What has a corner or a component is flat, that index first; two indices share a
    number, the second in its upper half.

    Attributes:
        corner: (3, face) the vertices a and b; c and the hinge of the edge opposite a; the hinges
            of those opposite b and c. An edge of the cloth has the number of hinges.
        gradient: (4, face) ∂/∂u and ∂/∂v of the second corner's shape function, then of the third's
            [1/m].
        area: (face,) at rest [m²].
        end: (hinge,) vertices i and j.
        side: (hinge,) 4 · face + the corner opposite, of the face on the left and of that on the
            right of i→j.
        column, shape: (hinge,) see `sim.cloth.cloth_batch.Cloth`.
        row: (hinge,) place among the bending rows, 0 to 2.
        around: (k, vertex) corner · faces + face, of the faces at each vertex.
        vertex: (vertex,) how many these are, and which handle holds it, counted from 1; 0 for none.
    """

    corner: wp.array(dtype=wp.int32)
    gradient: wp.array(dtype=wp.float32)
    area: wp.array(dtype=wp.float32)
    end: wp.array(dtype=wp.int32)
    side: wp.array(dtype=wp.int32)
    column: wp.array(dtype=wp.float32)
    shape: wp.array(dtype=wp.float32)
    row: wp.array(dtype=wp.float32)
    around: wp.array(dtype=wp.int32)
    vertex: wp.array(dtype=wp.int32)


@wp.struct
class Members:
    """Materials and surroundings.

    Attributes:
        samples: (2 · table · node,) stretching stiffness k0 to k3 [N/m], two to a number: Warp
            reads vectors one component at a time.
        table: (batch,) of each member.
        counts: nodes of a table along G00, G11 and |G01|.
        origin, fineness: of its nodes: where the first is, and how many there are in a unit of
            strain.
        bending: (15, batch) nodes of the three bending rows [N·m].
        symmetric: 1 where bending looks up |curvature|.
        damping: (batch,) d [s].
        inverse_mass: (vertex, batch) [1/kg]; 0 where held rigidly.
        gravity: (3, batch) [m/s²].
        density, drag: of the air.
        stiffness: of the handles [N/m]; 0 where none is a spring.
    """

    samples: wp.array(dtype=wp.int64)
    table: wp.array(dtype=wp.int32)
    counts: wp.vec3i
    origin: float
    fineness: float
    bending: wp.array2d(dtype=wp.float32)
    symmetric: int
    damping: wp.array(dtype=wp.float32)
    inverse_mass: wp.array2d(dtype=wp.float32)
    gravity: wp.array2d(dtype=wp.float32)
    density: float
    drag: float
    stiffness: float


@wp.struct
class Motion:
    """Wind and handles between two times, linear between them; see `sim.cloth.system.Drive`.

    Attributes:
        wind: (2, 3, batch) [m/s].
        targets: (2, held, 3, batch) [m].
        rate: (held, 3, batch) [m/s].
    """

    wind: wp.array3d(dtype=wp.float32)
    targets: wp.array4d(dtype=wp.float32)
    rate: wp.array3d(dtype=wp.float32)


@wp.func
def lower(pair: int):
    return pair & 0xFFFF


@wp.func
def upper(pair: int):
    return (pair >> 16) & 0xFFFF


@wp.func
def locate_cell(place: float, count: int):
    """Finds cell and share of a coordinate of the stretching grid."""
    inside = wp.clamp(place, 0.0, float(count - 1))
    cell = wp.clamp(int(inside), 0, count - 2)
    return cell, inside - float(cell)


@wp.func
def node(members: Members, at: int):
    """Returns k0 to k3 of a node."""
    first = wp.cast(members.samples[2 * at], wp.vec2)
    last = wp.cast(members.samples[2 * at + 1], wp.vec2)
    return wp.vec4(first[0], first[1], last[0], last[1])


@wp.func
def stretching(members: Members, first: int, g00: float, g11: float, g01: float):
    """Interpolates k0 to k3 at a strain."""
    c0, w0 = locate_cell((g00 - members.origin) * members.fineness, members.counts[0])
    c1, w1 = locate_cell((g11 - members.origin) * members.fineness, members.counts[1])
    c2, w2 = locate_cell(wp.abs(g01) * members.fineness, members.counts[2])
    line = members.counts[2]
    plane = members.counts[1] * line
    at = first + c0 * plane + c1 * line + c2
    both = w1 * w2
    last = w1 - both
    middle = w2 - both
    none = 1.0 - w1 - middle
    low = none * node(members, at) + middle * node(members, at + 1)
    low += last * node(members, at + line) + both * node(members, at + line + 1)
    at += plane
    high = none * node(members, at) + middle * node(members, at + 1)
    high += last * node(members, at + line) + both * node(members, at + line + 1)
    return low + w0 * (high - low)


@wp.func
def chosen(each: wp.vec3, index: int):
    """Selects a component."""
    value = wp.where(index == 1, each[1], each[0])
    return wp.where(index == 2, each[2], value)


@functools.cache
def kernel(vertices: int, faces: int, hinges: int) -> Any:
    """Compiles the kernel for meshes of these numbers; tiles have sizes that are known when it is
    compiled.

    Launched by `wp.launch_tiled` with a block a member, of `THREADS` threads, on (sheet, members,
    motion, position, velocity, step, steps), with position and velocity (vertex, 3, batch), which
    it overwrites. On a processor that is no graphics processor a block has one thread, unless
    `warp.config.enable_cpu_blocks` is set.
    """
    count, sides, folds = wp.constant(vertices), wp.constant(faces), wp.constant(hinges)
    corners, places = wp.constant(3 * faces), wp.constant(hinges + 1)

    @wp.kernel(
        module="unique",
        module_options=OPTIONS,
        enable_backward=False,
        launch_bounds=(THREADS, BLOCKS),
    )
    def leapfrog(
        sheet: Sheet,
        members: Members,
        motion: Motion,
        position: wp.array3d(dtype=wp.float32),
        velocity: wp.array3d(dtype=wp.float32),
        step: float,
        steps: int,
    ):
        member, lane = wp.tid()
        lanes = wp.block_dim()
        x = wp.tile_empty(shape=count, dtype=wp.vec3, storage="shared")
        v = wp.tile_empty(shape=count, dtype=wp.vec3, storage="shared")
        inverse_mass = wp.tile_empty(shape=count, dtype=float, storage="shared")
        # Of the faces: normals, rates of folds, inverse altitudes; later forces on the three
        # corners.
        face = wp.tile_empty(shape=corners, dtype=wp.vec3, storage="shared")
        moment = wp.tile_zeros(shape=places, dtype=float, storage="shared")
        bending = wp.tile_empty(shape=15, dtype=float, storage="shared")

        for first in range(0, 15, lanes):
            here = first + lane < 15
            i = wp.min(first + lane, 14)
            wp.tile_scatter_masked(bending, i, members.bending[i, member], here)
        for first in range(0, count, lanes):
            here = first + lane < count
            i = wp.min(first + lane, count - 1)
            xi = wp.vec3(position[i, 0, member], position[i, 1, member], position[i, 2, member])
            vi = wp.vec3(velocity[i, 0, member], velocity[i, 1, member], velocity[i, 2, member])
            wp.tile_scatter_masked(x, i, xi, here)
            wp.tile_scatter_masked(v, i, vi, here)
            wp.tile_scatter_masked(inverse_mass, i, members.inverse_mass[i, member], here)
        damping = members.damping[member]
        table = members.table[member] * members.counts[0] * members.counts[1] * members.counts[2]
        gravity = wp.vec3(
            members.gravity[0, member], members.gravity[1, member], members.gravity[2, member]
        )
        calm = wp.vec3(
            motion.wind[0, 0, member], motion.wind[0, 1, member], motion.wind[0, 2, member]
        )
        change = (
            wp.vec3(motion.wind[1, 0, member], motion.wind[1, 1, member], motion.wind[1, 2, member])
            - calm
        )

        for s in range(steps + 1):
            share = float(s) / float(steps)
            wind = calm + share * change

            for first in range(0, sides, lanes):
                here = first + lane < sides
                e = wp.min(first + lane, sides - 1)
                ab = sheet.corner[e]
                a = lower(ab)
                b = upper(ab)
                c = lower(sheet.corner[sides + e])
                xa = wp.tile_extract(x, a)
                xb = wp.tile_extract(x, b)
                xc = wp.tile_extract(x, c)
                ea = xc - xb
                eb = xa - xc
                ec = xb - xa
                normal = wp.cross(eb, ec)
                doubled = wp.length(normal)
                n = normal / wp.max(doubled, _TINY)
                la = wp.dot(ea, ea)
                lb = wp.dot(eb, eb)
                lc = wp.dot(ec, ec)
                pa = wp.sqrt(la) / wp.max(doubled, _MIN_ALTITUDE * la)
                pb = wp.sqrt(lb) / wp.max(doubled, _MIN_ALTITUDE * lb)
                pc = wp.sqrt(lc) / wp.max(doubled, _MIN_ALTITUDE * lc)
                qa = wp.dot(n, wp.tile_extract(v, a))
                qb = wp.dot(n, wp.tile_extract(v, b))
                qc = wp.dot(n, wp.tile_extract(v, c))
                ra = pa * (qa - qb + wp.dot(ea, ec) / la * (qc - qb))
                rb = pb * (qb - qc + wp.dot(eb, ea) / lb * (qa - qc))
                rc = pc * (qc - qa + wp.dot(ec, eb) / lc * (qb - qa))
                wp.tile_scatter_masked(face, e, n, here)
                wp.tile_scatter_masked(face, sides + e, wp.vec3(ra, rb, rc), here)
                wp.tile_scatter_masked(face, 2 * sides + e, wp.vec3(pa, pb, pc), here)

            for first in range(0, folds, lanes):
                here = first + lane < folds
                h = wp.min(first + lane, folds - 1)
                ends = sheet.end[h]
                edge = wp.tile_extract(x, upper(ends)) - wp.tile_extract(x, lower(ends))
                side = sheet.side[h]
                left = lower(side)
                right = upper(side)
                nl = wp.tile_extract(face, left >> 2)
                nr = wp.tile_extract(face, right >> 2)
                rate = chosen(wp.tile_extract(face, sides + (left >> 2)), left & 3)
                rate += chosen(wp.tile_extract(face, sides + (right >> 2)), right & 3)
                angle = wp.atan2(-wp.dot(edge, wp.cross(nl, nr)) / wp.length(edge), wp.dot(nl, nr))
                column = angle * sheet.column[h]
                if members.symmetric == 1:
                    column = wp.abs(column)
                column = wp.min(column, 4.0)
                knot = wp.clamp(int(column), 0, 3)
                column -= float(knot)
                row = sheet.row[h]
                upon = wp.min(int(row), 1)
                at = 5 * upon + knot
                one = wp.tile_extract(bending, at)
                one += column * (wp.tile_extract(bending, at + 1) - one)
                other = wp.tile_extract(bending, at + 5)
                other += column * (wp.tile_extract(bending, at + 6) - other)
                stiffness = one + (row - float(upon)) * (other - one)
                stiffness = wp.max(stiffness, 0.0) * sheet.shape[h] * 0.5
                wp.tile_scatter_masked(moment, h, -stiffness * (angle + damping * rate), here)

            for first in range(0, sides, lanes):
                here = first + lane < sides
                e = wp.min(first + lane, sides - 1)
                ab = sheet.corner[e]
                c_and = sheet.corner[sides + e]
                others = sheet.corner[2 * sides + e]
                a = lower(ab)
                b = upper(ab)
                c = lower(c_and)
                xa = wp.tile_extract(x, a)
                xb = wp.tile_extract(x, b)
                xc = wp.tile_extract(x, c)
                va = wp.tile_extract(v, a)
                vb = wp.tile_extract(v, b)
                vc = wp.tile_extract(v, c)
                ea = xc - xb
                eb = xa - xc
                ec = xb - xa
                ub = sheet.gradient[e]
                wb = sheet.gradient[sides + e]
                uc = sheet.gradient[2 * sides + e]
                wc = sheet.gradient[3 * sides + e]
                xu = ub * ec - uc * eb
                xw = wb * ec - wc * eb
                vu = ub * (vb - va) + uc * (vc - va)
                vw = wb * (vb - va) + wc * (vc - va)
                g00 = 0.5 * (wp.dot(xu, xu) - 1.0)
                g11 = 0.5 * (wp.dot(xw, xw) - 1.0)
                g01 = 0.5 * wp.dot(xu, xw)
                k = stretching(members, table, g00, g11, g01)
                s00 = g00 + damping * wp.dot(xu, vu)
                s11 = g11 + damping * wp.dot(xw, vw)
                s01 = g01 + damping * 0.5 * (wp.dot(xu, vw) + wp.dot(xw, vu))
                area = sheet.area[e]
                t00 = area * (k[0] * s00 + k[1] * s11)
                t11 = area * (k[2] * s11 + k[1] * s00)
                t01 = area * (k[3] * s01)
                pu = t00 * xu + t01 * xw
                pw = t11 * xw + t01 * xu
                fb = -(ub * pu + wb * pw)
                fc = -(uc * pu + wc * pw)
                fa = -(fb + fc)

                n = wp.tile_extract(face, e)
                p = wp.tile_extract(face, 2 * sides + e)
                third = area / 3.0
                relative = wind - (va + vb + vc) / 3.0
                across = wp.dot(relative, n)
                drag = members.drag * third
                push = (
                    members.density * third * wp.abs(across) * across - drag * across
                ) * n + drag * relative

                ma = wp.tile_extract(moment, upper(c_and)) * p[0]
                mb = wp.tile_extract(moment, lower(others)) * p[1]
                mc = wp.tile_extract(moment, upper(others)) * p[2]
                oa = -wp.dot(ea, ec) / wp.dot(ea, ea) * ma
                ob = -wp.dot(eb, ea) / wp.dot(eb, eb) * mb
                oc = -wp.dot(ec, eb) / wp.dot(ec, ec) * mc
                fa += push + (ma - ob - (mc - oc)) * n
                fb += push + (mb - oc - (ma - oa)) * n
                fc += push + (mc - oa - (mb - ob)) * n
                wp.tile_scatter_masked(face, e, fa, here)
                wp.tile_scatter_masked(face, sides + e, fb, here)
                wp.tile_scatter_masked(face, 2 * sides + e, fc, here)

            kick = step
            if s == 0 or s == steps:
                kick = 0.5 * step
            drift = step
            if s == steps:
                drift = 0.0
            for first in range(0, count, lanes):
                here = first + lane < count
                i = wp.min(first + lane, count - 1)
                xi = wp.tile_extract(x, i)
                vi = wp.tile_extract(v, i)
                force = wp.vec3(0.0, 0.0, 0.0)
                about = sheet.vertex[i]
                for q in range(lower(about)):
                    force += wp.tile_extract(face, sheet.around[q * count + i])
                handle = upper(about) - 1
                if handle >= 0 and members.stiffness > 0.0:
                    for axis in range(3):
                        start = motion.targets[0, handle, axis, member]
                        end = motion.targets[1, handle, axis, member]
                        moved = vi[axis] - motion.rate[handle, axis, member]
                        stretch = xi[axis] - (start + share * (end - start)) + damping * moved
                        force[axis] = force[axis] - members.stiffness * stretch
                weight = wp.tile_extract(inverse_mass, i)
                acceleration = weight * force
                if weight > 0.0:
                    acceleration += gravity
                vi += kick * acceleration
                xi += drift * vi
                wp.tile_scatter_masked(x, i, xi, here)
                wp.tile_scatter_masked(v, i, vi, here)

        for first in range(0, count, lanes):
            here = first + lane < count
            if here:
                i = first + lane
                xi = wp.tile_extract(x, i)
                vi = wp.tile_extract(v, i)
                for axis in range(3):
                    position[i, axis, member] = xi[axis]
                    velocity[i, axis, member] = vi[axis]

    return leapfrog
