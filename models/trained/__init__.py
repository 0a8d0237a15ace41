"""A trained network in use: its folder, the estimator, what is known besides, clips unlike its
training."""
