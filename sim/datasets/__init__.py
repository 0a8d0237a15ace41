"""Data sets: recipes of simulated and rendered recordings, their building on many processes, and their cards.

A recipe (`recipe`, read by `reading`) says which scene is simulated how often for each side of the split, how the
meshes are filmed, and what the anemometer beside them says. `build` turns it into mesh sequences and recordings of a
lake, which load like real ones.
"""
