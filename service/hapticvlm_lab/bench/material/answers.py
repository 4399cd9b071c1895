"""What a method answers on a source's pictures, or of its objects where views are fused."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm import materials
from hapticvlm.evidence import ladder
from hapticvlm.evidence.ladder import KNOWN, SURE, Evidence, decide, fuse, pool
from hapticvlm.evidence.names import from_name
from hapticvlm.evidence.shader import from_shader
from hapticvlm_lab.bench.material.data import FOUR, Source, crops
from hapticvlm_lab.bench.material.methods import Floats, Method
from hapticvlm_lab.bench.material.scores import SILENT, Doubles, Words

ELEVEN = tuple(materials.MATERIALS)


@dataclass(frozen=True, slots=True)
class Answers:
    """Of N pictures or objects: forced answers, open ones (SILENT: unknown), and how familiar.

    spoken is None for a method that cannot say unknown, familiar for one that only guesses.
    """

    four: Words
    eleven: Words
    spoken: Words | None
    sure: NDArray[np.bool_]
    familiar: Doubles | None
    truth: Words
    objects: Words


def embed(method: Method, source: Source) -> Floats | None:
    """Embed a source's views: (N, D); None for a method that sees no picture."""
    if method.encoder is None:
        return None
    cut = crops(source, method.cut or source.cut, method.encoder.side)
    return method.encoder.embed(cut)


def answer(method: Method, source: Source, embeddings: Floats | None) -> Answers | None:
    """Ask a method about a source it has no reference of; None when it needs one."""
    if method.family == "guess":
        return _guess(source)
    if method.rungs or method.fused:
        return _by_evidence(method, source, embeddings)
    return _by_beliefs(method, source, embeddings)


def object_evidence(method: Method, source: Source, object_id: str) -> list[Evidence]:
    """Read what the scene states of an object, with the method's rungs."""
    stated = source.stated.get(object_id)
    found: list[Evidence | None] = []
    if stated is not None and "name" in method.rungs and stated.name:
        found.append(from_name(stated.name))
    if stated is not None and "shader" in method.rungs and stated.shader:
        s = stated.shader
        found.append(from_shader(s.metallic, s.roughness, s.transmission, s.base_color))
    return [item for item in found if item is not None]


def evidence_of(beliefs: NDArray[np.float64], names: Sequence[str]) -> Evidence:
    """Turn a row of beliefs into the encoder's evidence, all classes listed, best first."""
    best = np.argsort(-beliefs, kind="stable")
    return Evidence("encoder", tuple((names[i], float(beliefs[i])) for i in best))


def _guess(source: Source) -> Answers:
    """Answer the commonest class always: what any figure has to be compared with."""
    counts = Counter(source.truth.tolist())
    shape = len(source.views)
    commonest = [max(among, key=lambda name: counts[name]) for among in (FOUR, ELEVEN)]
    four, eleven = (np.full(shape, name) for name in commonest)
    sure = np.zeros(shape, np.bool_)
    return Answers(four, eleven, None, sure, None, source.truth, source.objects)


def _by_beliefs(method: Method, source: Source, embeddings: Floats | None) -> Answers | None:
    head = method.head
    if head is None or embeddings is None:
        return None
    beliefs = head.beliefs(embeddings)
    names = np.array(head.materials)
    best = beliefs.max(axis=1)
    four, eleven = (_among(beliefs, names, allowed) for allowed in (FOUR, ELEVEN))
    spoken = np.where(best >= KNOWN, names[beliefs.argmax(axis=1)], SILENT)
    return Answers(
        four=four,
        eleven=eleven,
        spoken=spoken if head.speaks else None,
        sure=np.asarray(best >= SURE) & head.speaks,
        familiar=head.familiar(embeddings),
        truth=source.truth,
        objects=source.objects,
    )


def _among(beliefs: Doubles, names: Words, allowed: Collection[str]) -> Words:
    inside = np.isin(names, list(allowed))
    return np.asarray(names[np.where(inside, beliefs, -np.inf).argmax(axis=1)])


def _by_evidence(method: Method, source: Source, embeddings: Floats | None) -> Answers | None:
    """Gather evidence per picture, or per object with its views fused, and decide by the ladder.

    Open answers are fused as the session does; forced ones take the mean of all, since fusing
    forgets the small beliefs.
    """
    evidence = encoder_evidence(method, embeddings)
    if evidence is None:
        return None
    objects = source.objects
    units = [objects == name for name in dict.fromkeys(objects.tolist())]
    if not method.fused:
        units = list(np.eye(len(objects), dtype=np.bool_))
    first = np.array([unit.argmax() for unit in units])
    stated = [object_evidence(method, source, name) for name in objects[first].tolist()]
    seen = [[evidence[row] for row in np.flatnonzero(unit)] if evidence else [] for unit in units]
    fused = [[ladder.fuse_recognitions(views)] if views else [] for views in seen]
    means = [[fuse(views)] if views else [] for views in seen]
    verdicts = [decide([*given, *view]) for given, view in zip(stated, fused, strict=True)]
    forced = [[*given, *view] for given, view in zip(stated, means, strict=True)]
    spoken = [SILENT if v.material == materials.UNKNOWN else v.material for v in verdicts]
    confidence = np.array([verdict.confidence for verdict in verdicts])
    speaks = method.head is None or method.head.speaks
    return Answers(
        four=np.array([_forced(items, FOUR) for items in forced]),
        eleven=np.array([_forced(items, ELEVEN) for items in forced]),
        spoken=np.array(spoken) if speaks else None,
        sure=(confidence >= SURE) & speaks,
        familiar=confidence,
        truth=source.truth[first],
        objects=objects[first],
    )


def encoder_evidence(method: Method, embeddings: Floats | None) -> list[Evidence] | None:
    """Each view's evidence; empty for a method that sees no picture, None for one that cannot."""
    if method.encoder is None:
        return []
    if method.head is None or embeddings is None:
        return None
    names = method.head.materials
    return [evidence_of(row, names) for row in method.head.beliefs(embeddings)]


def _forced(evidence: Sequence[Evidence], allowed: Sequence[str]) -> str:
    """Return the likeliest of the allowed; SILENT when the evidence does not separate them."""
    if not any(item.beliefs for item in evidence):
        return SILENT
    pooled = pool(evidence)
    rank: Callable[[str], float] = lambda name: pooled.get(name, 0.0)  # noqa: E731
    best, second = sorted(allowed, key=rank, reverse=True)[:2]
    return best if rank(best) > rank(second) + 1e-9 else SILENT
