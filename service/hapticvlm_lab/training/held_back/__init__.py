"""The held-back rendered test set: touch approaches and orbits, path traced by Mitsuba 3.

Another renderer, other shapes, other textures and other lights than training has. It is for
measuring alone.

`python -m hapticvlm_lab.training.held_back --data DIR` renders it.
"""
