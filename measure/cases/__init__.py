"""Real cases: recordings made by others, measured, modelled and reported with what the model lacked."""
