"""Reads a message as far as it can be used, and names each part that it left out or changed.

One bad field must not silence a whole scene, and a speed that is a hair too high must not lose a
touch. So a message that `messages.decode` refuses is read once more, by one rule: the smallest part
that may be missing is left out, and counts as not sent.

- Of a scene: a bad optional field is left out; without a required one the object is. Names and
  lists that are too long are cut; measured quantities out of range become the nearest limit.
  An unknown material, and a second object with the id of an earlier one, are left out.
- A temperature out of range is left out and never changed, because it is felt on skin. A quantity
  that is not a number is left out.
- Of a touch: speed, force, distance and closing speed out of range become the nearest limit.
- Everywhere: a number without a fraction is an integer, 3.0 as well as 3, and a field that is null
  is absent.

Everything else is refused, as are ids, phases and unknown fields of a touch. A message in order
costs one decoding, as before. Pure.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar, cast

import msgspec
from msgspec import Meta, Raw

from hapticvlm import materials, messages
from hapticvlm.messages import (
    ClientMessage,
    LeftOut,
    MessageError,
    Scene,
    SceneObject,
)

MAX_OBJECTS = 4096  # of one scene, as in `messages.Scene`
MAX_LISTED = 32  # parts that an answer names; it gives the number of the others
MAX_FAULTS = 16  # of one object, which is left out beyond them
MAX_OBJECT_BYTES = 64 * 1024  # of an object that is repaired; the longest in order has 20 KB
MAX_FIELD_BYTES = 1024 * 1024  # of another field of such a message
REQUIRED = ("type", "id", "replace", "objects")  # fields of a scene
MEASURED = ("speed_mps", "force_n", "distance_m", "closing_mps")  # fields of a touch
_BOUND = re.compile(r"Expected `(float|str|array)` (of length )?(<=|>=) (-?[\d.]+)$")
_STEP = re.compile(r"\.([^.\[\]]+)|\[(\d+)\]")
Json = dict[str, Any]
Path = tuple[str | int, ...]
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class PartialMessage:
    """A message as it is used, and the parts of it that were left out or changed, if any."""

    message: ClientMessage
    left_out: tuple[LeftOut, ...] = ()


def decode(data: bytes | str, known_materials: Collection[str]) -> PartialMessage:
    """Parse one WebSocket message, a scene in part; raises MessageError where nothing is usable.

    `known_materials` are those that an object may state, besides unknown.
    """
    try:
        message = messages.decode(data)
    except MessageError as error:
        if error.path is None:  # not even a map
            raise
        try:
            return _repaired(data, {*known_materials, materials.UNKNOWN})
        except msgspec.ValidationError as remaining:
            raise messages.explained(str(remaining), error.id) from None
        except (msgspec.MsgspecError, ValueError, RecursionError):
            raise error from None
    if isinstance(message, Scene):
        return _usable_scene(message, None, {*known_materials, materials.UNKNOWN}, [])
    return PartialMessage(message)


def listed(left_out: Sequence[LeftOut]) -> tuple[LeftOut, ...]:
    """Return the first of these and how many more there are, so that an answer stays short."""
    if len(left_out) <= MAX_LISTED:
        return tuple(left_out)
    more = len(left_out) - MAX_LISTED
    return (*left_out[:MAX_LISTED], LeftOut(path="objects", text=f"{more} more parts like these"))


# A stranger may fill a message with a million empty maps, each of which costs far more memory than
# its one byte. So only pieces of a bounded size are read without a type.
_Fields = Annotated[dict[str, Raw], Meta(max_length=32)]
_Objects = Annotated[list[Raw], Meta(max_length=16 * MAX_OBJECTS)]


def _repaired(data: bytes | str, known: set[str]) -> PartialMessage:
    """Read a message that is not in order. Raises MsgspecError and others if it stays so."""
    codec = msgspec.json if isinstance(data, str) else msgspec.msgpack
    pieces = codec.decode(data, type=_Fields)
    kind = codec.decode(pieces.get("type", b""), type=str)
    pictures = {"image", "mask"} if kind == "frame" and codec is msgspec.msgpack else set()
    objects = pieces.pop("objects", None) if kind == "scene" else None
    if any(len(piece) > MAX_FIELD_BYTES for name, piece in pieces.items() if name not in pictures):
        raise ValueError("a field is too long to be repaired")
    value = {
        name: codec.decode(piece, type=bytes if name in pictures else Any)
        for name, piece in pieces.items()
    }
    value = {name: each for name, each in value.items() if each is not None}
    if objects is not None:
        try:
            given = codec.decode(objects, type=_Objects)
        except msgspec.ValidationError as error:
            raise ValueError("no list, or far too long") from error
        return _repaired_scene(value, given, codec, known)
    repair = _Repair((), measured=MEASURED if kind == "touch" else ())
    message: ClientMessage = repair.convert(value, ClientMessage)  # type: ignore[arg-type]
    if kind == "frame" and not pictures:
        raise ValueError("text messages carry no images")
    return PartialMessage(message, listed(repair.left_out))


def _repaired_scene(value: Json, given: list[Raw], codec: Any, known: set[str]) -> PartialMessage:  # noqa: ANN401
    whole = _Repair((), is_scene=True)
    scene = whole.convert({**value, "objects": []}, Scene)
    left_out = whole.left_out
    objects: list[SceneObject] = []
    places: list[int] = []
    for place, piece in enumerate(given[:MAX_OBJECTS]):
        try:
            usable: SceneObject | None = codec.decode(piece, type=SceneObject)
        except (msgspec.DecodeError, ValueError, RecursionError):
            usable = _repaired_object(place, piece, codec, left_out)
        if usable is not None:
            objects.append(usable)
            places.append(place)
    if len(given) > MAX_OBJECTS:
        text = (
            f"{len(given)} objects were sent and the limit is {MAX_OBJECTS}: the rest was left "
            "out; send it in another scene with `replace` false"
        )
        left_out.append(LeftOut(path=f"objects[{MAX_OBJECTS}]", text=text))
    scene = msgspec.structs.replace(scene, objects=objects)
    return _usable_scene(scene, places, known, left_out)


def _repaired_object(
    place: int,
    piece: Raw,
    codec: Any,  # noqa: ANN401 - msgspec's module for this encoding
    left_out: list[LeftOut],
) -> SceneObject | None:
    base: Path = ("objects", place)
    if len(piece) > MAX_OBJECT_BYTES:
        text = f"the object has {len(piece)} bytes and the limit is {MAX_OBJECT_BYTES}; shorten it"
        left_out.append(LeftOut(path=_shown(base), text=text))
        return None
    repair = _Repair(base, is_scene=True)
    try:
        return repair.convert(codec.decode(piece), SceneObject)
    except (msgspec.DecodeError, ValueError, RecursionError) as error:
        said = repair.left_out[-1].text if repair.left_out else f"left out: {_reason(str(error))}"
        repair.left_out = [LeftOut(path=_shown(base), text=said)]
        return None
    finally:
        left_out += repair.left_out


def _usable_scene(
    scene: Scene, places: list[int] | None, known: set[str], left_out: list[LeftOut]
) -> PartialMessage:
    """Leave out unknown materials and repeated ids.

    `places` are the objects' places in the message, None where all of them are in order.
    """
    objects = scene.objects
    first: dict[str, int] = {}
    is_changed = False
    usable: list[SceneObject] = []
    for index, each in enumerate(objects):
        place = index if places is None else places[index]
        earlier = first.setdefault(each.object_id, place)
        if earlier != place:
            left_out.append(_repeated_id(each.object_id, place, earlier))
            is_changed = True
            continue
        stated = _with_known_materials(each, f"objects[{place}]", known, left_out)
        is_changed |= stated is not each
        usable.append(stated)
    if is_changed:
        scene = msgspec.structs.replace(scene, objects=usable)
    scene = _with_known_candidates(scene, known, left_out)
    return PartialMessage(scene, listed(sorted(left_out, key=_object_number)))


def _repeated_id(object_id: str, place: int, earlier: int) -> LeftOut:
    text = (
        f"objects[{earlier}] has the id `{object_id}` too: this one was left out; "
        "give each object its own id"
    )
    return LeftOut(path=f"objects[{place}].object_id", text=text)


def _with_known_candidates(scene: Scene, known: set[str], left_out: list[LeftOut]) -> Scene:
    """Return a scene without unknown names in its list of materials."""
    names = scene.materials or []
    unknown = [name for name in names if name not in known]
    if not unknown:
        return scene
    left_out += (_no_material(name, f"materials[{names.index(name)}]", known) for name in unknown)
    remaining = [name for name in names if name in known]
    return msgspec.structs.replace(scene, materials=remaining or None)


def _with_known_materials(
    given: SceneObject, path: str, known: set[str], left_out: list[LeftOut]
) -> SceneObject:
    """Return an object without unknown materials of its own and of its surfaces."""
    if given.material is not None and given.material not in known:
        left_out.append(_no_material(given.material, f"{path}.material", known))
        given = msgspec.structs.replace(given, material=None)
    for number, surface in enumerate(given.surfaces or ()):
        if surface.material is not None and surface.material not in known:
            part = f"{path}.surfaces[{number}].material"
            left_out.append(_no_material(surface.material, part, known))
            surfaces = list(given.surfaces or ())
            surfaces[number] = msgspec.structs.replace(surface, material=None)
            given = msgspec.structs.replace(given, surfaces=surfaces)
    return given


def _object_number(part: LeftOut) -> int:
    """Return the number of the object that this part belongs to; -1: to the scene itself."""
    number = re.match(r"objects\[(\d+)\]", part.path)
    return int(number[1]) if number else -1


def _no_material(name: str, path: str, known: Collection[str]) -> LeftOut:
    problem = materials.no_material(name, sorted(known)).partition("; known")[0]
    return LeftOut(path=path, text=f"left out: {problem}; state one of `welcome.materials`")


def _clamped(
    path: Path, found: object, limit: float, *, is_above: bool
) -> tuple[object, str] | None:
    """Return the limit instead of a number beyond it; None for a temperature, which is refused."""
    is_temperature = str(path[-1]).endswith("_c")
    if is_temperature or not isinstance(found, int | float) or math.isnan(found):
        return None
    side = "above" if is_above else "below"
    return limit, f"{found!r} is {side} the limit of {limit:g}, which is used; stay within it"


def _cut(path: Path, found: object, size: int) -> tuple[object, str] | None:
    """Return a list or a name that is too long, cut to this size."""
    said = f"were sent and the limit is {size}: cut; shorten it"
    if isinstance(found, list):
        return found[:size], f"{len(found)} entries {said}"
    if isinstance(found, str) and path[-1] == "name":  # the last part of a path is the object's own
        return found[-size:], f"{len(found)} characters {said}"
    return None


class _Repair:
    """Changes one value until it is in order, and keeps a list of the parts that it changed."""

    def __init__(
        self, base: Path, *, measured: Collection[str] = (), is_scene: bool = False
    ) -> None:
        self.left_out: list[LeftOut] = []
        self._base = base
        self._measured = measured
        self._is_scene = is_scene
        self._removed: dict[Path, int] = {}  # parts removed, and their place in `left_out`
        self._shifts: Counter[Path] = Counter()  # items removed from each list so far
        self._was_changed: set[Path] = set()

    def convert(self, value: Any, kind: type[T]) -> T:  # noqa: ANN401 - whatever was sent
        """Return the value as this type. Raises ValidationError where no repair is possible."""
        for _ in range(MAX_FAULTS):
            try:
                return msgspec.convert(value, kind)
            except msgspec.ValidationError as error:
                value = self._without_fault(value, error)
        return msgspec.convert(value, kind)

    def _without_fault(self, value: Any, error: msgspec.ValidationError) -> Any:  # noqa: ANN401
        """Return a copy of the value without this fault. Raises the error if it has to stay."""
        text, _, where = str(error).partition(" - at ")
        try:
            path = _path_of(text, where)
            found = _at(value, path)
        except (LookupError, TypeError):  # a name of an unknown field that looks like a path
            raise error from None
        if _is_whole(text, found):
            return _with(value, path, int(cast(float, found)))
        if isinstance(found, float) and math.isnan(found):
            text = "NaN is not a number"
        refusal = msgspec.ValidationError(f"{text} - at {where}" if where else text)
        if not self._may_change(path):
            raise refusal
        nearest = self._nearest(path, text, found)
        if nearest is not None and path not in self._was_changed:
            self._was_changed.add(path)
            changed, said = nearest
            self.left_out.append(LeftOut(path=self._name(path), text=said))
            return _with(value, path, changed)
        if not self._may_leave_out(path):
            raise refusal
        return self._without(value, path, text)

    def _may_change(self, path: Path) -> bool:
        """Whether a wrong part is mended: any of a scene, the measured quantities of a touch."""
        return self._is_scene or (len(path) == 1 and path[0] in self._measured)

    def _may_leave_out(self, path: Path) -> bool:
        """Whether a message can do without this part."""
        return self._is_scene and bool(path) and (bool(self._base) or path[0] not in REQUIRED)

    def _nearest(self, path: Path, text: str, found: object) -> tuple[object, str] | None:
        """Return what a value that is out of range becomes, and a sentence about it, if it may."""
        bound = _BOUND.match(text)
        if bound is None or not path:
            return None
        is_above = bound[3] == "<="
        if bound[1] == "float":
            return _clamped(path, found, float(bound[4]), is_above=is_above)
        return _cut(path, found, int(float(bound[4]))) if is_above else None

    def _without(self, value: Any, path: Path, text: str) -> Any:  # noqa: ANN401
        """Leave this part out. What misses the part removed before is removed in its place."""
        inner = [part for part in self._removed if part[: len(path)] == path != part]
        if inner:
            place = self._removed[inner[-1]]
            self.left_out[place] = LeftOut(path=self._name(path), text=self.left_out[place].text)
        else:
            reason = _reason(text)
            place = len(self.left_out)
            self.left_out.append(LeftOut(path=self._name(path), text=f"left out: {reason}"))
        self._removed[path] = place
        if path[:-1] == ("surfaces",):  # touches count surfaces, so that none may move up
            return _with(value, path, {"name": ""})
        if isinstance(path[-1], int):
            self._shifts[path[:-1]] += 1
        return _with(value, path, _MISSING)

    def _name(self, path: Path) -> str:
        """Return the path of a part as it was sent, before items of its list were left out."""
        last = path[-1]
        if isinstance(last, int):
            path = (*path[:-1], last + self._shifts[path[:-1]])
        return _shown(self._base + path)


_MISSING = object()


def _is_whole(text: str, found: object) -> bool:
    """Whether an integer was sent as a number with a fraction of nothing."""
    is_expected = text.startswith("Expected `int")
    return is_expected and isinstance(found, float) and found.is_integer() and abs(found) < 2**53


def _path_of(text: str, where: str) -> Path:
    """Return the path of a fault that msgspec found. Raises LookupError for a key of a map."""
    if "`key`" in where:
        raise LookupError("a key that is not text")
    path = tuple(name or int(index) for name, index in _STEP.findall(where.strip("`")))
    if text.startswith("Object contains unknown field"):
        return (*path, text[text.index("`") + 1 : text.rindex("`")])
    return path


def _at(value: Any, path: Path) -> object:  # noqa: ANN401
    for step in path:
        value = value[step]
    return value


def _with(value: Any, path: Path, new: object) -> Any:  # noqa: ANN401
    """Return a copy with another value at this place, or without it where it is _MISSING."""
    first, *rest = path
    changed: Any = list(value) if isinstance(value, list) else dict(value)
    if rest:
        changed[first] = _with(value[first], tuple(rest), new)
    elif new is _MISSING:
        del changed[first]
    else:
        changed[first] = new
    return changed


def _reason(text: str) -> str:
    """Return the reason of a refusal and its cure, without the path."""
    return messages.explained(text).text.partition(": ")[2]


def _shown(path: Path) -> str:
    """Write a path as in `objects[3].name`."""
    steps = (f"[{step}]" if isinstance(step, int) else f".{step}" for step in path)
    return "".join(steps).removeprefix(".")
