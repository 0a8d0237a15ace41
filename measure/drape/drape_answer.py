"""A cloth from folders of its drapes and its weight: what `flagdata calibrate` says of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from flagdata.answer import Figure, Head, Quantity, Section, Table, Tone
from flagdata.answer.calibrated import Calibrated
from flagdata.answer.charts import Chart
from flagdata.api.measuring_verbs import Calibrating
from flagdata.core.arrays import FloatArray
from flagdata.core.files.addresses import local_path
from flagdata.core.findings import Finding, Severity
from flagdata.core.json_values import json_values
from flagdata.core.rng import stream
from flagdata.core.stated import Stated
from flagdata.errors import InputError, NotFoundError, RefusedError, UsageError
from flagdata.ingest.meshes import read_obj
from flagdata.recipes.typed_tables import Range, Scale
from measure.cloth import (
    Uncertain,
    arrays_of_draws,
    folder_of,
    phrase_quantity,
    posterior_panel,
    quantity,
    table_of_quantities,
)
from measure.drape.drape_shape import place_scan, shape_of
from measure.drape.drape_simulation import ANISOTROPY, BENDING_LENGTH, SHEAR, simulated_drapes
from measure.drape.fit import UNLIKE, Face, Fit, Model, Surface, fit_drapes, together
from sim.cloth.mesh import Mesh
from sim.cloth.scene import GRAVITY
from sim.run.cusick_drape import DISC, PEDESTAL

_LOST = 0.03
"""Share of the area from which on a scan that lacks it is reported."""

_LIGHTEST = 1e-3
"""Share of the stated weight below which no draw of it is: none is negative."""
_FEWEST = 50
"""Independent draws below which an interval is reported with a warning."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Draped:
    """What drapes say of a cloth.

    Attributes:
        area_weight: as it was stated [kg/m²].
        faces: the drapes of one face, or of two.
        fit: of all of them as of one cloth.
        cloth: by their names bending length and bending of the mean of warp and weft, their ratio's
            logarithm, shear over weight.
        about: the same before the drapes, with the priors.
        draws: name → (n,) of the posterior.
        findings: what a reader has to know.
        level: of the intervals.
    """

    JSON_NAMES: ClassVar[tuple[str, ...]] = (
        "sentence",
        "cloth",
        "drapes=faces",
        "area_weight_stated=stated",
        "direction_deg=direction",
        "misfit=fit.tail",
        "effective_draws=fit.effective",
        "findings",
    )

    area_weight: Stated
    faces: tuple[Face, ...]
    fit: Fit
    cloth: Mapping[str, Quantity]
    about: tuple[Uncertain, ...]
    draws: Mapping[str, FloatArray]
    level: float
    findings: tuple[Finding, ...] = field(default_factory=tuple)

    @property
    def bending(self) -> Quantity:
        """Returns the bending."""
        return self.cloth["bending"]

    @property
    def length(self) -> Quantity:
        """Returns the bending length."""
        return self.cloth[BENDING_LENGTH.name]

    @property
    def count(self) -> int:
        """Returns the number of drapes."""
        return sum(face.count for face in self.faces)

    @property
    def stated(self) -> Any:
        """Returns the weight as JSON states it."""
        return self.area_weight.recipe()

    @property
    def direction(self) -> float:
        """Returns that of the stiffer thread [°]."""
        return float(np.degrees(self.fit.direction))

    @property
    def sentence(self) -> str:
        """Returns the answer in words."""
        count, length, bending = self.count, self.length, self.bending
        if bending.value is None:
            phrase = length.span.word(lambda value: f"{value * 1e3:.1f}", " mm")
            return f"bending length {phrase}, {length.span.percent}, n = {count} drapes"
        low, high = bending.interval
        return (
            f"bending {bending.value:.3g} N·m [{low:.3g}, {high:.3g}] {self.level * 100:.3g} %, n "
            f"= {count} drapes "
            f"at {self.area_weight.text} kg/m²"
        )


def face_of(folder: Path, *, first: int = 0) -> Face:
    """Reads the drapes of a folder, a file each, of as many pieces of cloth.

    Args:
        first: number of the first piece.

    Raises:
        NotFoundError: no .obj file in it.
        InputError: a file that is no mesh, has no texture coordinates, or is no disc on a pedestal.
    """
    files = sorted(path for path in folder.iterdir() if path.suffix.lower() == ".obj")
    if not files:
        raise NotFoundError(
            "there are no .obj files",
            where=str(folder),
            fix="name the folder with the scans of the drapes",
        )
    shapes = []
    for path in files:
        scan = read_obj(path)
        if not scan.textured:
            raise InputError(
                "no texture coordinates (vt), so that the flat cloth is not known",
                where=str(path),
                fix="export the mesh with texture coordinates of the flat disc",
            )
        flat, position = place_scan(scan.rest, scan.positions, where=str(path))
        shapes.append(shape_of(Mesh(rest=flat, faces=scan.faces), position).numbers())
    return Face(shapes=np.stack(shapes), specimen=first + np.arange(len(files)))


def read_drapes(
    chosen: Calibrating, *, workers: int, advance: Callable[[int], object] | None = None
) -> Draped:
    """Finds the cloth of the drapes in a folder, or in two, the second of drapes with the other
    face up.

    Args:
        workers: processes that simulate.
        advance: called with the number of drapes that were simulated or found.

    Raises:
        UsageError: more folders, or a recording that is none.
        InputError, NotFoundError: see `face_of` and `fitted`.
        RefusedError: no simulated cloth drapes as the scans do.
    """
    several = chosen.recordings
    several = [several] if isinstance(several, Mapping | Path | str) else list(several)
    folders = [local_path(str(source)) for source in several if not isinstance(source, Mapping)]
    strange = [str(folder) for folder in folders if not folder.is_dir()]
    if strange or len(folders) < len(several):
        raise UsageError(
            f"{strange[0] if strange else 'a table'} is no folder of drapes, and a weight is "
            "stated of drapes alone",
            where="--area-weight",
            fix="name folders of .obj files, or leave --area-weight out: a flag is weighed",
        )
    if len(folders) > 2:
        raise UsageError(
            f"{len(folders)} folders of drapes",
            where="RECORDING",
            fix="give one, or two: the second of the other face",
        )
    faces: list[Face] = []
    for folder in folders:
        faces.append(face_of(folder, first=sum(len(face.specimen) for face in faces)))
    kept = folder_of(chosen)
    found = simulated_drapes(
        chosen.simulations, seed=chosen.seed, folder=kept, workers=workers, advance=advance
    )
    weight = Stated.of(chosen.area_weight or 0.0)
    return answer_of(Surface.fit(*found), faces, weight, level=chosen.level, seed=chosen.seed)


def answer_of_drapes(found: Draped) -> Calibrated:
    """Returns what drapes answer, as all renderers take it."""
    return Calibrated(
        question="calibrate",
        subject=f"{found.count} drapes",
        sentence=_phrase(found),
        tone=Tone.OPEN if found.bending.value is None else Tone.SETTLED,
        quantities=found.cloth,
        findings=found.findings,
        document={**json_values(found), "artifact": None, "anemometer": None},
        arrays=arrays_of_draws(found.cloth, found.draws),
        head=Head(
            figures=[
                Figure(
                    title="How the cloth can bend, before and after the drapes",
                    content=lambda: _chart(found, (found.about[0],), width=4.8),
                    width=460,
                )
            ],
            facts={
                "drapes": ", ".join(str(face.count) for face in found.faces),
                "area weight": f"{found.area_weight.text} kg/m², as stated",
                "disc and pedestal": f"{2e3 * DISC:.0f} mm over {2e3 * PEDESTAL:.0f} mm",
                "stiffer thread": f"at {found.direction:z.0f}° in the flat cloth",
            },
            limits=[one.sentence for one in found.findings],
        ),
        make_sections=lambda: [_cloth_section(found), _drapes_section(found)],
        level=found.level,
        draws=found.draws,
        stated=found.area_weight.text,
    )


def _phrase(found: Draped) -> str:
    if found.bending.value is None:
        length = found.length
        bound = length.span.word(lambda value: f"{value * 1e3:.1f}", " mm")
        return f"The cloth's bending length is {bound}, with {length.span.percent} probability."
    return f"The cloth's bending stiffness is {phrase_quantity(found.bending)}."


def _chart(found: Draped, several: Sequence[Uncertain], *, width: float) -> Chart:
    panels = [
        posterior_panel(about, found.cloth[about.name], found.draws[about.name])
        for about in several
    ]
    return Chart(rows=[panels], width=width, height=2.9)


def _cloth_section(found: Draped) -> Section:
    return Section(
        title="The cloth",
        parts=[
            table_of_quantities("quantity", found.cloth),
            Figure(
                title="What each quantity can be, before and after the drapes",
                content=lambda: _chart(found, found.about, width=9.2),
                caption="The prior gives each bar the same share.",
            ),
        ],
        anchor="cloth",
        folded=True,
    )


def _drapes_section(found: Draped) -> Section:
    return Section(
        title="What the drapes show",
        parts=[
            Table(
                columns=("face", "drapes", "drape coefficient", "folds", "area of the flat cloth"),
                rows=[
                    (
                        str(number),
                        str(face.count),
                        f"{face.drape_coefficient:.3f}",
                        f"{face.folds:.1f}",
                        f"{face.area:.1%}",
                    )
                    for number, face in enumerate(found.faces, start=1)
                ],
            ),
            (
                f"Of simulated drapes of this cloth {100 * found.fit.tail:.2g} % look as unusual, "
                "or more so. "
                f"The answer rests on {found.fit.effective:.0f} independent draws."
            ),
        ],
        anchor="drapes",
        folded=True,
    )


def answer_of(
    surface: Surface, faces: Sequence[Face], area_weight: Stated, *, level: float, seed: int
) -> Draped:
    """Returns the answer from measured drapes.

    Raises:
        UsageError: a weight that is not above 0.
        InputError: see `fitted`.
        RefusedError: no simulated cloth drapes as the scans do.
    """
    if area_weight.low <= 0:
        raise UsageError(
            f"the area weight is {area_weight.text} kg/m²",
            where="--area-weight",
            fix="give kg/m² above 0, as in 0.192",
        )
    fit = fit_drapes(surface, [together(faces)], model=Model.BASE, seed=seed)
    if fit.tail < UNLIKE:
        shown = fit.predicted[:, 0, 0]
        raise RefusedError(
            f"no simulated cloth drapes as these scans do: their drape coefficient is "
            f"{together(faces).shapes[:, 0].mean():.3f}, the nearest simulated ones have "
            f"{np.median(shown):.3f} "
            f"(p = {fit.tail:.2g})",
            where="drapes",
            fix="look at the scans; cloth with a bending length below 10 mm is too limp for this "
            "model",
        )
    drawn = area_weight.draw(stream(seed, "drape", "weight"), len(fit.predicted))
    weight = np.maximum(drawn, _LIGHTEST * area_weight.low)
    length = fit.cloth[BENDING_LENGTH.name]
    bending = length**3 * weight * -GRAVITY[2]
    low, high = BENDING_LENGTH.at(np.array([0.0, 1.0])) ** 3 * float(weight.mean()) * -GRAVITY[2]
    about = Uncertain(
        name="bending",
        unit="N·m",
        prior=Range(low=float(low), high=float(high), scale=Scale.LOG),
        source="of the bending length and the stated weight",
        limits=(0.0, np.inf),
    )
    draws = {**fit.cloth, "bending": bending}
    reported = (BENDING_LENGTH, about, ANISOTROPY, SHEAR)
    return Draped(
        area_weight=area_weight,
        faces=tuple(faces),
        fit=fit,
        about=reported,
        cloth={one.name: quantity(one, draws[one.name], level) for one in reported},
        draws={one.name: draws[one.name] for one in reported},
        level=level,
        findings=(*_lost(faces), *_few(fit), *_differ(surface, faces, seed=seed)),
    )


def _lost(faces: Sequence[Face]) -> tuple[Finding, ...]:
    lost = abs(together(faces).lost)
    if lost < _LOST:
        return ()
    return (
        Finding(
            kind="scans-lose-area",
            severity=Severity.WARNING,
            what=f"the scans' area differs from the flat cloth's by {lost:.1%}; the interval "
            "allows for it",
            value=lost,
            fix="scan the insides of the folds as well",
        ),
    )


def _few(fit: Fit) -> tuple[Finding, ...]:
    if fit.effective >= _FEWEST:
        return ()
    return (
        Finding(
            kind="few-draws",
            severity=Severity.WARNING,
            what=f"the interval is of {fit.effective:.0f} independent draws, and may be too narrow",
            value=fit.effective,
            fix="compare with the intervals of a part of the drapes",
        ),
    )


def _differ(surface: Surface, faces: Sequence[Face], *, seed: int) -> tuple[Finding, ...]:
    """Reports whether two faces drape differently, and whether rest curvature explains it."""
    if len(faces) < 2:
        return ()
    base, curled, sided = (
        fit_drapes(surface, faces, model=m, seed=seed)
        for m in (Model.BASE, Model.CURLED, Model.SIDED)
    )
    gain, rival = curled.evidence - base.evidence, sided.evidence - base.evidence
    if max(gain, rival) < 3:
        return ()
    difference = float(faces[1].shapes[:, 0].mean() - faces[0].shapes[:, 0].mean())
    cause = (
        f"rest curvature explains it (evidence {gain:+.1f} nat)"
        if gain >= rival
        else f"rest curvature does not explain it (evidence {gain:+.1f} nat, of bending by face "
        f"{rival:+.1f})"
    )
    return (
        Finding(
            kind="faces-drape-differently",
            severity=Severity.WARNING,
            what=f"with the other face up the drape coefficient is {difference:+.3f}: {cause}",
            value=difference,
            fix="give one folder to fit one face alone",
        ),
    )
