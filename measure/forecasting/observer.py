"""Predictions one short horizon ahead, along a recording: the model starts from the cloth as
observed, and runs.

At every frame the model is moved onto the observed markers, and its velocity by what the prediction
was off, per
horizon T: x ← x + L e, v ← v + L e/T, with e the markers' prediction error and L its interpolation
onto the vertices. This is the deadbeat observer of a point that moves evenly, with the simulator as
its model of motion: what the model gets right costs no error, what it lacks returns in every e. The
prediction-error method of system identification (Ljung, System Identification, 1999, chapter 7)
then works on e and its sensitivities.

Recordings are cut into segments that run side by side as members of a batch; a segment starts some
frames early, so that its state has forgotten how it was started. Where a marker was not tracked
there is no error e and nothing is corrected by it; a prediction is compared where the marker was
tracked in the two frames before, too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.errors import UsageError
from measure.forecasting.calibrated_parameters import THETA, Calibration
from measure.forecasting.recorded import recorded
from measure.forecasting.regressors import Column, StepColumn, WrittenColumn
from measure.forecasting.segments import Segments
from measure.trajectories.interpolation import onto
from measure.trajectories.trajectory import Specimen
from sim.cloth.anchors import AnchorTracks
from sim.cloth.handles import Handles
from sim.cloth.scene import Scene, assemble
from sim.cloth.state import State
from sim.cloth.system import InapplicableError, System
from sim.integrate.joint_batch import JointBatch
from sim.integrate.split import SplitEuler
from sim.wind.sampled import Beyond, Even, SampledWind

WIDEST = 400
"""Members of a batch: beyond, a member costs as much as before. Steps of a flag of 176 vertices
side by side in 40 segments take 34 s by 72 members at a time, 20 s by 400 (with 486 vertices 54 and
41 s)."""

_JOINT = 200
"""Members of a joint batch, half as many, so that two workers have one each where one batch would
have all."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Forecaster:
    """Predicts the markers of segments by a model of one specimen.

    Attributes:
        specimen: the cloth.
        markers: (marker, 2) [m].
        integrator: of the model.
        dtype, device: of the tensors.
        workers: threads that joint batches are run in; which batches run jointly does not depend on
            it.
    """

    specimen: Specimen
    markers: FloatArray
    integrator: SplitEuler
    dtype: torch.dtype = torch.float32
    device: torch.device | str = "cpu"
    workers: int = 1

    @cached_property
    def _onto_markers(self) -> Tensor:
        """Computes the matrix (marker, vertex) of vertices onto markers."""
        return self._real(onto(self.specimen.mesh.rest, self.markers))

    @cached_property
    def _marker_weights(self) -> Tensor:
        """(vertex, marker): markers onto vertices."""
        return self._real(onto(self.markers, self.specimen.mesh.rest))

    @cached_property
    def double(self) -> Forecaster:
        """The same in double precision."""
        return replace(self, dtype=torch.float64)

    def _real(self, values: FloatArray) -> Tensor:
        return torch.tensor(values, dtype=self.dtype, device=self.device)

    def system(
        self, segments: Segments, calibrations: Sequence[Calibration]
    ) -> tuple[System, State]:
        """Makes the base model of every segment, each with its own calibration, and a start at
        rest."""
        specimen = self.specimen
        start = np.zeros((specimen.mesh.vertex_count, 3))
        start[:, 0] = specimen.mesh.rest[:, 0] - specimen.mesh.rest[list(specimen.held), 0].min()
        start[:, 2] = specimen.mesh.rest[:, 1] - specimen.mesh.rest[list(specimen.held), 1].min()
        start += specimen.anchors[np.argmin(specimen.anchors[:, 2])]
        handles = Handles(vertices=specimen.held, stiffness=specimen.stiffness)
        materials = {c: c.material(specimen.material) for c in set(calibrations)}
        scenes = [
            Scene(
                mesh=specimen.mesh,
                material=materials[c],
                handles=handles,
                gravity=specimen.gravity,
                air=specimen.air,
                position=_tied_to_anchors(
                    start,
                    specimen.held,
                    specimen.anchors if segment.anchors is None else segment.anchors,
                ),
            )
            for segment, c in zip(segments.items, calibrations, strict=True)
        ]
        system, state = assemble(scenes, dtype=self.dtype, device=self.device)
        return replace(system, wind=self._wind(segments), motion=self._motion(segments)), state

    def _wind(self, segments: Segments) -> SampledWind:
        """Returns the logged wind of every segment at its own time, sampled at its frames and one
        frame beyond."""
        count, period = len(segments.items[0].positions) + 1, segments.period
        since = np.asarray(np.arange(count) * period, dtype=np.float64)
        samples = np.stack([item.wind.at(item.start + since) for item in segments.items], axis=-1)
        times = Even(start=0.0, period=period, count=count)
        return SampledWind(times=times, samples=self._real(samples), beyond=Beyond.HOLD)

    def _motion(self, segments: Segments) -> AnchorTracks | None:
        """Tracks the motion of every segment's attachments, from their positions in its first
        frame; None where they stand still."""
        tracks = [item.attachments for item in segments.items if item.attachments is not None]
        if not tracks:
            return None
        moved = np.stack([track - track[0] for track in tracks], axis=-1)
        return AnchorTracks(start=0.0, period=segments.period, samples=self._real(moved))

    def errors(self, system: System, state: State, segments: Segments) -> Tensor:
        """Computes prediction errors (frame, marker, 3, batch) [m] after the warm-up: observed less
        predicted, 0 where a marker was not tracked in the frame or in one of the two before.

        Args:
            system, state: a member for each of the segments, once or several times over.
        """
        errors, _ = self._run(
            partial(self.integrator.advance, system, duration=segments.period), state, segments
        )
        return torch.stack(errors)

    def run(self, system: System, state: State, segments: Segments) -> tuple[Tensor, Tensor]:
        """Errors, and the predictions themselves: (frame, marker, 3, batch) each [m], after the
        warm-up."""
        advance = partial(self.integrator.advance, system, duration=segments.period)
        errors, predictions = self._run(advance, state, segments)
        return torch.stack(errors), torch.stack(predictions)

    def _run(
        self, advance: Callable[[State], State], state: State, segments: Segments
    ) -> tuple[list[Tensor], list[Tensor]]:
        """Predicts frame by frame, by what advances a state by a period: errors and predictions."""
        period, copies = segments.period, state.position.shape[-1] // len(segments)
        observed = self._real(segments.positions)
        mask, counted = self._shares(segments.seen, copies), self._shares(segments.counted, copies)
        x = torch.einsum("vm,mcb->vcb", self._marker_weights, observed[1]).repeat(1, 1, copies)
        v = torch.einsum("vm,mcb->vcb", self._marker_weights, observed[2] - observed[0]).repeat(
            1, 1, copies
        ) / (2 * period)
        state = replace(state, position=x, velocity=v, time=period)
        errors: list[Tensor] = []
        predictions: list[Tensor] = []
        with torch.no_grad():
            for k in range(2, len(observed)):
                state = advance(state)
                predicted = torch.einsum("mv,vcb->mcb", self._onto_markers, state.position)
                error = (observed[k][:, :, None] - predicted.unflatten(-1, (copies, -1))).flatten(2)
                if mask is not None:
                    error = error * mask[k][:, None]
                if k >= segments.first:
                    errors.append(
                        error if counted is None else error * counted[k - segments.first][:, None]
                    )
                    predictions.append(predicted)
                lifted = torch.einsum("vm,mcb->vcb", self._marker_weights, error)
                state = replace(
                    state,
                    position=state.position + lifted,
                    velocity=state.velocity + lifted / period,
                    time=k * period,
                )
        return errors, predictions

    def _shares(self, mask: BoolArray | None, copies: int) -> Tensor | None:
        """Converts a mask (frame, marker, segment) to (frame, marker, batch), 1 where it is set,
        else 0; None where there is none."""
        return None if mask is None else self._real(mask.astype(np.float64)).repeat(1, 1, copies)

    def sensitivity(
        self, column: Column, segments: Segments, calibrations: Sequence[Calibration], base: Tensor
    ) -> Tensor:
        """Computes the change of the predictions with a column, (frame, marker, 3, batch) [m per
        unit], from the base's errors."""
        return self._changes([column], segments, calibrations, base)[0]

    def sensitivities(
        self,
        columns: Sequence[Column],
        segments: Segments,
        calibrations: Sequence[Calibration],
        base: Tensor,
    ) -> list[Tensor]:
        """Computes the sensitivities to each parameter of `THETA`, then to each column."""
        return self._changes([*range(len(THETA)), *columns], segments, calibrations, base)

    def _changes(
        self,
        wanted: Sequence[Column | int],
        segments: Segments,
        calibrations: Sequence[Calibration],
        base: Tensor,
    ) -> list[Tensor]:
        """Computes the sensitivities to columns and to parameters of `THETA` by their index: steps
        in one joint batch, those of how cloth bends in one of their own in double precision."""
        steps = [
            index
            for index, parameter in enumerate(wanted)
            if not isinstance(parameter, WrittenColumn)
        ]
        exact = [
            index for index in steps if self.dtype != torch.float64 and _is_double(wanted[index])
        ]
        plain = [index for index in steps if index not in exact]
        changes = dict(
            zip(
                plain,
                self._sensitivities_by_steps(
                    [wanted[p] for p in plain], segments, calibrations, base
                ),
                strict=True,
            )
        )
        if exact:
            changes |= zip(
                exact,
                self.double._sensitivities_by_steps(
                    [wanted[p] for p in exact], segments, calibrations, None
                ),
                strict=True,
            )
        return [
            self._written(parameter, segments)
            if isinstance(parameter, WrittenColumn)
            else changes[index].to(base)
            for index, parameter in enumerate(wanted)
        ]

    def _sensitivities_by_steps(
        self,
        wanted: Sequence[Column | int],
        segments: Segments,
        calibrations: Sequence[Calibration],
        base: Tensor | None,
    ) -> list[Tensor]:
        """Computes the sensitivities by steps; the base's errors are computed beside theirs where
        they are not given. Nothing changes with an effect that the cloth cannot have as it is
        held, or that needs what is not recorded."""
        has = recorded(self.specimen, segments.items)
        nominal = self.system(segments, calibrations)
        sizes: list[float] = []
        inapplicable: list[int] = []
        batches: list[tuple[System, State]] = [] if base is not None else [nominal]
        for parameter in wanted:
            if isinstance(parameter, int):
                sizes.append(THETA[parameter][2])
                batches.append(
                    self.system(segments, _moved_calibrations(calibrations, parameter, sizes[-1]))
                )
            elif isinstance(parameter, StepColumn):
                try:
                    stepped = parameter.system(*nominal) if parameter.possible(has) else None
                except InapplicableError:
                    stepped = None
                if stepped is None:
                    inapplicable.append(len(sizes) + len(inapplicable))
                    continue
                batches.append(stepped)
                sizes.append(parameter.step)
            else:
                raise UsageError(
                    f"{parameter.name} has no sensitivity", where="columns", fix="give a StepColumn"
                )
        errors = self.errors_jointly(batches, segments)
        start = errors.pop(0) if base is None else base
        changes = [(start - moved) / size for moved, size in zip(errors, sizes, strict=True)]
        for index in inapplicable:
            changes.insert(index, torch.zeros_like(start))
        return changes

    def _written(self, column: WrittenColumn, segments: Segments) -> Tensor:
        observed, rest = self._real(segments.positions), self.specimen.mesh.rest
        moved = column.sensitivity(self.markers, rest, observed, segments.period)[
            segments.first - 2 :
        ]
        if segments.counted is None:
            return moved
        return moved * self._real(segments.counted.astype(np.float64))[:, :, None]

    def errors_jointly(
        self, batches: Sequence[tuple[System, State]], segments: Segments
    ) -> list[Tensor]:
        """Computes `errors` of each of some batches of the same segments.

        They run in joint batches of up to `_JOINT` members: small batches cost nearly as much as
        larger ones. Products of matrices round differently with the number of columns, so that
        their number decides, not that of workers.
        """

        def run(chosen: IntArray) -> Sequence[Tensor]:
            joint, start = JointBatch.of([batches[index] for index in chosen])
            errors, _ = self._run(
                partial(self.integrator.advance_jointly, joint, duration=segments.period),
                start,
                segments,
            )
            return torch.stack(errors).split(len(segments), dim=-1)

        together = min(math.ceil(len(batches) * len(segments) / _JOINT), len(batches))
        shares = [np.arange(len(batches))[index::together] for index in range(together)]
        with ThreadPoolExecutor(
            self.workers, initializer=torch.set_num_threads, initargs=(1,)
        ) as pool:
            done = list(pool.map(run, shares))
        return [done[index % together][index // together] for index in range(len(batches))]


def _is_double(parameter: Column | int) -> bool:
    if isinstance(parameter, int):
        return THETA[parameter][0] == "bending"
    return isinstance(parameter, StepColumn) and parameter.double


def _tied_to_anchors(start: FloatArray, vertices: Sequence[int], anchors: FloatArray) -> FloatArray:
    position = start.copy()
    position[list(vertices)] = anchors
    return position


def _moved_calibrations(
    calibrations: Sequence[Calibration], parameter: int, size: float
) -> list[Calibration]:
    return [
        c.moved([size if k == parameter else 0.0 for k in range(len(THETA))]) for c in calibrations
    ]
