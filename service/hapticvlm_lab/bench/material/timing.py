"""The cost of one answer: from a frame to its material on one thread.

The frame is decoded and cut, as the recogniser does; methods without a picture read statements.

The time of a core covers all threads of this process, so time spent waiting for other programs is
not charged.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from hapticvlm import messages
from hapticvlm.evidence.ladder import Evidence, decide
from hapticvlm.vision import textures
from hapticvlm.vision.flatness import is_flat
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm.vision.loading import load_encoder
from hapticvlm.vision.pictures import crop
from hapticvlm.vision.scene_references import SceneReferences
from hapticvlm_lab.bench.material.answers import evidence_of, object_evidence
from hapticvlm_lab.bench.material.data import Source
from hapticvlm_lab.bench.material.methods import Method
from hapticvlm_lab.bench.rigs import core_us

FRAME_PX = 448  # the size that clients are asked to send
QUALITY = 80
TURNS = 100
MOST_S = 2.0  # per method: slow ones get fewer turns
LEAST = 20
NAMED = 20  # objects whose names give references, at most


def costs_ms(methods: Sequence[Method], stated: Source | None) -> dict[str, float]:
    """Time one frame of every method that takes time: median ms of a core, by name.

    Methods with the same work share one timing. `stated` is a source that lends names and shaders.
    """
    picture = _picture()
    times: dict[str, float] = {}
    same: dict[tuple[object, ...], float | None] = {}
    for method in methods:
        work = (id(method.encoder), method.rungs, method.refers, method.surfaces)
        if work not in same:
            stage = _stage(method, picture, stated)
            same[work] = None if stage is None else _timed_ms(stage)
        cost_ms = same[work]
        if cost_ms is not None:
            times[method.name] = cost_ms
    return times


def _stage(method: Method, jpeg: bytes, stated: Source | None) -> Callable[[], object] | None:
    """Return one answer to one frame as a function; None if it costs nothing or has no object."""
    if method.rungs and stated is None:
        return None
    read = _reading(method, stated)
    if "texture" in method.rungs and method.encoder is None:
        return _texture_stage(read, stated)
    if method.encoder is None:
        return read if method.rungs else None
    encoder = method.encoder
    gallery = method.gallery
    references = _named_objects(gallery) if method.refers and gallery is not None else None
    size: dict[str, Any] = {"width": FRAME_PX, "height": FRAME_PX}
    frame = messages.Frame(id=1, captured_at=0.0, format="jpeg", image=jpeg, origin="top", **size)

    def recognise() -> object:
        cut = crop(frame, encoder.side)
        embeddings = encoder.embed([cut])
        if gallery is None:
            return embeddings
        row = gallery.beliefs(embeddings, np.array([is_flat(cut)]))[0]
        seen = evidence_of(row, gallery.candidates)
        if references is not None:
            seen = references.adjust(seen, embeddings[0], None)
        return decide([*read(), seen])

    return recognise


def _texture_stage(
    read: Callable[[], list[Evidence]], stated: Source | None
) -> Callable[[], object] | None:
    """Return the reading of one map beside statements; None if no object has a map."""
    shown = [] if stated is None else [each.texture for each in stated.stated.values()]
    frames = itertools.cycle([frame for frame in shown if frame is not None])
    if next(frames, None) is None:
        return None
    encoder = load_encoder()
    gallery = load_gallery(encoder=encoder)
    return lambda: decide([*read(), textures.read(next(frames), encoder, gallery)])


def _named_objects(gallery: Gallery) -> SceneReferences:
    """Return references to as many objects as a scene has named; their pictures do not matter."""
    references = SceneReferences()
    for place in range(NAMED):
        material = gallery.candidates[place % len(gallery.candidates)]
        references.add(str(place), material, gallery.references[place])
    return references


def _reading(method: Method, stated: Source | None) -> Callable[[], list[Evidence]]:
    if not method.rungs or stated is None:
        return list
    telling = [name for name in stated.stated if object_evidence(method, stated, name)]
    turn = itertools.cycle(telling or [""])
    return lambda: object_evidence(method, stated, next(turn))


def _timed_ms(stage: Callable[[], object]) -> float:
    for _ in range(3):
        stage()
    cores: list[float] = []
    start = time.perf_counter()
    while len(cores) < TURNS and (len(cores) < LEAST or time.perf_counter() - start < MOST_S):
        cores.append(core_us(stage))
    return round(float(np.median(cores)) / 1e3, 4)


def _picture() -> bytes:
    import simplejpeg

    rng = np.random.default_rng(5)
    grain = rng.uniform(60, 200, (FRAME_PX // 8, FRAME_PX // 8, 3))
    pixels = np.kron(grain, np.ones((8, 8, 1))).astype(np.uint8)
    data: bytes = simplejpeg.encode_jpeg(pixels, quality=QUALITY)
    return data
