"""Pictures of materials to train on: drawn, lit, photographed, with masks and labels.

Procedural maps or photographed tiles dress meshes, an environment and a sun light them, a camera
looks; all in plain torch, on CPU or GPU. `python -m hapticvlm_lab.training.render` writes shards.
"""

from hapticvlm_lab.training.render.batch import Batch, render
from hapticvlm_lab.training.render.light import Lights, load_lights
from hapticvlm_lab.training.render.tiles import Tiles, load_tiles

__all__ = ["Batch", "Lights", "Tiles", "load_lights", "load_tiles", "render"]
