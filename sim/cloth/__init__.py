"""The cloth: mesh, material, forces within it and by the air, contact, how it is held; the
equations of motion."""
