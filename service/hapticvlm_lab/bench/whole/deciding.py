"""The methods to decide on the material of an object, and the decision of each.

A method reads what the scene states (names, shaders), recognises the object's pictures with an
encoder, or both, through the product's own ladder, fusion and rendition. "Nothing" is the floor; a
scene that states every material is the ceiling.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from hapticvlm.evidence.ladder import Evidence, decide, fuse_recognitions, pool
from hapticvlm.materials import MATERIALS
from hapticvlm.session.decisions import Rendition, choose_rendition
from hapticvlm.vision.encoders.loading import load_encoder
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm_lab.bench.material.answers import encoder_evidence, object_evidence
from hapticvlm_lab.bench.material.data import Source
from hapticvlm_lab.bench.material.methods import NAME, SHADER, Floats, Method

NOTHING = "nothing"
STATED = "every material stated"  # the ceiling: it costs its author, not the machine
EYES = ("lite0", "lite2")  # the default first
DEFAULT = f"names, shaders and {EYES[0]}"
GUESS = f"{EYES[0]}, always its best guess"
GRADED = f"{EYES[0]}, graded"
STATEMENTS = NAME | SHADER


@dataclass(frozen=True, slots=True)
class Decided:
    """The decision of one method on one object, whose truth is known."""

    object_id: str
    truth: str
    rendition: Rendition


def ways() -> list[Method]:
    """List the methods. Raises EncoderError, GalleryError."""
    eyes = {eye: load_encoder(eye) for eye in EYES}
    galleries = {eye: load_gallery(encoder=eyes[eye]) for eye in EYES}
    return [
        Method(NOTHING, "guess"),
        Method("names", "stated", rungs=NAME),
        Method("names and shaders", "stated", rungs=STATEMENTS),
        *(Method(eye, "ours", eyes[eye], galleries[eye]) for eye in EYES),
        *(Method(name, "ours", eyes[EYES[0]], galleries[EYES[0]]) for name in (GUESS, GRADED)),
        *(
            Method(f"names, shaders and {eye}", "ladder", eyes[eye], galleries[eye], STATEMENTS)
            for eye in EYES
        ),
        Method(STATED, "stated"),
    ]


def fits(way: Method, source: Source) -> bool:
    """Return whether a source has what this method reads; otherwise another does the same."""
    return not way.rungs or bool(source.stated)


def is_default(way: Method, source: Source) -> bool:
    """Return whether the service decides so: by pictures alone if the scene states nothing."""
    return way.name == (DEFAULT if source.stated else EYES[0])


def decided(way: Method, source: Source, embeddings: Floats | None) -> list[Decided]:
    """Decide every object of a source that has a material; `embeddings` of its views, (N, D)."""
    # All views of an object are fused as a session fuses what it sees over time; what the scene
    # states of the object comes on top, and the ladder decides which of them speaks first.
    seen = encoder_evidence(way, source, embeddings)
    places: dict[str, list[int]] = defaultdict(list)
    for place, view in enumerate(source.views):
        if view.truth in MATERIALS:
            places[view.object_id].append(place)
    return [
        Decided(name, source.views[at[0]].truth, _rendition(way, source, at, seen))
        for name, at in places.items()
    ]


def _rendition(
    way: Method, source: Source, places: Sequence[int], seen: Sequence[Evidence]
) -> Rendition:
    """Decide on one object from its views at these places."""
    view = source.views[places[0]]
    if way.name == STATED:
        return _as_sure(view.truth)
    stated = object_evidence(way, source, view.object_id)
    looks = [fuse_recognitions(seen[place] for place in places)] if seen else []
    evidence = [*stated, *looks]
    if way.name == GUESS:
        return _as_sure(max(pool(evidence).items(), key=lambda item: item[1])[0])
    return choose_rendition(decide(evidence), MATERIALS, "graded" if way.name == GRADED else "full")


def _as_sure(name: str) -> Rendition:
    """Render this material as if the scene had stated it."""
    return Rendition(name, 1.0, (name, 1.0), (name, 1.0))
