"""Pictures of materials to train on: drawn, lit, photographed, with masks and labels.

Procedural maps or photographed tiles dress meshes, an environment and a sun light them, a camera
looks; all in plain torch, on CPU or GPU. `python -m hapticvlm.training.render` writes shards.
"""

from hapticvlm.training.render.batch import Batch, render
from hapticvlm.training.render.light import Lights, load_lights
from hapticvlm.training.render.tiles import Tiles, load_tiles

__all__ = ["Batch", "Lights", "Tiles", "load_lights", "load_tiles", "render"]
