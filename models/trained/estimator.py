"""A trained model at work: clips in, a distribution of wind and cloth out, and whether the clip is
one it can judge.

An estimator has one learner or several of other seeds, whose distributions are mixed with equal
weights: they differ most where the data constrain them least. Estimates for clips unlike all
training clips mean nothing, so each estimate carries a p-value of the distance of its summary to
the training clips' (`models.trained.outliers`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import Float32Array, FloatArray, UInt8Array
from flagdata.core.rng import torch_generator
from flagdata.errors import CorruptError, FlagdataError, InputError
from flagdata.recipes.retired_names import present_name
from models.maps.crops import Cropping
from models.maps.frontend import FrontEnd
from models.networks.learner import Learner, Loss, build
from models.networks.mixture import Mixture
from models.networks.targets import Cloth, Target
from models.trained.model_folder import WEIGHTS, check_model, read_card, read_tensors
from models.trained.outliers import Familiarity
from models.trained.restriction import Known, Restricted, restrict_mixtures

SHIPPED = Path(__file__).parents[1] / "shipped"
"""Models that come with the package, a folder each."""
DEFAULT = "flow-outdoor"
DRAWS = 400
CLOUD = "cloud.safetensors"


@dataclass(frozen=True, kw_only=True, eq=False)
class Estimates:
    """Estimates for n clips.

    Attributes:
        targets: what the columns are.
        draws: (n, draw, target) of the predictive distribution, in the targets' units.
        summary: (n, dimension) of the first learner.
        unlike: (n,) p-value of a clip as far from the training clips as this one; None for a model
            without a cloud.
    """

    targets: tuple[Target, ...]
    draws: Float32Array
    summary: Float32Array
    unlike: FloatArray | None

    @property
    def mean(self) -> FloatArray:
        """(n, target)."""
        return self.draws.mean(axis=1, dtype=np.float64)

    def interval(self, share: float) -> tuple[FloatArray, FloatArray]:
        """Computes the ends of the central interval with this share of each distribution: two of
        (n, target).

        Raises:
            InputError: a share that is not between 0 and 1.
        """
        if not 0 < share < 1:
            raise InputError(
                f"an interval cannot have the share {share:g}", fix="give a share between 0 and 1"
            )
        low, high = np.quantile(self.draws, [(1 - share) / 2, (1 + share) / 2], axis=1)
        return low, high


@dataclass(frozen=True, kw_only=True, eq=False)
class Estimator:
    """Attributes:
    name: of the model.
    learners: of one recipe, other seeds.
    front_end, cropping: what their inputs are made by.
    widening: (target,) factors by which each distribution is spread about its mean, on the logits;
        found on validation clips, 1 where none was needed.
    cloud: the training clips' summaries; None where the model has none.
    card: its description.
    """

    name: str
    learners: tuple[Learner, ...]
    front_end: FrontEnd
    cropping: Cropping
    widening: Tensor
    cloud: Familiarity | None
    card: dict[str, object]

    @property
    def targets(self) -> tuple[Target, ...]:
        return self.learners[0].scaling.targets

    @property
    def cloth(self) -> Cloth:
        """The kind of cloth that it judges.

        Raises:
            InputError: a model without targets, which has no ranges.
        """
        if not self.targets:
            raise InputError(
                f"the model {self.name!r} has no targets",
                fix="take one that was trained for targets",
            )
        return self.targets[0].cloth

    @property
    def device(self) -> torch.device:
        return next(self.learners[0].parameters()).device

    def to(self, device: torch.device | str) -> Estimator:
        """Moves the model to another device."""
        for learner in self.learners:
            learner.to(device)
        return self

    def inputs(self, clips: UInt8Array) -> Tensor:
        """Computes what the networks take, of clips (n, frames, height, width) gray: the largest
        square about the middle.

        Raises:
            InputError: clips of another length, or that are not uint8.
        """
        if clips.ndim != 4 or clips.dtype != np.uint8:
            raise InputError(
                f"the clips have the shape {clips.shape} and the type {clips.dtype}",
                fix="give uint8 of shape (clip, frame, height, width)",
            )
        if clips.shape[1] != self.front_end.frames:
            raise InputError(
                f"clips of {clips.shape[1]} frames, the model was trained on "
                f"{self.front_end.frames} at "
                f"{self.front_end.rate:g} Hz",
                where=f"model {self.name!r}",
                fix="cut or resample the clips to that",
            )
        shape = (clips.shape[1], clips.shape[2], clips.shape[3])
        cut = [self.cropping.cut(clip, self.cropping.whole(shape)) for clip in clips]
        return torch.cat([self.front_end(clip[None].to(self.device)) for clip in cut])

    @torch.no_grad()
    def estimate(
        self, inputs: Tensor, *, seed: int = 0, draws: int = DRAWS, known: Sequence[Known] = ()
    ) -> Estimates:
        """Estimates the targets for inputs (n, *shape), see `inputs`.

        Args:
            seed: of the draws; the same inputs and seed give the same draws.
            draws: of each clip's distribution, shared among the learners.
            known: statements about quantities of each clip.
        """
        embeddings = self.embeddings(inputs)
        if known:
            logits = self.given(self.posterior(embeddings), known, seed=seed, draws=draws).logits
        else:
            logits = self.logits(embeddings, seed=seed, draws=draws)
        values = self.learners[0].scaling.values(logits)
        summary = embeddings[0].cpu().numpy().astype(np.float32)
        return Estimates(
            targets=self.targets,
            draws=values.cpu().numpy().astype(np.float32),
            summary=summary,
            unlike=None if self.cloud is None else self.cloud.p_value(summary),
        )

    @torch.no_grad()
    def embeddings(self, inputs: Tensor) -> list[Tensor]:
        """Computes (n, dimension) embeddings of each learner."""
        return [learner.network(inputs) for learner in self.learners]

    @torch.no_grad()
    def summaries(self, inputs: Tensor) -> Tensor:
        """Computes (n, dimension) embeddings of the first learner: what `cloud` is of."""
        return self.learners[0].network(inputs)

    @torch.no_grad()
    def logits(self, embeddings: Sequence[Tensor], *, seed: int, draws: int) -> Tensor:
        """Draws logits (n, draw, target) from the learners' distributions
        (`models.networks.targets`), spread by `widening`.

        Raises:
            InputError: a model without distributions.
        """
        share = -(-draws // len(self.learners))
        draws_of_learners = []
        for member, (learner, embedding) in enumerate(zip(self.learners, embeddings, strict=True)):
            generator = torch_generator(seed, "draws", member, device=embedding.device)
            mixture = learner.mixture(embedding)
            draws_of_learners.append(
                mixture.sample(share, generator) * learner.spread + learner.centre
            )
        logits = torch.cat(draws_of_learners, dim=1)
        centre = logits.mean(dim=1, keepdim=True)
        return centre + (logits - centre) * self.widening.to(logits)

    @torch.no_grad()
    def posterior(self, embeddings: Sequence[Tensor]) -> Mixture:
        """Returns the distributions that `logits` draws from, in closed form: float64, the
        learners' components side by side.

        Raises:
            InputError: a model without distributions.
        """
        parts = [
            learner.mixture(embedding)
            .double()
            .rescale_by(scale=learner.spread.double(), shift=learner.centre.double())
            for learner, embedding in zip(self.learners, embeddings, strict=True)
        ]
        together = Mixture(
            log_weight=torch.cat([part.log_weight for part in parts], dim=1) - math.log(len(parts)),
            location=torch.cat([part.location for part in parts], dim=1),
            factor=torch.cat([part.factor for part in parts], dim=1),
        )
        widening = self.widening.to(together.location)
        return together.rescale_by(
            scale=widening, shift=(together.mean() * (1 - widening))[:, None]
        )

    @torch.no_grad()
    def given(
        self, posterior: Mixture, known: Sequence[Known], *, seed: int, draws: int
    ) -> Restricted:
        """Draws from distributions of `posterior` restricted to what is known.

        Raises:
            InputError: see `models.trained.restriction.restrict_mixtures`.
        """
        generator = torch_generator(seed, "known", device=posterior.location.device)
        return restrict_mixtures(
            posterior, self.learners[0].scaling, known, draws=draws, generator=generator
        )

    def prior(self, count: int) -> Mixture:
        """Describes what the training set's targets are like: `count` times the Gaussian of their
        logits' means and standard deviations, as one component, float64."""
        learner = self.learners[0]
        size = len(self.targets)
        centre, spread = learner.centre.double(), learner.spread.double()
        return Mixture(
            log_weight=torch.zeros((count, 1)).to(centre),
            location=centre.expand(count, 1, size),
            factor=torch.diag(spread).expand(count, 1, size, size),
        )


def load(folder: Path) -> Estimator:
    """Loads the model in a folder, once its files were found to be as they were written.

    Raises:
        NotFoundError: there is none.
        CorruptError: it is damaged, or does not fit this code.
    """
    check_model(folder)
    card = read_card(folder)
    tensors = read_tensors(folder / WEIGHTS)
    try:
        recipe = card["recipe"]
        front_end = FrontEnd(**card["front_end"])
        crops = card["cropping"]
        cropping = Cropping(**{**crops, "scales": tuple(crops["scales"])})
        if (cropping.frames, cropping.size) != (front_end.frames, front_end.size):
            raise InputError(
                "its crops have another size or number of frames than its front end takes", fix=_FIX
            )
        loss, network = recipe["loss"], recipe["network"]
        learners = []
        for member in range(int(card.get("members", 1))):
            prefix = f"{member}." if "members" in card else ""
            weights = {
                name.removeprefix(prefix): value
                for name, value in tensors.items()
                if name.startswith(prefix)
            }
            learner = build(
                network["name"],
                network["options"],
                loss=Loss(loss["name"]),
                targets=tuple(map(present_name, loss["targets"])),
                components=loss["components"],
                margin=loss["margin"],
            )
            learner.load_state_dict(
                {
                    name: value.float() if value.is_floating_point() else value
                    for name, value in weights.items()
                }
            )
            learners.append(learner.eval())
        widening = torch.tensor(
            card.get("widening") or [1.0] * len(loss["targets"]), dtype=torch.float32
        )
        if widening.shape != (len(loss["targets"]),) or not bool(
            ((widening > 0) & widening.isfinite()).all()
        ):
            raise InputError(f"its distributions are spread by {widening.tolist()}", fix=_FIX)
        path = folder / CLOUD
        cloud = None
        if path.exists():
            cloud = Familiarity.of_arrays(
                {name: value.double().numpy() for name, value in read_tensors(path).items()}
            )
        return Estimator(
            name=str(card["name"]),
            learners=tuple(learners),
            front_end=front_end,
            cropping=cropping,
            widening=widening,
            cloud=cloud,
            card=card,
        )
    except (
        KeyError,
        TypeError,
        ValueError,
        RuntimeError,
        ArithmeticError,
        AttributeError,
        FlagdataError,
    ) as error:
        what = (
            error.what if isinstance(error, FlagdataError) else f"{type(error).__name__}: {error}"
        )
        raise CorruptError(
            f"this version of flagdata cannot load the model ({what})", where=str(folder), fix=_FIX
        ) from None


_FIX = "train it again, or update flagdata"


def load_shipped(name: str = DEFAULT) -> Estimator:
    """Loads a model that comes with the package.

    Raises:
        NotFoundError: no model of that name comes with it.
    """
    return load(SHIPPED / name)
