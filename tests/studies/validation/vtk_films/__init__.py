"""Films of flags by VTK, a renderer that is not the project's: scenes, a worker that draws them,
and video files.

The worker runs in VTK's own environment and imports nothing of the project, so that nothing of the
renderer that networks were trained with can get into the films that they are judged by.
"""
