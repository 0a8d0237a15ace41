"""The phenomenon and its pictures: cloth in the wind, simulated in batches.

Arrays of vertices are `(vertex, 3, batch)` with the batch innermost; SI units; +z up.
"""
