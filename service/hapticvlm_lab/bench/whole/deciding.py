"""The ways to decide what an object is, each with what it decides and what an object costs.

A way reads what the scene states (names, shaders), looks at the object's pictures with an eye, or
both, and is asked through the product's own ladder, fusion and rendition. "Nothing" is the floor, a
scene that states every material the ceiling.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hapticvlm import messages
from hapticvlm.evidence import fusion
from hapticvlm.evidence.ladder import Evidence, Verdict, decide, pool
from hapticvlm.materials import MATERIALS
from hapticvlm.session.rendition import Rendition, choose_rendition
from hapticvlm.vision.encoders.loading import load_encoder
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm.vision.pictures import crop
from hapticvlm_lab.bench.material.answers import evidence_of, object_evidence
from hapticvlm_lab.bench.material.data import Source, View, by_object
from hapticvlm_lab.bench.material.methods import GalleryHead, Method
from hapticvlm_lab.bench.whole.rows import STATED

NOTHING = "nothing"
EYES = ("lite0", "lite2")  # the default first
DEFAULT = f"names, shaders and {EYES[0]}"
GUESS = f"{EYES[0]}, always its best guess"
STATEMENTS: frozenset[messages.Rung] = frozenset({"name", "shader"})


@dataclass(frozen=True, slots=True)
class Decided:
    """What one way decided of one object; `core_ms` of one thread, over all its pictures."""

    object_id: str
    truth: str
    rendition: Rendition
    core_ms: float


def ways() -> list[Method]:
    """List the ways. Raises EncoderError, GalleryError."""
    eyes = {eye: load_encoder(eye) for eye in EYES}
    heads = {eye: GalleryHead(load_gallery(encoder=eyes[eye]), speaks=True) for eye in EYES}
    name: frozenset[messages.Rung] = frozenset({"name"})
    return [
        Method(NOTHING, "guess"),
        Method("names", "stated", rungs=name),
        Method("names and shaders", "stated", rungs=STATEMENTS),
        *(Method(eye, "ours", eyes[eye], heads[eye]) for eye in EYES),
        Method(GUESS, "ours", eyes[EYES[0]], heads[EYES[0]]),
        *(
            Method(f"names, shaders and {eye}", "ladder", eyes[eye], heads[eye], STATEMENTS)
            for eye in EYES
        ),
        Method(STATED, "stated"),
    ]


def fits(way: Method, source: Source) -> bool:
    """Whether a source has what this way reads; without it the way is another's double."""
    return not way.rungs or bool(source.stated)


def is_default(way: Method, source: Source) -> bool:
    """Whether the service decides so: by its eye alone where the scene states nothing."""
    return way.name == (DEFAULT if source.stated else EYES[0])


def decided(way: Method, source: Source) -> list[Decided]:
    """Decide every object of a source that has a material. Raises PictureError."""
    groups = by_object(view for view in source.views if view.truth in MATERIALS)
    return [_decided(way, source, views) for views in groups.values()]


def _decided(way: Method, source: Source, views: Sequence[View]) -> Decided:
    begun_ns = time.process_time_ns()
    verdict = _verdict(way, source, views)
    if way.name == GUESS:
        rendition = _as_sure(max(pool(verdict.evidence).items(), key=lambda item: item[1])[0])
    else:
        rendition = choose_rendition(verdict, MATERIALS)
    core_ms = (time.process_time_ns() - begun_ns) / 1e6
    return Decided(views[0].object_id, views[0].truth, rendition, core_ms)


def _verdict(way: Method, source: Source, views: Sequence[View]) -> Verdict:
    first = views[0]
    if way.name == STATED:
        return decide([Evidence("scene", ((first.truth, 1.0),))])
    stated = object_evidence(way, source, first.object_id)
    if way.encoder is None or way.head is None:
        return decide(stated)
    names = way.head.materials
    seen = []
    for view in views:  # one by one, as they come from a scene
        embeddings = way.encoder.embed([crop(view.as_cut(source.cut), way.encoder.side)])
        seen.append(evidence_of(way.head.beliefs(np.asarray(embeddings))[0], names))
    return decide([*stated, fusion.fuse(seen)])


def _as_sure(name: str) -> Rendition:
    """Render this material as if the scene had stated it."""
    return Rendition(name, 1.0, None, (name, 1.0), (name, 1.0))
