"""Simulated experiments without any effect: how they are made and kept, and what the tests' statistics are in them.

It may import `measure.inference` and what that may import.
"""
