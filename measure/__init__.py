"""From recordings to measurements: scores, similarity, refinement, residuals, and the effects a
model lacks."""
