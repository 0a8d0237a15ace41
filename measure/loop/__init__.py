"""Closing the loop: find what a model lacks, name it, add it, and say what that changed on data nobody has seen."""
