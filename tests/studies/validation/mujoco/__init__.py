"""MuJoCo's flex as a second foreign simulator: its worker and cloths made by it.

It stands beside the validation that needs it and nowhere else: what users run depends on no second
simulator, `sim` and `measure` know nothing of it, and its worker imports nothing of theirs, so that
nothing of the model that is judged can get into the data it is judged by.
"""
