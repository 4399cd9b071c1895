"""The answers of a method to a source's pictures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm import materials
from hapticvlm.evidence.ladder import KNOWN, Evidence, decide, pool
from hapticvlm.evidence.names import from_name
from hapticvlm.evidence.shader import from_shader
from hapticvlm.vision.flatness import is_flat
from hapticvlm_lab.bench.material.data import FOUR, Source, crops
from hapticvlm_lab.bench.material.methods import Floats, Method
from hapticvlm_lab.bench.material.scores import SILENT, Doubles, Words

ELEVEN = tuple(materials.MATERIALS)


@dataclass(frozen=True, slots=True)
class Answers:
    """Answers to N pictures.

    four, eleven: the likeliest material among these classes, whatever its belief. spoken: the
    material, or SILENT where its belief is too small to say it. A guess has none.
    """

    four: Words
    eleven: Words
    spoken: Words | None
    truth: Words
    objects: Words


def embed(method: Method, source: Source) -> Floats | None:
    """Embed a source's views, (N, D); None for a method that uses no picture."""
    if method.encoder is None:
        return None
    return method.encoder.embed(crops(source, method.cut or source.cut, method.encoder.side))


def answer(method: Method, source: Source, embeddings: Floats | None) -> Answers:
    """Ask a method about every picture of a source."""
    if method.family == "guess":
        return _guess(source)
    if method.rungs:
        return _by_evidence(method, source, embeddings)
    return _by_beliefs(method, source, embeddings)


def object_evidence(method: Method, source: Source, object_id: str) -> list[Evidence]:
    """Read what the scene states of an object, with the method's rungs."""
    stated = source.stated.get(object_id)
    evidence: list[Evidence | None] = []
    if stated is not None and "name" in method.rungs:
        surface = stated.surface if method.surfaces else None
        if stated.name or surface:
            evidence.append(from_name(stated.name or "", surface=surface))
    if stated is not None and "shader" in method.rungs and stated.shader:
        s = stated.shader
        evidence.append(from_shader(s.metallic, s.roughness, s.transmission, s.base_color))
    return [item for item in evidence if item is not None]


def evidence_of(beliefs: NDArray[np.float64], names: Sequence[str]) -> Evidence:
    """Turn a row of beliefs into the encoder's evidence, all classes listed, best first."""
    best = np.argsort(-beliefs, kind="stable")
    return Evidence("encoder", tuple((names[i], float(beliefs[i])) for i in best))


def encoder_evidence(method: Method, source: Source, embeddings: Floats | None) -> list[Evidence]:
    """Return the evidence of each view; none for a method that uses no picture."""
    if method.gallery is None or embeddings is None:
        return []
    names = method.gallery.candidates
    rows = method.gallery.beliefs(embeddings, flat_views(method, source))
    return [evidence_of(row, names) for row in rows]


def flat_views(method: Method, source: Source) -> NDArray[np.bool_]:
    """Return which views are pictures of flat colours, (N,)."""
    assert method.encoder is not None
    cut = crops(source, method.cut or source.cut, method.encoder.side)
    return np.array([is_flat(crop) for crop in cut], np.bool_)


def _guess(source: Source) -> Answers:
    """Answer the commonest class always: the floor for any other figure."""
    # Always the same answer: right in one class and wrong in all others, so its balanced accuracy
    # is one over the number of classes, however unequal they are.
    counts = Counter(source.truth.tolist())
    shape = len(source.views)
    commonest = [max(among, key=lambda name: counts[name]) for among in (FOUR, ELEVEN)]
    four, eleven = (np.full(shape, name) for name in commonest)
    return Answers(four, eleven, None, source.truth, source.objects)


def _by_beliefs(method: Method, source: Source, embeddings: Floats | None) -> Answers:
    assert method.gallery is not None
    assert embeddings is not None
    beliefs = method.gallery.beliefs(embeddings, flat_views(method, source))
    names = np.array(method.gallery.candidates)
    best = beliefs.max(axis=1)
    four, eleven = (_among(beliefs, names, allowed) for allowed in (FOUR, ELEVEN))
    return Answers(
        four=four,
        eleven=eleven,
        spoken=np.where(best >= KNOWN, names[beliefs.argmax(axis=1)], SILENT),
        truth=source.truth,
        objects=source.objects,
    )


def _among(beliefs: Doubles, names: Words, allowed: Collection[str]) -> Words:
    inside = np.isin(names, list(allowed))
    return np.asarray(names[np.where(inside, beliefs, -np.inf).argmax(axis=1)])


def _by_evidence(method: Method, source: Source, embeddings: Floats | None) -> Answers:
    """Gather the evidence of each picture, and decide by the ladder."""
    seen = encoder_evidence(method, source, embeddings)
    stated = [object_evidence(method, source, name) for name in source.objects.tolist()]
    evidence = [[*known, *seen[at : at + 1]] for at, known in enumerate(stated)]
    said = [decide(items).material for items in evidence]
    return Answers(
        four=np.array([_forced(items, FOUR) for items in evidence]),
        eleven=np.array([_forced(items, ELEVEN) for items in evidence]),
        spoken=np.array([SILENT if name == materials.UNKNOWN else name for name in said]),
        truth=source.truth,
        objects=source.objects,
    )


def _forced(evidence: Sequence[Evidence], allowed: Sequence[str]) -> str:
    """Return the likeliest of the allowed; SILENT when the evidence does not separate them."""
    if not any(item.beliefs for item in evidence):
        return SILENT
    pooled = pool(evidence)
    rank: Callable[[str], float] = lambda name: pooled.get(name, 0.0)  # noqa: E731
    best, second = sorted(allowed, key=rank, reverse=True)[:2]
    return best if rank(best) > rank(second) + 1e-9 else SILENT
