"""Terms of the reports, each in a sentence: on the pages beside the word, and in docs/glossary.md."""

from __future__ import annotations

GLOSSARY: dict[str, str] = {
    "base model": "The cloth simulator with drag, gravity and the cloth's own stiffness alone, as fitted.",
    "effect": "A force or fault that the base model leaves out and the library can add: lift, added mass, a slow cup.",
    "null": "An experiment simulated from the base model itself, with another mesh or time-stepping scheme: what its "
    "errors look like where nothing is missing.",
    "numerical set-up": "A mesh and time-stepping scheme of the nulls. Of markers p counts set-ups, not simulations; "
    "of films it counts simulated flags, as fewer ones where those of a set-up are alike.",
    "p": "The share of numerical set-ups, or of null flags, that deviate from the base model as much as the recordings "
    "do, the recordings counted as one more. A small p is evidence that something is missing.",
    "evidence": "Words for p: very strong up to 0.001, strong up to 0.01, moderate up to 0.05, weak up to 0.1, "
    "above it little or no.",
    "interval": "The range that contains the true value in the stated share of cases, 90 % where nothing else stands.",
    "strength": "The size of an effect, with its unit; its null value means that it does not act.",
    "unseen data": "Recordings, parts or windows to which neither model was fitted.",
    "floor": "The error of the model on data simulated from itself with other numerics: no model errs less.",
    "E_red": "The share of the error above the floor that the effect removes: (before − after) / (before − floor).",
    "control": "The next best effect in place of the named one. It should predict worse.",
    "nat": "The unit of a natural logarithm of a likelihood ratio; 3 nat are odds of 20 to 1.",
    "Bayes factor": "How much more probable what was observed is with an effect than without it.",
    "z": "A strength in standard errors; on films how far the recordings lie along the change that an effect makes, in "
    "standard deviations of null flags.",
    "power": "The chance that an effect of its expected strength makes the test reject the base model.",
    "family-wise p": "p of an effect compared with the largest of all effects in each null, since many are tried.",
    "held-out gain": "How much better a model predicts data it was not fitted to, in nat.",
    "replicates": "Simulations of one cloth in one wind, whose scatter no model predicts.",
    "gate": "The check whether a film is like those that a network was trained on, before anything of it is shown.",
    "window": "A stretch of a film that is read at once: 1.2 s for a wind, 2.5 s for observables.",
    "observable": "A number that a window shows: droop, extension, speed, frequency, amplitude.",
    "area weight": "Mass of the cloth for each square metre [kg/m²].",
    "reading model": "A regression that makes one filmed flag an anemometer (flagdata calibrate).",
}
"""Term → what it means."""
