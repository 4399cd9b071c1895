"""The held-back rendered test set: touch approaches and orbits, path traced by Mitsuba 3.

Its renderer, shapes, textures and lights differ from those of training. It is for measuring alone.

`python -m hapticvlm_lab.training.held_back --data DIR` renders it.
"""
