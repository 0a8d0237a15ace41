"""A cloth of MuJoCo's flex in a wind, simulated in MuJoCo's own environment: `python -I worker.py
job.npz made.npz`.

This script imports nothing of flagdata. What it simulates is MuJoCo's: a deformable surface of
piecewise linear elements with a Saint Venant–Kirchhoff membrane, hinges with the energy of
Kirchhoff's plate and Rayleigh damping (MuJoCo 4.0, XML reference, flex/elasticity), on point
masses, by MuJoCo's integrators. MuJoCo's own fluid model acts on the inertia boxes and ellipsoids
of bodies; the vertices of a flex are points without a normal, so that it knows no sail. The wind's
force is therefore applied to the vertices at each step, as a generalised force.

On a face of rest area a with deformed unit normal n, w = wind − face velocity, w_n = w·n, w_t = w −
w_n n, it is

    a [p |w_n| w_n n + l w_n (|w| n − w_n w/|w|) + c w_t + q |w_t| w_t + m |w| (z × w)],

a third on each corner: pressure p, lift l of a plate in attached flow, linear and quadratic
tangential drag c and q, and m across the wind, about the vertical z, as a spinning body has it
(Magnus). A share s of the pressure lags behind (Jones' fit to Wagner's function, NACA report 681),
and on a grid the air may have inertia, see `Carried`.

What it cannot do: stiffness is isotropic and constant, where measured cloth is orthotropic and
stiffens with strain; attachments are rigid; there is no contact of the cloth with itself; air that
moves with the cloth is there for the explicit integrator alone. Forces of the wind are taken at the
start of each step.
"""

import json
import sys
from importlib import import_module
from typing import Any

import numpy as np

mj: Any = import_module("mujoco")  # it is not in the environment that this file is checked in

VERSION = "4.0.0"


def model_of(job, settings):
    """The compiled model: one body with three sliders for each free vertex, its mass that of the
    vertex's share."""
    points = " ".join(f"{value:.17g}" for value in job["reference"].ravel())
    faces = " ".join(str(value) for value in job["faces"].ravel())
    held = " ".join(str(value) for value in job["held"])
    pins = f'<pin id="{held}"/>' if held else ""
    # Sparse Newton is the solver that assembles the stiffness of the flex; there are no constraints
    # to solve for.
    text = f"""<mujoco>
      <option timestep="{settings["step"]:.17g}" integrator="{settings["integrator"]}" solver="Newton"
        gravity="0 0 {-settings["gravity"]:.17g}"/>
      <worldbody>
        <flexcomp name="cloth" type="direct" dim="2" mass="1" radius="0.001" point="{points}" element="{faces}">
          <contact selfcollide="none" contype="0" conaffinity="0"/>
          <elasticity young="{settings["young"]:.17g}" poisson="{settings["poisson"]:.17g}" elastic2d="both"
            thickness="{settings["thickness"]:.17g}" damping="{settings["damping"]:.17g}"/>
          {pins}
        </flexcomp>
      </worldbody>
    </mujoco>"""
    model = mj.MjModel.from_xml_string(text)
    free = np.setdiff1d(np.arange(len(job["start"])), job["held"])
    bodies = model.flex_vertbodyid[free]
    model.body_mass[bodies] = job["mass"][free]
    mj.mj_setConst(model, mj.MjData(model))
    return model, free


class Lag:
    """What the pressure on each face lags by: żᵢ = (2 |w|/L) bᵢ (F − zᵢ), and s Σ Aᵢ (F − zᵢ) is
    missing."""

    def __init__(self, share, length, faces):
        self.share, self.length, self.past = share, length, np.zeros((2, faces, 1))

    def missing(self, load, speed, step):
        """Of a load (face, 1), which is remembered from the next step on."""
        held_back = 0.165 * (load - self.past[0]) + 0.335 * (load - self.past[1])
        for past, rate in zip(self.past, (0.0455, 0.3), strict=True):
            past += -np.expm1(-rate * 2 * speed / self.length * step) * (load - past)
        return self.share * held_back


def slopes(at):
    """(n, n) that makes values at places their derivatives, by polynomials through the five
    nearest."""
    matrix = np.zeros((len(at), len(at)))
    for row, place in enumerate(at):
        near = np.argsort(np.abs(at - place), kind="stable")[:5]
        matrix[row, near] = np.linalg.solve(
            np.vander(at[near] - place, increasing=True).T, np.arange(5) == 1
        )
    return matrix


class Carried:
    """The inertia of the air beside a flag of finite height: −m (∂t + U ∂x)² η with a mass for each
    wavenumber,

        m(k) = c/((k/2)^(3/2) + (4/(π H))^(3/2))^(2/3),

    on a grid of vertices, by its differences. Over the height the load is √e F[√e D V] with e an
    ellipse of mean 1; F takes D V apart into as many cosines as two cells each resolve. D V = n·a +
    ṅ·(v − u) + s·∇V + ½ V ∇·s for the velocity across V = (v − u)·n and the slip along s; the first
    term is a mass of each vertex, that of k = π/L.
    """

    def __init__(self, share, rest, areas):
        self.order = np.lexsort((rest[:, 1].round(9), rest[:, 0].round(9)))
        self.u, self.v = (np.unique(rest[:, axis].round(9)) for axis in (0, 1))
        self.shape = (len(self.u), len(self.v))
        length, height = np.ptp(self.u), np.ptp(self.v)
        self.slopes = [slopes(at) for at in (self.u, self.v)]
        self.areas = areas[self.order].reshape(self.shape)
        across = 2 * (self.v - self.v[0]) / height - 1
        profile = np.sqrt(np.clip(1 - across**2, 0, None)) * np.ones(self.shape)
        self.profile = profile * self.areas.sum() / (profile * self.areas).sum()
        waves = [np.arange((len(at) - 1) // 2) * np.pi / np.ptp(at) for at in (self.u, self.v)]
        self.modes = [
            np.cos(np.outer(k, at - at[0])) for k, at in zip(waves, (self.u, self.v), strict=True)
        ]
        k = np.hypot(waves[0][:, None], waves[1])
        squares = np.einsum("au,bv,uv->ab", self.modes[0] ** 2, self.modes[1] ** 2, self.areas)
        self.masses = share / ((k / 2) ** 1.5 + (4 / (np.pi * height)) ** 1.5) ** (2 / 3) / squares
        longest = share / ((np.pi / length / 2) ** 1.5 + (4 / (np.pi * height)) ** 1.5) ** (2 / 3)
        self.mass = np.empty(len(rest))
        self.mass[self.order] = (longest * self.profile * self.areas).ravel()

    def field(self, values):
        """(vertex, 3) as the grid has it."""
        return values[self.order].reshape(*self.shape, 3)

    def along(self, values):
        """Derivatives along u and v."""
        return np.einsum("ij,jv...->iv...", self.slopes[0], values), np.einsum(
            "ij,uj...->ui...", self.slopes[1], values
        )

    def normals(self, position):
        """Unit normals on the grid, the tangents, and the length of their product."""
        first, second = self.along(self.field(position))
        product = np.cross(first, second)
        size = np.sqrt((product**2).sum(-1, keepdims=True))
        return product / size, (first, second), size

    def load(self, position, velocity, wind):
        """(vertex, 3) without the term of the acceleration [N]."""
        normal, tangents, size = self.normals(position)
        rates = self.along(self.field(velocity))
        turning = (np.cross(rates[0], tangents[1]) + np.cross(tangents[0], rates[1])) / size
        turning -= (turning * normal).sum(-1, keepdims=True) * normal
        relative = self.field(velocity) - wind
        across = (relative * normal).sum(-1)
        slip = across[..., None] * normal - relative
        following = sum(
            (slip * t).sum(-1) * d for t, d in zip(tangents, self.along(across), strict=True)
        )
        spreading = sum((t * d).sum(-1) for t, d in zip(tangents, self.along(slip), strict=True))
        rate = (turning * relative).sum(-1) + following + across * spreading / 2
        root = np.sqrt(self.profile)
        parts = np.einsum("au,bv,uv->ab", *self.modes, root * rate * self.areas) * self.masses
        smooth = root * np.einsum("au,bv,ab->uv", *self.modes, parts)
        force = np.empty_like(position)
        force[self.order] = (-(self.areas * smooth)[..., None] * normal).reshape(-1, 3)
        return force

    def shared(self, position, force, mass):
        """(vertex, 3) what a force on cloth and air loses to the air, so that the rest gives the
        cloth's mass its acceleration."""
        normal = np.empty_like(position)
        normal[self.order] = self.normals(position)[0].reshape(-1, 3)
        part = self.mass / (mass + self.mass)
        return -(part * (normal * force).sum(1))[:, None] * normal


def push(position, velocity, wind, faces, areas, air, lag=None, step=0.0):
    """(vertex, 3) force of the wind [N]."""
    first, second, third = position[faces[:, 0]], position[faces[:, 1]], position[faces[:, 2]]
    normal = across_both(second - first, third - first)
    normal /= np.maximum(
        np.sqrt((normal * normal).sum(axis=1, keepdims=True)), np.finfo(float).tiny
    )
    relative = wind - (velocity[faces[:, 0]] + velocity[faces[:, 1]] + velocity[faces[:, 2]]) / 3
    across = (relative * normal).sum(axis=1, keepdims=True)
    along = relative - across * normal
    slip = np.sqrt((along * along).sum(axis=1, keepdims=True))
    speed = np.maximum(
        np.sqrt((relative * relative).sum(axis=1, keepdims=True)), np.finfo(float).tiny
    )
    load = air["pressure"] * np.abs(across) * across
    force = load * normal
    if lag is not None:
        force -= lag.missing(load, speed, step) * normal
    force += air["lift"] * across * (speed * normal - across / speed * relative)
    force += (air["linear"] + air["quadratic"] * slip) * along
    force[:, 0] -= air["side"] * speed[:, 0] * relative[:, 1]
    force[:, 1] += air["side"] * speed[:, 0] * relative[:, 0]
    third = areas[:, None] / 3 * force
    corners = faces.T.ravel()
    return np.stack(
        [np.bincount(corners, np.tile(part, 3), len(position)) for part in third.T], axis=1
    )


def across_both(a, b):
    """Vector products of rows."""
    return a[:, [1, 2, 0]] * b[:, [2, 0, 1]] - a[:, [2, 0, 1]] * b[:, [1, 2, 0]]


def fly(job, settings):
    """Positions and velocities of the frames that are kept, (frame, vertex, 3) each."""
    model, free = model_of(job, settings)
    data = mj.MjData(model)
    data.qpos[:] = (job["start"] - job["reference"])[free].ravel()
    steps = round(settings["period"] / settings["step"])
    if abs(steps * settings["step"] - settings["period"]) > 1e-9 * settings["period"]:
        raise ValueError(
            f"a period of {settings['period']} s is not a whole number of steps of "
            f"{settings['step']} s"
        )
    faces, areas, air = job["faces"], job["areas"], settings["air"]
    rest, mass = job["rest"], job["mass"][free]
    lag = Lag(air["lag"], np.ptp(rest[:, 0]), len(faces)) if air["lag"] else None
    carried = Carried(air["carried"], rest, job["vertex_areas"]) if air["carried"] else None
    if carried is not None and settings["integrator"] != "Euler":
        raise ValueError("air that moves with the cloth needs MuJoCo's integrator Euler")
    position, velocity = job["start"].copy(), np.zeros_like(job["start"])
    frames, speeds = [], []
    for frame in range(settings["settle"] + settings["frames"]):
        for step in range(steps):
            now = (frame + step / steps - settings["settle"]) * settings["period"]
            position[free] = job["reference"][free] + data.qpos.reshape(-1, 3)
            velocity[free] = data.qvel.reshape(-1, 3)
            wind = [np.interp(now, job["wind_times"], job["wind"][:, axis]) for axis in range(3)]
            force = push(
                position, velocity, np.array(wind), faces, areas, air, lag, settings["step"]
            )
            if carried is not None:
                force += carried.load(position, velocity, np.array(wind))
            data.qfrc_applied[:] = force[free].ravel()
            if carried is not None:  # all forces are known by what they would accelerate
                mj.mj_forward(model, data)
                whole = np.zeros_like(force)
                whole[free] = mass[:, None] * data.qacc.reshape(-1, 3)
                data.qfrc_applied[:] += carried.shared(position, whole, job["mass"])[free].ravel()
            if step == 0 and frame >= settings["settle"]:
                frames.append(position.copy())
                speeds.append(velocity.copy())
            mj.mj_step(model, data)
        if any(warning.number for warning in data.warning):
            raise ValueError(
                f"MuJoCo warns of an unstable state {frame * settings['period']:.3g} s after the "
                "start"
            )
    return np.array(frames), np.array(speeds)


def main(job_path, made_path):
    if mj.__version__ != VERSION:
        raise ValueError(
            f"this is MuJoCo {mj.__version__}, and the worker is written for {VERSION}"
        )
    with np.load(job_path) as content:
        job = {name: content[name] for name in content.files}
    settings = json.loads(str(job.pop("settings")))
    positions, velocities = fly(job, settings)
    np.savez(made_path, positions=positions, velocities=velocities)


if __name__ == "__main__":
    main(*sys.argv[1:])
