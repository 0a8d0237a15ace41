"""Remeshing while simulating: triangles small where cloth bends, moves unevenly or is compressed, large elsewhere."""
