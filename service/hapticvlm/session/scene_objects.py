"""What is known of each object, and what it was decided to be.

Evidence is gathered in the ladder's order and only as far as needed: the scene's own statement, the
name, the shader; the encoder's is added when a picture was looked at. Names are read on first need.
The looks at one object are fused, live frames and views to enrol alike. The key ("region", hand)
stands for what that hand touches in the newest frame, None for what a frame without an object id
shows: that is no one object, so there each look stands alone.
"""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Hashable, Mapping
from dataclasses import dataclass

from hapticvlm import materials
from hapticvlm.materials import Material
from hapticvlm.messages import MessageError, Scene, SceneObject
from hapticvlm.recognition import fusion, ladder, names
from hapticvlm.recognition.fusion import Fused
from hapticvlm.recognition.ladder import Evidence, Verdict
from hapticvlm.recognition.names import Lexicon

MAX_KNOWN = 8192
ASK_AGAIN_S = 60.0  # after a question to a VLM that had no answer

Key = str | tuple[str, str] | None


_NOBODY = ("nobody", "")


@dataclass(slots=True)
class _Known:
    facts: SceneObject | None
    stated: tuple[Evidence, ...] | None = None
    seen: Fused | None = None
    told: Evidence | None = None
    asked_at: float | None = None
    verdict: Verdict | None = None
    announced: Hashable = None


class SceneObjects:
    """The objects of one scene, bounded; the oldest undeclared one makes room."""

    def __init__(self, table: Mapping[str, Material] = materials.MATERIALS) -> None:
        self._table = table
        self._lexicon = names.read_lexicon(table)
        self._known: dict[Key, _Known] = {}
        self._replaced = 0
        self._forgotten: Counter[Key] = Counter()

    def generation(self, key: Key) -> int:
        """Return a number that grows when this key comes to stand for another object."""
        return self._replaced + self._forgotten[key]

    def declare(self, scene: Scene) -> None:
        """Take in what the scene states; raises MessageError and changes nothing if wrong."""
        for index, stated in enumerate(scene.objects):
            _check_material(stated.material, self._table, f"$.objects[{index}].material")
        for index, name in enumerate(scene.materials or ()):
            _check_material(name, self._table, f"$.materials[{index}]")
        declared = {key for key, known in self._known.items() if known.facts and not scene.replace}
        if len(declared | {stated.object_id for stated in scene.objects}) > MAX_KNOWN:
            text = f"$.objects: more than {MAX_KNOWN}; send `replace` true with those in use"
            raise MessageError("limit", text, path="$.objects")
        if scene.replace:
            self._known.clear()
            self._replaced += 1
        for stated in scene.objects:
            known = self._known.get(stated.object_id) or _Known(None)
            self._known[stated.object_id] = _Known(
                stated, seen=known.seen, told=known.told, asked_at=known.asked_at
            )

    def facts(self, key: Key) -> SceneObject | None:
        """Return what the scene stated of this object, if anything."""
        known = self._known.get(key)
        return known.facts if known else None

    def is_decided(self, key: Key) -> bool:
        """Tell whether a verdict on this object is at hand."""
        known = self._known.get(key)
        return known is not None and known.verdict is not None

    def is_seen(self, key: Key) -> bool:
        """Tell whether a picture of this object is remembered."""
        known = self._known.get(key)
        return known is not None and known.seen is not None

    def is_news(self, key: Key, gist: Hashable) -> bool:
        """Tell whether this differs from what was last announced of the object; remember it."""
        known = self._entry(key)
        before, known.announced = known.announced, gist
        return before != gist

    def forget(self, key: Key) -> None:
        """Forget what was seen under this key, and what is still being looked at."""
        self._known.pop(key, None)
        self._forgotten[key] += 1

    def verdict(self, key: Key) -> Verdict:
        """Return what this object is, from the cache or from what is known so far."""
        known = self._entry(key)
        if known.verdict is None:
            known.verdict = ladder.decide(self._evidence(key, known))
        return known.verdict

    def needs_look(self, key: Key) -> bool:
        """Tell whether a picture of this object could still change its verdict."""
        return not ladder.is_sure(self._stated(key, self._entry(key)))

    def see(self, key: Key, evidence: Evidence) -> Verdict:
        """Take in what the encoder says of a new picture and return the verdict."""
        known = self._entry(key)
        known.seen = fusion.update(None if key is None else known.seen, evidence)
        new = ladder.decide(self._evidence(key, known))
        known.verdict = ladder.prefer(known.verdict, new)
        return known.verdict

    def wants_telling(self, key: Key, now: float) -> bool:
        """Tell whether a VLM should be asked what this object is made of; count it as asked."""
        known = self._entry(key)
        if known.told is not None or self.verdict(key).material != materials.UNKNOWN:
            return False
        if known.asked_at is not None and 0.0 <= now - known.asked_at < ASK_AGAIN_S:
            return False
        known.asked_at = now
        return True

    def hear(self, key: Key, evidence: Evidence) -> None:
        """Take in what a VLM says of this object."""
        known = self._entry(key)
        known.told = evidence
        known.verdict = ladder.prefer(known.verdict, ladder.decide(self._evidence(key, known)))

    def _entry(self, key: Key) -> _Known:
        known = self._known.get(key)
        if known is None:
            known = _Known(None)
            if len(self._known) < MAX_KNOWN or self._forget_one():
                self._known[key] = known
        return known

    def _forget_one(self) -> bool:
        """Make room by forgetting the oldest undeclared object, if there is one."""
        undeclared = next((k for k, known in self._known.items() if known.facts is None), _NOBODY)
        return self._known.pop(undeclared, None) is not None

    def _evidence(self, key: Key, known: _Known) -> tuple[Evidence, ...]:
        seen = () if known.seen is None else (known.seen.evidence,)
        told = () if known.told is None else (known.told,)
        return (*self._stated(key, known), *seen, *told)

    def _stated(self, key: Key, known: _Known) -> tuple[Evidence, ...]:
        if known.stated is None:
            known.stated = _gather(key, known.facts, self._lexicon)
        return known.stated


def _gather(key: Key, facts: SceneObject | None, lexicon: Lexicon) -> tuple[Evidence, ...]:
    """Climb the rungs that need no picture and stop at the first that is sure."""
    if facts and facts.material and facts.material != materials.UNKNOWN:
        return (Evidence("scene", ((facts.material, 1.0),)),)
    found: list[Evidence] = []
    name = (facts.name if facts else None) or (key if isinstance(key, str) else None)
    named = names.from_name(name, lexicon) if name else None
    if named:
        found.append(named)
    if facts and facts.shader and not ladder.is_sure(found):
        shader = facts.shader
        shaded = names.from_shader(
            shader.metallic, shader.roughness, shader.transmission, shader.base_color
        )
        if shaded:
            found.append(shaded)
    return tuple(found)


def _check_material(material: str | None, table: Mapping[str, Material], path: str) -> None:
    if material is None or material in table or material == materials.UNKNOWN:
        return
    near = difflib.get_close_matches(material.lower(), table, n=1, cutoff=0.0)
    known = ", ".join(table)
    text = f"{path}: no material `{material[:40]}`; nearest is `{near[0]}`; known: {known}, unknown"
    raise MessageError("message", text, path=path)
