"""Embeddings and regressors of clips, their losses and training. Functions follow the device of
their tensors."""
