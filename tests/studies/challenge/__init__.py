"""Challenges: recordings whose undeclared effect is sealed, so that closing the loop can be graded
on what it says.

`make` draws keys, simulates and publishes hashes; `run` files verdicts; `score` opens the keys.
Nothing that fits may import this package (see `tests/contract/test_challenge_apart.py`).
"""
