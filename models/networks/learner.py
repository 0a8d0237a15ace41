"""A network with its head: what is trained, stored and loaded as one.

Beside a head's own loss there is the contrastive loss, which learns physical similarity.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn.functional import pdist

from flagdata.errors import InputError, LimitError
from models.networks.mixture import Mixture, MixtureHead
from models.networks.network import Network
from models.networks.networks_by_name import NETWORKS
from models.networks.targets import Scaling


def contrastive_loss(
    embedding: Tensor, seed: Tensor, *, margin: float = 1.0, positive_share: float | None = None
) -> Tensor:
    """Pulls clips of one simulation together and pushes others apart to the margin, over all pairs
    of the batch.

    The mean over all n(n − 1)/2 pairs (BatchAll) of y D² + (1 − y) max(0, m − D)², with D the
    Euclidean distance of the two embeddings and y = 1 where both clips are renders of one
    simulation (Hadsell, Chopra and LeCun, CVPR 2006, equation 4 without its factor 1/2; Runia et
    al., section 3.1). Coincident embeddings of a negative pair have no direction to part in, and
    get gradient 0.

    Args:
        embedding: (n, dimension).
        seed: (n,) integers, the simulation's seed of each clip.
        margin: m.
        positive_share: None to count every pair alike, as the paper does. A batch of 16 simulations
            with two clips each has 16 positive pairs and 480 negative ones; a share of 0.5 weighs
            the mean over the positive pairs as much as that over the negative ones.

    Raises:
        InputError: a batch without positive or without negative pairs, sizes that differ, or a
            number out of range.
    """
    if embedding.ndim != 2 or seed.shape != embedding.shape[:1]:
        raise InputError(
            f"the embeddings have the shape {tuple(embedding.shape)}, the seeds "
            f"{tuple(seed.shape)}",
            fix="give (n, dimension) and (n,)",
        )
    if margin <= 0 or (positive_share is not None and not 0 < positive_share < 1):
        raise InputError(
            f"the margin is {margin}, share of positive pairs {positive_share}",
            fix="give a margin above 0 and a share between 0 and 1",
        )
    first, second = torch.triu_indices(len(seed), len(seed), offset=1, device=seed.device)
    positive = seed[first] == seed[second]
    positives = int(positive.sum())
    if positives == 0:
        raise InputError(
            f"none of the {len(seed)} clips of this batch are of one simulation",
            fix="draw batches by simulation, at least two clips of each",
        )
    if positives == len(positive):
        raise InputError(
            f"all {len(seed)} clips of this batch are of one simulation",
            fix="draw at least two simulations a batch",
        )
    distance = pdist(embedding)
    pulled = distance[positive].square()
    pushed = (margin - distance[~positive]).relu().square()
    if positive_share is None:
        return (pulled.sum() + pushed.sum()) / len(positive)
    return positive_share * pulled.mean() + (1 - positive_share) * pushed.mean()


WEIGHTS_LIMIT = 1 << 28
"""Most weights of a learner: 1 GiB in float32, and four times as much while it is trained."""
NUMBER_LIMIT = 1_000_000
"""Largest number among a network's options."""
LIST_LIMIT = 200
"""Longest list among a network's options: the names of all maps of one kind are 87."""


class Loss(StrEnum):
    """What is made small."""

    REGRESSION = "regression"
    """The squared error of standardised targets, as the paper's tables of wind speed."""
    POSTERIOR = "posterior"
    """The negative log-likelihood of a mixture of Gaussians over the targets' logits."""
    CONTRASTIVE = "contrastive"
    """The paper's contrastive loss over all pairs of a batch."""


class Learner(nn.Module):
    """Inputs to a loss and to estimates.

    Args:
        network: of `models.networks.networks_by_name.NETWORKS`.
        loss: what is made small; it decides the head: none, a linear layer, a mixture.
        targets: names of `models.networks.targets.TARGETS`; none for the contrastive loss.
        components: of the mixture.
        margin: of the contrastive loss.
    """

    centre: Tensor
    spread: Tensor

    def __init__(
        self,
        network: nn.Module,
        *,
        loss: Loss,
        targets: tuple[str, ...],
        components: int = 6,
        margin: float = 1.0,
    ) -> None:
        super().__init__()
        if (loss is Loss.CONTRASTIVE) == bool(targets):
            raise InputError(
                f"the {loss.value} loss cannot have {len(targets)} targets",
                fix="give targets to all losses but the contrastive",
            )
        self.network = network
        self.objective = loss
        self.scaling = Scaling(names=targets)
        self.margin = margin
        dimension = int(network.dimension)  # pyright: ignore[reportArgumentType]
        self.head: nn.Module = nn.Identity()
        if loss is Loss.REGRESSION:
            self.head = nn.Linear(dimension, len(targets))
        elif loss is Loss.POSTERIOR:
            self.head = MixtureHead(
                dimension=dimension, targets=len(targets), components=components
            )
        self.register_buffer("centre", torch.zeros(len(targets)))
        self.register_buffer("spread", torch.ones(len(targets)))

    def fit_scale(self, values: Tensor) -> None:
        """Takes mean and deviation of what is learned from the training set's targets (n, target).

        Raises:
            InputError: a target that is the same in all of it.
        """
        learned = self._learned_logits(values)
        spread, centre = torch.std_mean(learned, dim=0, correction=0)
        if not bool((spread > 0).all()):
            raise InputError(
                "a target has one value in the whole training set",
                where=", ".join(self.scaling.names),
                fix="leave it out, or widen its range in the data set",
            )
        self.centre.copy_(centre)
        self.spread.copy_(spread)

    def loss(self, inputs: Tensor, values: Tensor, sequence: Tensor) -> Tensor:
        """Computes the mean loss of a batch: a scalar.

        Args:
            inputs: as the network takes them.
            values: (n, target) in the targets' units.
            sequence: (n,) seeds of the simulations.

        Raises:
            InputError: a contrastive batch without two clips of one simulation.
        """
        embedding = self.network(inputs).float()
        if self.objective is Loss.CONTRASTIVE:
            return contrastive_loss(embedding, sequence, margin=self.margin, positive_share=0.5)
        wanted = (self._learned_logits(values) - self.centre) / self.spread
        if self.objective is Loss.REGRESSION:
            return (self.head(embedding) - wanted).square().mean()
        return -self.head(embedding).log_prob(wanted).mean()

    def point_estimates(self, embedding: Tensor) -> Tensor:
        """Returns (n, target) values of a regression's embeddings, or the means of a posterior's
        components."""
        predicted = self.head(embedding)
        if isinstance(predicted, Mixture):
            predicted = predicted.mean()
        return self._values(predicted * self.spread + self.centre)

    def mixture(self, embedding: Tensor) -> Mixture:
        """Predicts the distributions over standardised logits.

        Raises:
            InputError: a learner of another loss.
        """
        if self.objective is not Loss.POSTERIOR:
            raise InputError(
                f"a {self.objective.value} gives no distribution",
                fix="take a model of a posterior loss",
            )
        return self.head(embedding)

    def _learned_logits(self, values: Tensor) -> Tensor:
        return self.scaling.learned(values) if self.objective is Loss.POSTERIOR else values.float()

    def _values(self, learned: Tensor) -> Tensor:
        return self.scaling.values(learned) if self.objective is Loss.POSTERIOR else learned


def build(
    network: str,
    options: Mapping[str, Any],
    *,
    loss: Loss,
    targets: tuple[str, ...],
    components: int,
    margin: float,
) -> Learner:
    """Builds a named network with its head, its weights drawn by torch's generator as it stands.

    It is built without memory for its weights first, so that no recipe or card takes more than
    `WEIGHTS_LIMIT`.

    Args:
        network: name in `models.networks.networks_by_name.NETWORKS`.
        options: the network's own; lists, as JSON and TOML have them, stand for tuples.
        loss, targets, components, margin: see `Learner`.

    Raises:
        UnknownNameError: no such network.
        InputError: options that the network does not take, or targets that do not go with the loss.
        LimitError: numbers or lists beyond any network's, or more weights than `WEIGHTS_LIMIT`.
    """
    arguments = {
        key: tuple(value) if isinstance(value, list) else value for key, value in options.items()
    }
    for key, value in {**arguments, "components": components, "margin": margin}.items():
        _check_option(key, value)

    def learner() -> Learner:
        module: nn.Module = NETWORKS[network](**arguments)
        if not isinstance(module, Network):
            raise InputError(
                f"the network {network} lacks one of takes, recurrent, dimension and forward",
                where="[network]",
                fix="add what flagdata.extend.Network lists to its class",
            )
        return Learner(module, loss=loss, targets=targets, components=components, margin=margin)

    try:
        with torch.device("meta"):
            weights = sum(values.numel() for values in learner().state_dict().values())
    except (TypeError, ValueError, RuntimeError, ArithmeticError) as error:
        raise InputError(
            f"the network {network} does not take that: {error}",
            where="[network]",
            fix="see its docstring for what it takes",
        ) from None
    if weights > WEIGHTS_LIMIT:
        raise LimitError(
            f"the network {network} would have {weights:.3g} weights",
            where="[network]",
            fix=f"at most {WEIGHTS_LIMIT} are trained or read; give smaller widths",
        )
    return learner()


def _check_option(key: str, value: object) -> None:
    """Checks that an option is a positive number, a text, or a short list of them.

    Raises:
        InputError, LimitError: it is not.
    """
    many = value if isinstance(value, tuple) else (value,)
    if len(many) > LIST_LIMIT:
        raise LimitError(
            f"{key} has {len(many)} entries", where="[network]", fix=f"give at most {LIST_LIMIT}"
        )
    for entry in many:
        if isinstance(entry, str):
            continue
        if isinstance(entry, bool) or not isinstance(entry, int | float) or not entry > 0:
            raise InputError(f"{key} is {entry!r}", where="[network]", fix="give a positive number")
        if entry > NUMBER_LIMIT:
            raise LimitError(
                f"{key} is {str(entry)[:20]}", where="[network]", fix=f"give at most {NUMBER_LIMIT}"
            )
