"""Terms of the reports, each in a sentence: on the pages beside the word, and in
docs/glossary.md."""

from __future__ import annotations

GLOSSARY: dict[str, str] = {
    "base model": "The cloth simulator with drag, gravity and the cloth's own stiffness alone, as "
    "fitted.",
    "effect": "A force or fault that the base model lacks and the library can add: lift, added "
    "mass, a slow cup.",
    "null": "An experiment simulated from the base model, with another mesh or time-stepping "
    "scheme. It shows the "
    "errors that remain if nothing is missing.",
    "numerical set-up": "A mesh and time-stepping scheme of the nulls. On markers p counts "
    "set-ups, not "
    "simulations. On films it counts simulated flags, as fewer if those of one set-up are alike.",
    "p": "The share of numerical set-ups, or of null flags, that deviate from the base model at "
    "least as much as the "
    "recordings. The recordings count as one more. A small p is evidence that something is "
    "missing.",
    "evidence": "Words for p: very strong up to 0.001, strong up to 0.01, moderate up to 0.05, "
    "weak up to 0.1, "
    "above 0.1 little or none.",
    "interval": "The range that contains the true value in the stated share of cases, 90 % unless "
    "another level is "
    "given.",
    "strength": "The size of an effect, with its unit. At its null value the effect does not act.",
    "unseen data": "Recordings, parts or windows to which neither model was fitted.",
    "floor": "The error of the model on data simulated from itself with other numerics. No model "
    "does better.",
    "E_red": "The share of the error above the floor that the effect removes: (before − after) / "
    "(before − floor).",
    "control": "The next-best effect instead of the named one. It should predict worse.",
    "nat": "The unit of a natural logarithm of a likelihood ratio; 3 nat are odds of 20 to 1.",
    "Bayes factor": "How much more probable the observations are with an effect than without it.",
    "z": "How far the recordings lie along the change that an effect makes, in standard deviations "
    "of nulls.",
    "power": "The chance that the test rejects the base model if an effect of its expected "
    "strength acts.",
    "family-wise p": "p of an effect compared with the largest of all effects in each null, "
    "because many are tried.",
    "held-out gain": "How much better a model predicts data it was not fitted to, in nat.",
    "replicates": "Simulations of one cloth in one wind, whose scatter no model predicts.",
    "gate": "The check whether a film is like those that a network was trained on, before any "
    "result is shown.",
    "window": "A stretch of a film that gives one result: 1.2 s for a wind, 2.5 s for observables.",
    "observable": "A number measured in a window: droop, extension, speed, frequency, amplitude.",
    "area weight": "Mass of the cloth per square metre [kg/m²].",
    "reading model": "A regression that makes one filmed flag an anemometer (flagdata calibrate).",
}
"""Term → what it means."""
