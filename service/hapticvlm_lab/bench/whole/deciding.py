"""The methods to decide on the material of an object, and the decision of each.

A method is a choice of rungs: what the scene states (names, shaders), what the encoder sees of the
object, and the references that named objects of the same scene give to the others; each through the
product's own ladder, fusion and rendition. "Nothing" is the floor; a scene that states every
material is the ceiling.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

from hapticvlm.evidence.ladder import Evidence, decide, fuse_recognitions, is_sure
from hapticvlm.materials import MATERIALS, UNKNOWN
from hapticvlm.session.decisions import Rendition, choose_rendition
from hapticvlm.vision import textures
from hapticvlm.vision.encoders.encoder import Encoder
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm.vision.loading import load_encoder
from hapticvlm.vision.scene_references import SceneReferences
from hapticvlm_lab.bench.material.answers import encoder_evidence, flat_views, object_evidence
from hapticvlm_lab.bench.material.data import Source, shuffled
from hapticvlm_lab.bench.material.methods import NAME, SHADER, TEXTURE, Floats, Method
from hapticvlm_lab.bench.material.reading import scene_of
from hapticvlm_lab.bench.material.timing import NAMED

NOTHING = "nothing"
STATED = "every material stated"  # the ceiling: it costs its author, not the machine
NAMES = "names"
SURFACES = "surface names"
STATEMENTS = "names, shaders"
TEXTURES = "textures"
EYE = "eye"
REFERRED = "eye, references"
ALL = "all"


@dataclass(frozen=True, slots=True)
class Decided:
    """The decision of one method on one object, whose truth is known."""

    object_id: str
    truth: str
    rendition: Rendition


_BY_NAME = Method(NAMES, "stated", rungs=NAME)


def ways() -> list[Method]:
    """List the methods. Raises EncoderError, GalleryError."""
    eye, gallery = _shipped()
    stated = NAME | SHADER
    every = stated | TEXTURE
    return [
        Method(NOTHING, "guess"),
        Method(NAMES, "stated", rungs=NAME),
        Method(SURFACES, "stated", rungs=NAME, surfaces=True),
        Method(STATEMENTS, "stated", rungs=stated, surfaces=True),
        Method(TEXTURES, "stated", rungs=every, surfaces=True),
        Method(EYE, "ours", eye, gallery),
        Method(REFERRED, "ours", eye, gallery, refers=True),
        Method(ALL, "ladder", eye, gallery, every, refers=True, surfaces=True),
        Method(STATED, "stated"),
    ]


def fits(way: Method, source: Source) -> bool:
    """Return whether a source has what this method reads; otherwise another does the same."""
    told = source.stated.values()
    reads = {
        SURFACES: any(stated.surface for stated in told),
        STATEMENTS: any(stated.shader for stated in told),
        TEXTURES: any(stated.texture for stated in told),
    }
    if not reads.get(way.name, True):
        return False
    return bool(source.stated) or not (way.rungs or way.refers)


def is_default(way: Method, source: Source) -> bool:
    """Return whether the service decides so: by pictures alone if the scene states nothing."""
    return way.name == (ALL if source.stated else EYE)


def decided(way: Method, source: Source, embeddings: Floats | None) -> list[Decided]:
    """Decide every object of a source that has a material; `embeddings` of its views, (N, D)."""
    # All views of an object are fused as a session fuses what it sees over time; what the scene
    # states of the object comes on top, and the ladder decides which of them speaks first.
    seen = encoder_evidence(way, source, embeddings)
    if way.refers and embeddings is not None:
        seen = _referred(way, source, embeddings, seen)
    places: dict[str, list[int]] = defaultdict(list)
    for place, view in enumerate(source.views):
        if view.truth in MATERIALS:
            places[view.object_id].append(place)
    return [
        Decided(name, source.views[at[0]].truth, _rendition(way, source, at, seen))
        for name, at in places.items()
    ]


def _texture_evidence(source: Source, object_id: str) -> list[Evidence]:
    """Read an object's map, as the service does where names and shader leave it open."""
    stated = source.stated.get(object_id)
    if stated is None or stated.texture is None:
        return []
    encoder, gallery = _shipped()
    return [textures.read(stated.texture, encoder, gallery)]


@cache
def _shipped() -> tuple[Encoder, Gallery]:
    encoder = load_encoder()
    return encoder, load_gallery(encoder=encoder)


def _referred(
    way: Method, source: Source, embeddings: Floats, seen: Sequence[Evidence]
) -> list[Evidence]:
    """Adjust the evidence of each view by references to named objects of its scene."""
    references = _references(source, embeddings)
    return [
        references[scene_of(view.object_id)].adjust(
            evidence, row, view.object_id, is_flat=is_picture_flat
        )
        for view, evidence, row, is_picture_flat in zip(
            source.views, seen, embeddings, flat_views(way, source).tolist(), strict=True
        )
    ]


def _references(source: Source, embeddings: Floats) -> Mapping[str, SceneReferences]:
    """Collect references of each scene: up to NAMED of its objects that their names decide."""
    # A headset looks at everything from time to time, so each named object has one picture here.
    # Which of them a scene holds is drawn by a checksum, because a kit has more than a scene.
    scenes: dict[str, SceneReferences] = defaultdict(SceneReferences)
    counts: dict[str, int] = defaultdict(int)
    first = {view.object_id: place for place, view in reversed(list(enumerate(source.views)))}
    for object_id in sorted(first, key=shuffled):
        material = decide(object_evidence(_BY_NAME, source, object_id)).material
        scene = scene_of(object_id)
        if material != UNKNOWN and counts[scene] < NAMED:
            counts[scene] += 1
            scenes[scene].add(object_id, material, embeddings[first[object_id]])
    return scenes


def _rendition(
    way: Method, source: Source, places: Sequence[int], seen: Sequence[Evidence]
) -> Rendition:
    """Decide on one object from its views at these places."""
    view = source.views[places[0]]
    if way.name == STATED:
        name = view.truth
        return Rendition(name, 1.0, (name, 1.0), (name, 1.0))
    stated = object_evidence(way, source, view.object_id)
    if "texture" in way.rungs and not is_sure(stated):
        stated += _texture_evidence(source, view.object_id)
    looks = [fuse_recognitions(seen[place] for place in places)] if seen else []
    return choose_rendition(decide([*stated, *looks]), MATERIALS)
