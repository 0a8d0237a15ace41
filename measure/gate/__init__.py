"""Whether a clip is like what a model was trained on, and if not, why: asked before any interval is shown."""
