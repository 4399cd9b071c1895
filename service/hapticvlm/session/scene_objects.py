"""Keeps of each object's surfaces evidence, verdict and decision, until one of them changes.

Evidence is gathered in the ladder's order and only as far as needed: what the scene gives, the
name, the shader, what a texture map showed; the encoder's is added when a frame was recognised.
Names are read on first need. The recognitions of one object are fused, live frames and frames to
enrol alike. A frame without an object id may show several objects, so there each recognition stands
alone.

Every surface climbs the ladder by itself. Its name, shader and stated material come before those of
its object, and what pictures show of the object serves each surface that has no picture of its own.
Pure.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

import msgspec

from hapticvlm import materials
from hapticvlm.evidence import ladder, names, shader, sub_materials
from hapticvlm.evidence.ladder import Evidence, Fused, Verdict
from hapticvlm.evidence.lexicon import Lexicon, read_lexicon
from hapticvlm.evidence.sub_materials import MaterialDetail
from hapticvlm.materials import UNKNOWN, Material
from hapticvlm.messages import Decision, MessageError, Scene, SceneObject
from hapticvlm.rendering.heat.contact import ThermalContact
from hapticvlm.session.decisions import Rendition
from hapticvlm.session.hums import Hums
from hapticvlm.session.overrides import MaterialOverrides
from hapticvlm.session.targets import WHOLE_VIEW, ObjectTarget, Target, ThingTarget, whole
from hapticvlm.session.textures import Textures

NO_OVERRIDES = MaterialOverrides()
MAX_KNOWN = 8192
MAX_REFERENCE_VIEWS = 4  # pictures of an object that is sure, as references for the others
ASK_AGAIN_S = 60.0  # after a question to a VLM that had no answer

T = TypeVar("T")


def from_declaration(
    target: Target, facts: SceneObject | None, lexicon: Lexicon
) -> tuple[Evidence, ...]:
    """Climb the rungs that need no picture and stop at the first that is sure."""
    if facts and facts.material and facts.material != UNKNOWN:
        return (Evidence("scene", ((facts.material, 1.0),)),)
    found: list[Evidence] = []
    named = names.from_name(name_of(target, facts) or "", lexicon, surface_name_of(facts))
    if named:
        found.append(named)
    if facts and facts.shader and not ladder.is_sure(found):
        stated = facts.shader
        shaded = shader.from_shader(
            stated.metallic,
            stated.roughness,
            stated.transmission,
            stated.base_color,
            stated.opacity,
        )
        if shaded:
            found.append(shaded)
    return tuple(found)


def _materials_of(scene: Scene) -> Iterator[tuple[str, str | None]]:
    """Yield every material that a message states, with its path."""
    for index, given in enumerate(scene.objects):
        yield f"$.objects[{index}].material", given.material
        for number, surface in enumerate(given.surfaces or ()):
            yield f"$.objects[{index}].surfaces[{number}].material", surface.material
    for index, name in enumerate(scene.materials or ()):
        yield f"$.materials[{index}]", name


def name_of(target: Target, facts: SceneObject | None) -> str | None:
    """Return the name an object goes by: the one given, else its id."""
    return (facts.name if facts else None) or (
        target.object_id if isinstance(target, ObjectTarget) else None
    )


def surface_name_of(facts: SceneObject | None) -> str | None:
    """Return the name of the object's largest surface, if the scene gives one."""
    return facts.surfaces[0].name or None if facts and facts.surfaces else None


def as_surface(target: Target, facts: SceneObject | None) -> SceneObject | None:
    """Return the object as if this surface were all of it: what the surface states comes first."""
    if facts is None or not facts.surfaces or not isinstance(target, ObjectTarget):
        return facts
    surface = facts.surfaces[target.surface if target.surface < len(facts.surfaces) else 0]
    return msgspec.structs.replace(
        facts,
        surfaces=[surface],
        material=surface.material or facts.material,
        shader=surface.shader or facts.shader,
    )


def title_of(facts: SceneObject, index: int) -> str | None:
    """Return a title of this surface of several, else the object's name if it has one."""
    surfaces = facts.surfaces or ()
    if index >= len(surfaces) or len(surfaces) == 1:
        return facts.name
    return f"{facts.name or facts.object_id}, {surfaces[index].name or f'surface {index}'}"


@dataclass(frozen=True, slots=True)
class Cached(Generic[T]):
    """A value, and the inputs that it was made from."""

    value: T
    inputs: Hashable


# A decision is wanted ten to ninety times a second for each hand and changes a few times a minute.
# So every step keeps its result beside the inputs that it was made from, and compares those first:
# evidence -> verdict -> rendition and contact -> decision. A renewal of a lease that changes
# nothing makes nothing again; whatever changes an input (a picture, an answer, ambient, gain, a
# limit of the plate) is found by comparing, and nobody has to remember to invalidate anything.
class ObjectState(msgspec.Struct):
    """One surface: what the scene gives of its object, evidence by source, verdict, and decision.

    `detail` is what its name says beyond the material, `table` the materials as it has them.
    `announced` is the key of the decision announced last, with the inputs of that decision.
    `is_told`: the client was told that it touches a surface which this object does not state.
    """

    facts: SceneObject | None
    declared: tuple[Evidence, ...] | None = None
    detail: MaterialDetail = sub_materials.PLAIN
    table: Mapping[str, Material] = materials.MATERIALS
    recognised: Fused | None = None
    vlm: Evidence | None = None
    asked_at: float | None = None
    reference_views: int = 0
    verdict: Verdict | None = None
    rendition: Cached[Rendition] | None = None
    decision: Cached[Decision] | None = None
    announced: Cached[Hashable] | None = None
    contact: Cached[ThermalContact | None] | None = None
    is_told: bool = False


class SceneObjects:
    """The objects of one scene, bounded; the oldest undeclared one makes room.

    `overrides` are materials that a person set by hand; the scene's own one wins.
    """

    def __init__(
        self,
        table: Mapping[str, Material] = materials.MATERIALS,
        overrides: MaterialOverrides = NO_OVERRIDES,
    ) -> None:
        self._table = table
        self._overrides = overrides
        self._lexicon = read_lexicon(table)
        self.known: dict[ThingTarget, ObjectState] = {}
        self._declared: set[ThingTarget] = set()  # those that the scene declared; the rest were met
        self._among: frozenset[str] | None = None
        self._replaced = 0
        self._forgotten: Counter[ThingTarget] = Counter()
        self._forgotten_before = 0
        self.hums = Hums()  # what hums under a hand
        self.textures = Textures()

    def generation(self, target: ThingTarget) -> int:
        """Return a number that grows when this target comes to stand for another object."""
        return self._replaced + self._forgotten_before + self._forgotten.get(whole(target), 0)

    def declare(self, scene: Scene) -> None:
        """Receive the scene's objects. Raises MessageError and changes nothing if wrong."""
        self._check(scene)
        if scene.replace:
            self.hums.clear()
            self.textures.clear()
            self.known.clear()
            self._declared.clear()
            self._replaced += 1
            self._among = None
        for gone in map(ObjectTarget, scene.forget or ()):
            if gone in self.known:
                self.forget(gone)
        if scene.materials is not None:
            self._among = frozenset(scene.materials)
        self.hums.declare(scene.objects)
        for given in scene.objects:
            self._declare(ObjectTarget(given.object_id), self._overrides.applied_to(given))

    def _declare(self, target: ObjectTarget, facts: SceneObject) -> None:
        """Receive an object; what was recognised of a surface that it still has is kept."""
        before = self.surfaces_known(target.object_id)
        self._note_textures(target.object_id, self.facts(target), facts)
        self._declared.add(target)
        self.known.setdefault(target, ObjectState(facts)).facts = facts
        for surface in before:
            known = self.known[surface]
            if self.has_surface(surface):
                self.known[surface] = ObjectState(
                    facts, recognised=known.recognised, vlm=known.vlm, asked_at=known.asked_at
                )
            else:
                del self.known[surface]
                self._count_forgotten(target)  # its pictures may be under way

    def _note_textures(
        self, object_id: str, before: SceneObject | None, facts: SceneObject | None
    ) -> None:
        """Note the texture maps of an object's surfaces, and drop those that it had before.

        None: there is no such object.
        """
        maps = [surface.texture for surface in (facts and facts.surfaces) or ()]
        gone = len((before and before.surfaces) or ()) - len(maps)
        for index, texture in enumerate([*maps, *[None] * gone]):
            self.textures.note(ObjectTarget(object_id, index), texture)

    def _check(self, scene: Scene) -> None:
        allowed = {*self._table, materials.UNKNOWN}
        for path, material in _materials_of(scene):
            if material is not None and material not in allowed:
                raise self._no_material(material, path)
        if self._count_after(scene) > MAX_KNOWN:
            text = f"$.objects: more than {MAX_KNOWN}; send `replace` true with those in use"
            raise MessageError("limit", text, path="$.objects")

    def _no_material(self, material: str, path: str) -> MessageError:
        problem = materials.no_material(material, (*self._table, materials.UNKNOWN))
        return MessageError("message", f"{path}: {problem}", path=path)

    def _count_after(self, scene: Scene) -> int:
        """Return how many objects would be declared after this message.

        Only what the message names is counted, so that to change one of thousands of objects costs
        as little as to change the only one.
        """
        if scene.replace:
            return len({given.object_id for given in scene.objects})
        given = {ObjectTarget(given.object_id) for given in scene.objects}
        gone = set(map(ObjectTarget, scene.forget or ())) - given
        return len(self._declared) - len(gone & self._declared) + len(given - self._declared)

    def state(self, target: ThingTarget) -> ObjectState:
        """Return what is known of this object, its verdict included."""
        known = self.known.get(target)
        if known is None:
            known = self._new(target)
        if known.verdict is None:
            known.verdict = ladder.decide(self._evidence(target, known), self._table)
        return known

    def facts(self, target: ThingTarget) -> SceneObject | None:
        """Return what the scene gives of this object, if anything."""
        known = self.known.get(target)
        return known.facts if known else None

    def has_surface(self, target: ThingTarget) -> bool:
        """Whether this is the largest surface of its object, or another one that it states."""
        if not isinstance(target, ObjectTarget) or target.surface == 0:
            return True
        facts = self.facts(ObjectTarget(target.object_id))
        return facts is not None and target.surface < len(facts.surfaces or ())

    def surfaces_known(self, object_id: str) -> list[ObjectTarget]:
        """Return those surfaces of an object of which something is known, the largest first."""
        facts = self.facts(ObjectTarget(object_id))
        count = len(facts.surfaces or ()) if facts else 0
        surfaces = (ObjectTarget(object_id, index) for index in range(max(count, 1)))
        return [surface for surface in surfaces if surface in self.known]

    def given(self, object_id: str) -> SceneObject | None:
        """Return what the scene gives of an object it has shown or declared; None of any other."""
        known = self.known.get(ObjectTarget(object_id))
        if known is None:
            return None
        return known.facts or SceneObject(object_id=object_id)

    def is_recognised(self, target: ThingTarget) -> bool:
        """Whether a recognition of this object is kept."""
        known = self.known.get(target)
        return known is not None and known.recognised is not None

    @property
    def scene_number(self) -> int:
        """Number of times the scene was replaced; its references are forgotten each time."""
        return self._replaced

    def reference_material(self, target: ThingTarget, *, always: bool) -> str | None:
        """Return the material that a picture of this object is a reference of, if it is wanted.

        Some pictures of each object are enough, unless one was sent to be enrolled.
        """
        state = self.state(target)
        assert state.verdict is not None
        is_wanted = always or state.reference_views < MAX_REFERENCE_VIEWS
        if not is_wanted or state.verdict.material == materials.UNKNOWN:
            return None
        state.reference_views += 1
        return state.verdict.material

    def forget(self, target: ThingTarget) -> None:
        """Forget what was recognised under this target, and what is still being recognised.

        A scene of debris forgets new ids for ever, and their counts must not pile up. So from time
        to time all are dropped and every generation grows past them; what is being recognised just
        then is recognised again.
        """
        if isinstance(target, ObjectTarget):
            self._note_textures(target.object_id, self.facts(target), None)
            for surface in self.surfaces_known(target.object_id):
                del self.known[surface]
            self.hums.forget(target.object_id)
        self.known.pop(target, None)
        self._declared.discard(target)
        self._count_forgotten(target)

    def _count_forgotten(self, target: ThingTarget) -> None:
        self._forgotten[target] += 1
        if len(self._forgotten) > MAX_KNOWN:
            self._forgotten_before += max(self._forgotten.values())
            self._forgotten.clear()

    def verdict(self, target: ThingTarget) -> Verdict:
        """Return what this object is, from the cache or from what is known so far."""
        verdict = self.state(target).verdict
        assert verdict is not None
        return verdict

    def needs_recognition(self, target: ThingTarget) -> bool:
        """Whether a picture of this object could still change its verdict."""
        return not ladder.is_sure(self._without_pictures(target, self._entry(target)))

    def wanted_textures(self) -> list[str]:
        """Return the texture maps to ask for now, each once."""
        return self.textures.next_wanted(self._is_open)

    def _is_open(self, target: ObjectTarget) -> bool:
        """Whether name and shader leave open what a surface is; nothing is kept of the answer."""
        known = self.known.get(target)
        if known is not None and known.declared is not None:
            return not ladder.is_sure(known.declared)
        facts = as_surface(target, self.facts(whole(target)))
        return not ladder.is_sure(from_declaration(target, facts, self._lexicon))

    def add_texture(self, texture: str, evidence: Evidence) -> None:
        """Receive what a texture map showed, for all surfaces that have it."""
        self.textures.add(texture, evidence)
        for target in self.textures.surfaces_with(texture):
            known = self.known.get(target)
            if known is not None and known.announced is not None:
                self._decide_again(target, known)
            elif known is not None:
                known.verdict = None  # thousands may have it; each is decided when it is needed

    def add_recognition(self, target: ThingTarget, evidence: Evidence) -> Verdict:
        """Receive the encoder's evidence of a new picture and return the verdict."""
        known = self._entry(target)
        before = None if target == WHOLE_VIEW else known.recognised
        known.recognised = ladder.fuse_recognition(before, ladder.restrict(evidence, self._among))
        return self._decide_again(target, known)

    def wants_question(self, target: ThingTarget, now: float) -> bool:
        """Whether a VLM should be asked what this object is made of; it then counts as asked."""
        known = self._entry(target)
        if known.vlm is not None or self.verdict(target).material != materials.UNKNOWN:
            return False
        if known.asked_at is not None and 0.0 <= now - known.asked_at < ASK_AGAIN_S:
            return False
        known.asked_at = now
        return True

    def add_reply(self, target: ThingTarget, evidence: Evidence) -> None:
        """Receive a VLM's evidence on this object."""
        known = self._entry(target)
        known.vlm = ladder.restrict(evidence, self._among)
        self._decide_again(target, known)

    def _decide_again(self, target: ThingTarget, known: ObjectState) -> Verdict:
        """Decide from all evidence, and with a whole object on the surfaces that it stands for."""
        new = ladder.decide(self._evidence(target, known), self._table)
        known.verdict = ladder.apply_hysteresis(known.verdict, new)
        if isinstance(target, ObjectTarget) and target.surface == 0:
            for surface in self.surfaces_known(target.object_id)[1:]:
                self._decide_again(surface, self.known[surface])
        return known.verdict

    def _entry(self, target: ThingTarget) -> ObjectState:
        known = self.known.get(target)
        return self._new(target) if known is None else known

    def _new(self, target: ThingTarget) -> ObjectState:
        known = ObjectState(self.facts(whole(target)) or self._overrides.facts(target))
        if len(self.known) < MAX_KNOWN or self._has_made_room():
            self.known[target] = known
        return known

    def _has_made_room(self) -> bool:
        """Forget the oldest undeclared object, if there is one."""
        undeclared = next((target for target in self.known if target not in self._declared), None)
        return undeclared is not None and self.known.pop(undeclared, None) is not None

    def _evidence(self, target: ThingTarget, known: ObjectState) -> tuple[Evidence, ...]:
        given = self._without_pictures(target, known)
        if known.recognised is None and known.vlm is None and not ladder.is_sure(given):
            known = self.known.get(whole(target), known)
        recognised = () if known.recognised is None else (known.recognised.evidence,)
        reply = () if known.vlm is None else (known.vlm,)
        return (*given, *recognised, *reply)

    def _without_pictures(self, target: ThingTarget, known: ObjectState) -> tuple[Evidence, ...]:
        """Return the evidence of the rungs that need no frame."""
        given = self._given(target, known)
        shown = self.textures.evidence_of(target)
        if shown is None or ladder.is_sure(given):
            return given
        return (*given, ladder.restrict(shown, self._among))

    def _given(self, target: ThingTarget, known: ObjectState) -> tuple[Evidence, ...]:
        if known.declared is None:
            facts = as_surface(target, known.facts)
            known.declared = from_declaration(target, facts, self._lexicon)
            name, surface = name_of(target, facts), surface_name_of(facts)
            known.detail = sub_materials.from_name(name or "", self._lexicon, surface)
            known.table = known.detail.refine(self._table)
        return known.declared
