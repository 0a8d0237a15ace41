"""Blender in a process of its own: the protocol, the process that is kept alive, and the worker that runs in it.

Nothing here imports torch: the worker's side must not.
"""
