"""What happens to films before a network learns from them, beside crops and mirror images: one
module a concept.

Most of it happens to the film as it was taken, before it is conditioned: conditioning removes some
of it, and the network learns to live with what is left. The rest is what conditioning leaves, on
clips (`models.training.augment.residual_motion`).
"""

from models.training.augment.augment import DISTURBANCES, Augment, Strength

__all__ = ["DISTURBANCES", "Augment", "Strength"]
