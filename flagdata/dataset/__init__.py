"""Typed, synchronized pairs of clips and ground truth, out of the lake."""
