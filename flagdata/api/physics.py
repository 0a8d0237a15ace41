"""The physics from Python: cloth simulated, filmed, measured, calibrated, and judged.

Each call is a door to what the command of its name does. The packages behind them are named by strings: flagdata
imports none of those that rest on it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flagdata.api.lakes import AnyLake, opened
from flagdata.arguments import checked
from flagdata.errors import UsageError
from flagdata.parts import call

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from flagdata.calibrated import Calibrated
    from flagdata.closed import Closed
    from flagdata.film_array import Frames
    from flagdata.lake.meshes import MeshSequence, RaggedMeshSequence
    from flagdata.measured import Measured
    from flagdata.simulated import Simulated
    from flagdata.stated import Stated

_TABLES = ("scene", "material", "wind", "contact", "limits", "integrator", "time", "effects")


@checked
def simulate(
    recipe: str | Path | Mapping[str, Any] | None = None,
    *,
    scene: Mapping[str, Any] | None = None,
    material: Mapping[str, Any] | None = None,
    wind: Mapping[str, Any] | None = None,
    time: Mapping[str, Any] | None = None,
    effects: Mapping[str, Mapping[str, Any]] | None = None,
    contact: Mapping[str, Any] | None = None,
    limits: Mapping[str, Any] | None = None,
    integrator: Mapping[str, Any] | None = None,
    count: int | None = None,
    seed: int | None = None,
    batch: int | None = None,
    precision: str | None = None,
    device: str = "cpu",
    workers: int = 1,
) -> Simulated:
    """Cloth in the wind as arrays; nothing is written. `flagdata simulate` keeps the same members in a lake.

    ```python
    flags = flagdata.simulate(wind={"speed": 5.0}, time={"frames": 50}, effects={"lift": {"coefficient": 1.0}})
    flags.positions, flags.time  # (member, frame, vertex, 3) m with z up, (frame,) s
    ```

    Args:
        recipe: name of a recipe of the catalog, path of a TOML file, or its content as a dict; None for what is given
            beside it alone, and defaults: a flag of 1.5 m × 1 m on two corners, of the knit "camel-ponte-roma".
        scene, material, wind, time, effects, contact, limits, integrator: tables of a recipe with its keys, SI and
            radians, in place of those of `recipe`: `wind={"speed": 5.0}`. A value may be a range that each member
            draws from, `{"low": 2.0, "high": 8.0}`. `docs/simulator.md` lists the keys.
        count: of members.
        seed: of all that is drawn.
        batch: members that are simulated together.
        precision: "float32" or "float64".
        device: "cpu" or "cuda".
        workers: batches at a time.

    Raises:
        MissingExtraError: torch is not installed.
        UnknownNameError: a recipe, key, material or effect that is not known.
        InputError: a value that does not fit, or no member that was simulated to the end.
        LimitError: more than a recipe may ask for.
    """
    tables = dict(zip(_TABLES, (scene, material, wind, contact, limits, integrator, time, effects), strict=True))
    whole = {"count": count, "seed": seed, "batch": batch, "precision": precision}
    given = {name: value for name, value in {**tables, **whole}.items() if value is not None}
    source = str(recipe) if isinstance(recipe, Path) else recipe
    return call("sim.run.arrays:simulated", source, given, device=device, workers=workers)


@checked
def render(
    sequence: MeshSequence | RaggedMeshSequence,
    *,
    look: str = "outdoor",
    seed: int = 0,
    width: int = 300,
    height: int = 300,
    parameters: Mapping[str, float] | None = None,
    cloth: str = "flag",
    heading: float | None = None,
    renderer: str = "raster",
    photos: Path | str | None = None,
) -> Frames:
    """A moving mesh as a camera sees it, in colour.

    ```python
    film = flagdata.render(flagdata.simulate(wind={"speed": 5.0})[0])
    film.images  # (frame, height, width, 3) uint8 sRGB
    ```

    Args:
        sequence: a member of what `simulate` returns, or what `meshes` does.
        look: what light, camera, texture and background are drawn from: a name of catalogs/renders.
        seed: of these draws.
        width, height: of the picture [px].
        parameters: render parameters in place of those drawn, by name, SI and radians: `{"camera_radius": 8.0}`.
        cloth: "flag", or "hanging-cloth".
        heading: where the air goes to, counter-clockwise from +x [rad]; None for what the sequence states, else 0.
        renderer: "raster"; "cycles" or "workbench" where `flagdata blender-setup` was run.
        photos: folder of photographs as backgrounds.

    Raises:
        MissingExtraError: torch is not installed.
        UnknownNameError: a look, renderer or parameter that is not known.
        InputError: a value that is not admissible, or cloth behind the camera.
    """
    own = {"width": width, "height": height, **(parameters or {})}
    return call(
        "sim.render.film:rendered",
        sequence,
        look=look,
        parameters=own,
        cloth=cloth,
        heading=heading,
        renderer=renderer,
        photos=None if photos is None else Path(photos),
        seed=seed,
    )


@checked
def measure(
    source: Path | str | Frames,
    *,
    flag_size: tuple[float, float] | None = None,
    area_weight: float | tuple[float, float] | str | Stated | None = None,
    material: str | None = None,
    step: float | None = None,
    crop: tuple[int, int, int, int] | None = None,
    flag: int | None = None,
    start: float | None = None,
    end: float | None = None,
    true_fps: float | None = None,
    sequence_fps: float | None = None,
    level: float = 0.9,
    seed: int = 0,
    model: str | None = None,
    false_alarm: float = 0.05,
    lake: AnyLake | None = None,
    at: str | None = None,
    anyway: bool = False,
) -> Measured:
    """Wind and area weight of a film of a flag, as `flagdata measure` gives them; nothing is written.

    ```python
    found = flagdata.measure("flag.mp4", flag_size=(1.5, 1.0), area_weight="0.19±0.01")
    found.wind.value, found.wind.interval  # m/s
    ```

    A film unlike those the network was trained on is refused: it is returned with `refused` and the reasons, and asking
    it for values raises `RefusedError`.

    Args:
        source: a video file, a folder of images, `example:NAME`, frames as `frames` and `render` return them, or a
            recording, clip or camera of the lake by its name or id.
        flag_size: length along the wind and height along the pole [m]; of a hanging cloth width and height. None for
            what an example states.
        area_weight: of the cloth [kg/m²]: a value, a range (low, high), or a text such as "0.284±0.01".
        material: instead, the name of a cloth whose area weight is taken.
        step: from one window to the next [s]; by default windows follow each other.
        crop: region in which the flag is: x, y, width, height [px].
        flag: number of the moving cloth; by default the one that moves most.
        start, end: part of the film [s].
        true_fps: rate at which a high-speed camera really ran [Hz].
        sequence_fps: rate of a folder of images [Hz].
        level: of the intervals.
        seed: of all draws; the same film, options and seed give the same draws.
        model: name or folder of the network, or its name or id in the lake.
        false_alarm: share of familiar films that the gate may refuse.
        lake: the lake that names films, fabrics and networks.
        at: tag, branch or version of the lake.
        anyway: whether the values of a refused film are returned too, if anything moves in it.

    Raises:
        MissingExtraError: torch is not installed.
        UsageError: options that contradict each other, or values that no flag has.
        NotFoundError: no such film, lake or network.
        RefusedError: a film that is too slow, or whose frames repeat too often, so that no window of it can be looked
            at and there is nothing to return.
        InputError: a file that is no film, or a film that is too short.
    """
    return call(
        "measure.commands.measuring:measured",
        source,
        flag_size=flag_size,
        area_weight=area_weight,
        material=material,
        step=step,
        crop=crop,
        flag=flag,
        start=start,
        end=end,
        true_fps=true_fps,
        sequence_fps=sequence_fps,
        level=level,
        seed=seed,
        model=model,
        false_alarm=false_alarm,
        lake=None if lake is None else opened(lake).lake,
        at=at,
        anyway=anyway,
    )


@checked
def calibrate(
    recordings: Mapping[str, ArrayLike] | Path | str | Sequence[Mapping[str, ArrayLike] | Path | str],
    *,
    flag_size: tuple[float, float],
    attachment: str = "corners",
    azimuth_deg: float | tuple[float, float] | str | Stated | None = None,
    elevation_deg: float | tuple[float, float] | str | Stated | None = None,
    distance: float | None = None,
    start: float = 0.0,
    end: float | None = None,
    crop: tuple[int, int, int, int] | None = None,
    flag: int | None = None,
    material: str | None = None,
    log: str | None = None,
    offset: float | tuple[float, float] | str | Stated | None = None,
    simulations: int = 128,
    level: float = 0.9,
    seed: int = 0,
    workers: int = 1,
    lake: AnyLake | None = None,
    at: str | None = None,
    cache: Path | str | None = None,
) -> Calibrated:
    """The cloth of a flag from its motion and the wind beside it, as `flagdata calibrate` weighs it.

    ```python
    table = {"time": time, "wind": wind, "droop": droop, "extension": extension, "frequency": frequency}
    found = flagdata.calibrate(table, flag_size=(1.5, 1.0), azimuth_deg="70±7")
    found.quantities["density"].interval  # kg/m²
    ```

    It simulates `simulations` flags for each recording, which takes minutes; they are kept for the next call.

    Args:
        recordings: one or several of one flag, each a table of observables as arrays of one length, in the units that
            `docs/weighing.md` lists (`time` [s], `wind` [m/s], `droop` [rad], …); the path of such a table; or a
            recording of the lake by its name or id.
        flag_size: length along the wind and height along the pole [m].
        attachment: "corners" or "hoist".
        azimuth_deg, elevation_deg: of the camera's axis to the wind [°]: a value, a range, or a text such as "70±7";
            None where nobody knows.
        distance: of the camera from the flag [m]; None for 15 m.
        start, end: part of each recording [s].
        crop, flag: of films, as for `measure`.
        material: what the flag is made of, as in "woven-polyester", "knit" or "camel-ponte-roma"; None for any fabric.
        log, offset: of a table without wind: a log of the lake, and what is added to the table's clock to reach the
            log's [s].
        simulations: for each recording.
        level: of the intervals.
        seed: of all draws.
        workers: processes that simulate.
        lake: the lake that names recordings and logs.
        at: its branch; None is main.
        cache: folder where simulations are kept; None for the user's.

    Raises:
        MissingExtraError: torch is not installed.
        InputError: a table that cannot be used, or a log that does not cover it.
        NotFoundError: no such recording or lake.
        RefusedError: no flag is found in a film.
        UnknownNameError: a material like which no cloth was measured.
        UsageError: options that do not fit.
    """
    several = [recordings] if isinstance(recordings, Mapping | Path | str) else list(recordings)
    return call(
        "measure.calibrate.arrays:calibrated",
        several,
        flag_size=flag_size,
        attachment=attachment,
        azimuth_deg=azimuth_deg,
        elevation_deg=elevation_deg,
        distance=distance,
        start=start,
        end=end,
        crop=crop,
        flag=flag,
        material=material,
        log=log,
        offset=offset,
        simulations=simulations,
        level=level,
        seed=seed,
        workers=workers,
        lake=None if lake is None else opened(lake).lake,
        at=at,
        cache=None if cache is None else Path(cache),
    )


@checked
def close_loop(
    recordings: ArrayLike | MeshSequence | Sequence[ArrayLike | MeshSequence],
    *,
    wind: float | tuple[float, float, float] | tuple[ArrayLike, ArrayLike] | Sequence[Any],
    rest: ArrayLike | None = None,
    rate: float | None = None,
    material: str = "camel-ponte-roma",
    pins: str | Sequence[tuple[float, float]] = "hoist-corners",
    size: tuple[float, float] | None = None,
    density_uncertainty: float | None = None,
    noise: float | None = None,
    level: float | None = None,
    nulls: int | None = None,
    seed: int = 0,
    workers: int = 1,
) -> Closed:
    """What the model of a tracked cloth lacks, as `flagdata close-loop` finds it.

    ```python
    verdict = flagdata.close_loop([slow, fast], rest=rest, rate=25.0, wind=[4.0, 7.0], material="camel-ponte-roma")
    verdict.named, verdict.strengths  # ("lift",), {"lift": coefficient 1.4 [0.8, 2.0]}
    ```

    It simulates null experiments, which takes minutes.

    Args:
        recordings: of one cloth, each positions of its markers (frame, marker, 3) [m], z up, NaN where a marker was not
            tracked; or a mesh sequence, which knows its rest coordinates and rate. One array of four axes is several.
        wind: one for all, or a list with one for each: a speed along +x [m/s], a velocity (x, y, z) [m/s], or a pair of
            times (n,) [s] since the first frame and velocities (n, 3) [m/s].
        rest: (marker, 2) places on the flat cloth [m], u from the hoist, v upwards.
        rate: frames a second [Hz].
        material: nominal, of catalogs/materials.
        pins: "hoist-corners", "top-corners", "hoist", or places (u, v) on the flat cloth [m].
        size: width and height of the flat cloth [m]; None for the outline of the markers.
        density_uncertainty: relative standard uncertainty of the material's area weight; None for 0.3.
        noise: standard deviation of a coordinate [m]; None to estimate it.
        level: of the test of the base model; None for the usual one.
        nulls: null recordings to simulate; None for as many as the test needs.
        seed: of the nulls.
        workers: processes that simulate.

    Raises:
        MissingExtraError: torch is not installed.
        InputError: recordings that cannot be used, with the reason.
        UnknownNameError: a material that is not in the catalog.
        UsageError: winds that do not fit the recordings, or nulls that cannot test the level.
    """
    if (rest is None) != (rate is None):
        raise UsageError("rest= without rate=, or the other way round", where="recordings", fix="give both")
    return call(
        "measure.closing.arrays:closed",
        recordings,
        wind=wind,
        rest=rest,
        rate=rate,
        material=material,
        pins=pins,
        size=size,
        density_uncertainty=density_uncertainty,
        noise=noise,
        level=level,
        nulls=nulls,
        seed=seed,
        workers=workers,
    )
