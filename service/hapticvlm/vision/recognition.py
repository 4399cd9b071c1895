"""The question to the recogniser process and its answer, which the gateway knows, too.

The gateway imports no encoder and no gallery: they are loaded in the recogniser process alone.
"""

from __future__ import annotations

from dataclasses import dataclass

from hapticvlm.evidence.ambient import SceneView
from hapticvlm.evidence.ladder import Evidence


@dataclass(frozen=True, slots=True)
class Recognition:
    """The result for one frame: evidence, None for an unchanged picture, or an error.

    `scene_view` holds the embedding and the brightness of the crop, whatever it shows. `error_path`
    names the field of the frame at fault; `is_our_fault`: the frame is right and we failed.
    """

    evidence: Evidence | None
    stages_ms: dict[str, float]
    scene_view: SceneView | None = None
    error: str | None = None
    error_path: str | None = None
    is_our_fault: bool = False


@dataclass(frozen=True, slots=True)
class SceneContext:
    """The object that a frame shows, its scene, and its material where that is sure."""

    scene: str
    object_id: str | None
    material: str | None = None
