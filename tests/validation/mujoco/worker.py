"""A cloth of MuJoCo's flex in a wind, simulated in MuJoCo's own environment: `python -I worker.py job.npz made.npz`.

This script imports nothing of flagdata. What it simulates is MuJoCo's: a deformable surface of piecewise linear
elements with a Saint Venant–Kirchhoff membrane, hinges with the energy of Kirchhoff's plate and Rayleigh damping
(MuJoCo 4.0, XML reference, flex/elasticity), on point masses, by MuJoCo's integrators. MuJoCo's own fluid model acts on
the inertia boxes and ellipsoids of bodies; the vertices of a flex are points without a normal, so that it knows no
sail. The wind's force is therefore applied to the vertices at each step, as a generalised force.

On a face of rest area a with deformed unit normal n, w = wind − face velocity, w_n = w·n, w_t = w − w_n n, it is

    a [p |w_n| w_n n + l w_n (|w| n − w_n w/|w|) + c w_t + q |w_t| w_t + m |w| (z × w)],

a third on each corner: pressure p, lift l of a plate in attached flow, linear and quadratic tangential drag c and q,
and m across the wind, about the vertical z, as a spinning body has it (Magnus).

What it cannot do: stiffness is isotropic and constant, where measured cloth is orthotropic and stiffens with strain;
attachments are rigid; there is no contact of the cloth with itself and no air that moves with the cloth. Forces of the
wind are taken at the start of each step.
"""

import json
import sys
from importlib import import_module
from typing import Any

import numpy as np

mj: Any = import_module("mujoco")  # it is not in the environment that this file is checked in

VERSION = "4.0.0"


def model_of(job, settings):
    """The compiled model: one body with three sliders for each free vertex, its mass that of the vertex's share."""
    points = " ".join(f"{value:.17g}" for value in job["reference"].ravel())
    faces = " ".join(str(value) for value in job["faces"].ravel())
    held = " ".join(str(value) for value in job["held"])
    pins = f'<pin id="{held}"/>' if held else ""
    # Sparse Newton is the solver that assembles the stiffness of the flex; there are no constraints to solve for.
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


def push(position, velocity, wind, faces, areas, air):
    """(vertex, 3) force of the wind [N]."""
    first, second, third = position[faces[:, 0]], position[faces[:, 1]], position[faces[:, 2]]
    normal = across_both(second - first, third - first)
    normal /= np.maximum(np.sqrt((normal * normal).sum(axis=1, keepdims=True)), np.finfo(float).tiny)
    relative = wind - (velocity[faces[:, 0]] + velocity[faces[:, 1]] + velocity[faces[:, 2]]) / 3
    across = (relative * normal).sum(axis=1, keepdims=True)
    along = relative - across * normal
    slip = np.sqrt((along * along).sum(axis=1, keepdims=True))
    speed = np.maximum(np.sqrt((relative * relative).sum(axis=1, keepdims=True)), np.finfo(float).tiny)
    force = air["pressure"] * np.abs(across) * across * normal
    force += air["lift"] * across * (speed * normal - across / speed * relative)
    force += (air["linear"] + air["quadratic"] * slip) * along
    force[:, 0] -= air["side"] * speed[:, 0] * relative[:, 1]
    force[:, 1] += air["side"] * speed[:, 0] * relative[:, 0]
    third = areas[:, None] / 3 * force
    corners = faces.T.ravel()
    return np.stack([np.bincount(corners, np.tile(part, 3), len(position)) for part in third.T], axis=1)


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
        raise ValueError(f"a period of {settings['period']} s is not a whole number of steps of {settings['step']} s")
    faces, areas, air = job["faces"], job["areas"], settings["air"]
    position, velocity = job["start"].copy(), np.zeros_like(job["start"])
    frames, speeds = [], []
    for frame in range(settings["settle"] + settings["frames"]):
        for step in range(steps):
            now = (frame + step / steps - settings["settle"]) * settings["period"]
            position[free] = job["reference"][free] + data.qpos.reshape(-1, 3)
            velocity[free] = data.qvel.reshape(-1, 3)
            wind = [np.interp(now, job["wind_times"], job["wind"][:, axis]) for axis in range(3)]
            force = push(position, velocity, np.array(wind), faces, areas, air)
            data.qfrc_applied[:] = force[free].ravel()
            if step == 0 and frame >= settings["settle"]:
                frames.append(position.copy())
                speeds.append(velocity.copy())
            mj.mj_step(model, data)
        if any(warning.number for warning in data.warning):
            raise ValueError(f"MuJoCo warns of an unstable state {frame * settings['period']:.3g} s after the start")
    return np.array(frames), np.array(speeds)


def main(job_path, made_path):
    if mj.__version__ != VERSION:
        raise ValueError(f"this is MuJoCo {mj.__version__}, and the worker is written for {VERSION}")
    with np.load(job_path) as content:
        job = {name: content[name] for name in content.files}
    settings = json.loads(str(job.pop("settings")))
    positions, velocities = fly(job, settings)
    np.savez(made_path, positions=positions, velocities=velocities)


if __name__ == "__main__":
    main(*sys.argv[1:])
