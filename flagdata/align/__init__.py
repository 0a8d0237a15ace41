"""Clocks of different devices brought onto one: models with their uncertainty, and the ways to come by them."""
