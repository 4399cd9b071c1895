"""Every wire message of protocol v1, declared once; decode, encode, MessageError.

After `decode` a message is right: type, range, size, finiteness. Units stand in the field names
(`_c` degC, `_s` s, `_ms` ms, `_mps` m/s, `_n` N). Knows nothing of sockets, sessions or devices.
"""

from __future__ import annotations

import re
from typing import Annotated, Literal, get_args, get_origin

import msgspec
from msgspec import Meta, Struct

from hapticvlm.errors import HapticVLMError

PROTOCOL_MAJOR = 1
PROTOCOL_MINOR = 1
MAX_SIDE_PX = 4096
MAX_MESSAGE_BYTES = 4 * 1024 * 1024
FRAMES_PER_S = 90.0
LEASE_MS = 250

RequestId = Annotated[int, Meta(ge=1, le=2**53 - 1, description="echoed in the reply")]
Clock = Annotated[float, Meta(ge=-1e12, le=1e12, description="seconds on the client's clock")]
Celsius = Annotated[float, Meta(ge=-100.0, le=400.0)]
AmbientCelsius = Annotated[float, Meta(ge=-60.0, le=80.0)]
Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Side = Annotated[int, Meta(ge=1, le=MAX_SIDE_PX)]
ObjectId = Annotated[str, Meta(min_length=1, max_length=128)]
MaterialName = Annotated[str, Meta(min_length=1, max_length=64)]
Label = Annotated[str, Meta(max_length=256)]
Picture = Annotated[bytes, Meta(min_length=1, max_length=MAX_MESSAGE_BYTES)]

ErrorCode = Literal[
    "protocol", "message", "limit", "overload", "unsafe", "device", "model", "not_owner"
]
Scope = Literal["all", "speaker", "peltier"]
Phase = Literal["approach", "contact", "slide", "release"]
Interaction = Literal["tap", "strike", "press", "slide", "carve", "swing"]
HandName = Literal["left", "right"]
Rung = Literal["scene", "name", "shader", "encoder", "vlm", "unknown"]
AmbientSource = Literal["scene", "vlm", "default"]
Limit = Literal["setpoint", "slew", "current", "sink", "dose"]
SurfaceSource = Literal["scene", "name", "sun", "ambient"]
SkipReason = Literal["superseded", "stale", "unchanged", "rate"]
FeelForm = Literal["amplitude", "parametric"]
Basis = Literal["material", "expectation", "neutral"]


class MessageError(HapticVLMError):
    """The peer's fault: what is wrong, where, and what to do; changes no output."""

    def __init__(self, code: ErrorCode, text: str, *, path: str | None = None, id: int = 0) -> None:
        super().__init__(text)
        self.code: ErrorCode = code
        self.text = text
        self.path = path
        self.id = id


class Wire(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True, kw_only=True):
    """Common rules: immutable, no unknown fields, missing optional fields are absent."""


class Party(Wire, frozen=True):
    """Who speaks: a client or the service."""

    name: Annotated[str, Meta(min_length=1, max_length=128)]
    version: Annotated[str, Meta(max_length=64)]


class ProtocolVersion(Wire, frozen=True):
    """Same major needed; a newer minor is answered with the service's own."""

    major: Annotated[int, Meta(ge=0, le=1000)]
    minor: Annotated[int, Meta(ge=0, le=1000)]


class Region(Wire, frozen=True):
    """A rectangle of the upright frame, as fractions counted from the top left."""

    x: Share
    y: Share
    w: Annotated[float, Meta(gt=0.0, le=1.0)]
    h: Annotated[float, Meta(gt=0.0, le=1.0)]


class Shader(Wire, frozen=True):
    """Physically based shader parameters; base_color is linear or sRGB red, green, blue."""

    metallic: Share | None = None
    roughness: Share | None = None
    transmission: Share | None = None
    base_color: tuple[Share, Share, Share] | None = None


class Vibrates(Wire, frozen=True):
    """How an object vibrates by itself; `level` is how strongly it is felt in the hand."""

    frequency_hz: Annotated[float, Meta(ge=15.0, le=360.0)]
    level: Share
    on: bool = True


class SceneObject(Wire, frozen=True):
    """What the scene says of one object; everything but the id is optional.

    `sunlit` says whether the sun shines on it now: an object in the sun is warmer than the air.
    What `vibrates` is felt through whatever touches it: `stands_on` names what carries an object.
    Without `vibrates` its name may say so; `on` false says that it does not.
    """

    object_id: ObjectId
    name: Label | None = None
    material: MaterialName | None = None
    temperature_c: Celsius | None = None
    shader: Shader | None = None
    thickness_m: Annotated[float, Meta(gt=0.0, le=10.0)] | None = None
    sunlit: bool | None = None
    vibrates: Vibrates | None = None
    stands_on: Annotated[list[ObjectId], Meta(max_length=16)] | None = None


class Hello(Wire, frozen=True, tag="hello", tag_field="type"):
    """First message of every connection."""

    id: RequestId
    client: Party
    protocol: ProtocolVersion
    role: Literal["scene", "observer"]
    token: Annotated[str, Meta(max_length=256)] | None = None


class Scene(Wire, frozen=True, tag="scene", tag_field="type"):
    """Objects of the scene; `replace` forgets those not listed.

    `forget` names objects that are no more: what breaks or is shot costs a scene one id then, and
    not all its objects anew. An id that is not known is no error.
    `materials` are all that the scene's objects can be made of: recognition considers no other.
    An observer on the service's own machine may state materials of the owner's objects: `object_id`
    and `material` only, with `replace` false.
    """

    id: RequestId
    objects: Annotated[list[SceneObject], Meta(max_length=4096)]
    replace: bool
    forget: Annotated[list[ObjectId], Meta(max_length=4096)] | None = None
    ambient_c: AmbientCelsius | None = None
    materials: Annotated[list[MaterialName], Meta(min_length=1, max_length=64)] | None = None


class Frame(Wire, frozen=True, tag="frame", tag_field="type"):
    """One rendered frame; `mask` is an 8-bit PNG of the frame's size, nonzero = object."""

    id: RequestId
    captured_at: Clock
    format: Literal["jpeg", "png", "rgb8", "rgba8"]
    width: Side
    height: Side
    image: Picture
    origin: Literal["top", "bottom"]
    purpose: Literal["live", "enrol"] = "live"
    object_id: ObjectId | None = None
    region: Region | None = None
    mask: Picture | None = None
    max_age_ms: Annotated[float, Meta(ge=0.0, le=60_000.0)] | None = None


class Touch(Wire, frozen=True, tag="touch", tag_field="type"):
    """What a hand does now; renews that hand's lease unless it is a release.

    `distance_m` to the object and `closing_mps`, the speed at which it shrinks (negative: it
    grows), say when an approach will become a contact; the plate leads by that time.
    """

    id: RequestId
    phase: Phase
    captured_at: Clock
    hand: HandName
    speed_mps: Annotated[float, Meta(ge=0.0, le=20.0)]
    force_n: Annotated[float, Meta(ge=0.0, le=200.0)]
    object_id: ObjectId | None = None
    region: Region | None = None
    interaction: Interaction | None = None
    distance_m: Annotated[float, Meta(ge=0.0, le=100.0)] | None = None
    closing_mps: Annotated[float, Meta(ge=-20.0, le=20.0)] | None = None


class Feel(Wire, frozen=True):
    """Which hands get `vibration` events, and in which form; a hand that is absent gets none.

    `amplitude` is one value a display frame, for actuators of one frequency; `parametric` is finer
    and brings frequencies and transients too.
    """

    left: FeelForm | None = None
    right: FeelForm | None = None


class Set(Wire, frozen=True, tag="set", tag_field="type"):
    """Settings of this connection's session; `feel` and gains are the owner's alone.

    `ownership`: a scene may take the outputs when nobody owns them or their owner has touched
    nothing for 30 s, and its owner may give them up, as a tool that only shows pictures does;
    anybody may end the owner's connection. The event `ownership` says when the outputs are free.
    Gains, `feel` and the touch are sent again after they were taken.
    """

    id: RequestId
    ambient_c: AmbientCelsius | None = None
    vibration_gain: Share | None = None
    thermal_gain: Share | None = None
    watch: Annotated[list[Literal["frames", "waveform", "log"]], Meta(max_length=3)] | None = None
    feel: Feel | None = None
    ownership: Literal["take", "give", "end"] | None = None


class Stop(Wire, frozen=True, tag="stop", tag_field="type"):
    """Rest the outputs at once; always honoured, never queued.

    The scope is held at rest for each hand until the owner sends `release` of that hand and then a
    new `approach` or `contact`. A new session does not undo it: a scene that begins sends
    `release` of each hand that touches nothing, so that its first touch is felt.
    """

    id: RequestId
    scope: Scope


ClientMessage = Hello | Scene | Frame | Touch | Set | Stop


class SetpointRange(Wire, frozen=True):
    """The band the plate's setpoint is kept in, degC."""

    low: float
    high: float


class Limits(Wire, frozen=True):
    """What the service enforces."""

    message_bytes: int
    pixels: int
    frames_per_s: float
    lease_ms: int
    setpoint_c: SetpointRange


class Device(Wire, frozen=True):
    """One output and whether it is simulated."""

    name: str
    simulated: bool


class Devices(Wire, frozen=True):
    """The outputs of this service."""

    speaker: Device
    peltier: Device


class Models(Wire, frozen=True):
    """What decides; absent = not loaded."""

    encoder: str | None = None
    gallery: str | None = None
    vlm: str | None = None


class Privacy(Wire, frozen=True):
    """What happens to pictures; a crop shows one object, cut out of its frame."""

    frames_stored: bool
    frames_leave_machine: bool
    crops_leave_machine: bool = False


class Welcome(Wire, frozen=True, tag="welcome", tag_field="type"):
    """The answer to hello."""

    id: RequestId
    service: Party
    protocol: ProtocolVersion
    session: str
    owner: bool
    limits: Limits
    devices: Devices
    models: Models
    materials: list[str]
    privacy: Privacy


class EvidenceItem(Wire, frozen=True):
    """What one rung of the ladder says."""

    rung: Rung
    material: str
    confidence: Share


class Decision(Wire, frozen=True, tag="decision", tag_field="type"):
    """What an object is and how it will feel; id 0 when it is an event.

    `sub_material` is what its name says it is made of more exactly, with bulk values of its own;
    `thickness_m` is the thickness that its temperature is computed with, absent when it is thick.
    `basis` says what the feel is made from: the material, the expectation over all materials
    believed in while none is sure enough to be named, or neither (neutral).
    Observers also get its `name`, as the scene gave it.
    """

    id: int
    material: str
    confidence: Share
    source: Rung
    cached: bool
    evidence: list[EvidenceItem]
    ambient_c: float
    ambient_low_c: float
    ambient_high_c: float
    ambient_source: AmbientSource
    surface_c: float
    surface_low_c: float
    surface_high_c: float
    surface_source: SurfaceSource
    surface_why: str
    contact_c: float | None
    setpoint_c: float
    unlimited_c: float
    thermal_cue: bool
    object_id: str | None = None
    name: str | None = None
    runner_up: str | None = None
    limited_by: Limit | None = None
    pattern: str | None = None
    basis: Basis | None = None
    stages_ms: dict[str, float] = {}
    frame_age_ms: float | None = None
    sub_material: str | None = None
    thickness_m: float | None = None


class Telemetry(Wire, frozen=True, tag="telemetry", tag_field="type"):
    """State of the outputs, ten times a second, to every connection.

    `speaker_level` is the rms of the loudest few milliseconds since the telemetry before.
    """

    id: int
    plate_c: float | None
    setpoint_c: float
    sink_c: float | None
    duty: float
    speaker_level: float
    underruns: int
    dropped_frames: int
    leases: int
    faults: list[str]


class View(Wire, frozen=True, tag="view", tag_field="type"):
    """What an observer asked to watch; nobody else gets it.

    A waveform comes in pieces that follow each other: `start` is the number of its first sample,
    counted at `rate_hz` since the audio engine began.
    """

    id: int
    kind: Literal["frames", "waveform", "log"]
    object_id: str | None = None
    region: Region | None = None
    format: str | None = None
    image: bytes | None = None
    mask: bytes | None = None
    origin: Literal["top", "bottom"] | None = None
    rate_hz: float | None = None
    start: int | None = None
    samples: list[float] | None = None
    text: str | None = None


class Transient(Wire, frozen=True):
    """A short pulse within a plan, `at_ms` after the plan begins."""

    at_ms: float
    amplitude: Share
    frequency_hz: float


class Vibration(Wire, frozen=True, tag="vibration", tag_field="type"):
    """What one hand feels from now on: a short plan that replaces the one before. An event.

    `amplitude` holds one value for each `period_ms`, 1 for the strongest that a controller can: it
    is on the scale of controllers, so play it as it is. After the last value there is silence, so a
    lost link ends within 100 ms. `frequency_hz` is as long or, in the form `amplitude`, empty; a
    transient is part of the amplitude too. An empty plan means silence now; `stopped` says that a
    `stop`, perhaps of another connection, holds the vibration.
    """

    id: int
    hand: HandName
    period_ms: float
    amplitude: list[Share] = []
    frequency_hz: list[float] = []
    transients: list[Transient] = []
    stopped: bool = False


class Ownership(Wire, frozen=True, tag="ownership", tag_field="type"):
    """Sent to each scene when the outputs become free or change hands. An event.

    `owner`: whether this scene owns them now. `free`: whether nobody does; a scene that wants them
    answers `set` with `ownership` take, and the first that asks gets them.
    """

    id: int
    owner: bool
    free: bool


class Skipped(Wire, frozen=True, tag="skipped", tag_field="type"):
    """A frame that was not looked at, and why."""

    id: int
    reason: SkipReason


class Ok(Wire, frozen=True, tag="ok", tag_field="type"):
    """Done as asked."""

    id: int


class Error(Wire, frozen=True, tag="error", tag_field="type"):
    """Refused, and why; id 0 when the request had none or it is an event."""

    id: int
    code: ErrorCode
    text: str
    path: str | None = None


ServiceMessage = (
    Welcome | Decision | Telemetry | View | Vibration | Ownership | Skipped | Ok | Error
)

_msgpack_decoder: msgspec.msgpack.Decoder[ClientMessage] = msgspec.msgpack.Decoder(ClientMessage)
_json_decoder: msgspec.json.Decoder[ClientMessage] = msgspec.json.Decoder(ClientMessage)
_msgpack_encoder = msgspec.msgpack.Encoder()
_json_encoder = msgspec.json.Encoder()


def _words(kind: object) -> tuple[str, ...]:
    """List the words that a type is a choice of, wherever in it the choice stands."""
    if get_origin(kind) is Literal:
        return get_args(kind)
    return tuple(word for part in get_args(kind) for word in _words(part))


_CHOICES = {"type": tuple(str(kind.__struct_config__.tag) for kind in get_args(ClientMessage))} | {
    field.name: words
    for kind in (*get_args(ClientMessage), Feel)
    for field in msgspec.structs.fields(kind)
    if (words := _words(field.type))
}


class _IdOnly(Struct):
    id: int = 0


def decode(data: bytes | str) -> ClientMessage:
    """Parse one WebSocket message: bytes are MessagePack, str is JSON. Raises MessageError."""
    try:
        message = _parse(data)
    except msgspec.ValidationError as error:
        raise _explain(str(error), _id_of(data)) from None
    except (msgspec.DecodeError, ValueError, RecursionError) as error:
        kind = "JSON" if isinstance(data, str) else "MessagePack"
        text = f"not a {kind} map: {error}; send one {kind} map per WebSocket message"
        raise MessageError("message", text) from None
    if isinstance(data, str) and isinstance(message, Frame):
        text = "$.image: text messages carry no images; send frames as MessagePack"
        raise MessageError("message", text, path="$.image", id=message.id)
    return message


def encode(message: ServiceMessage | ClientMessage, *, as_text: bool) -> bytes | str:
    """Write one message: JSON text or MessagePack bytes."""
    if as_text:
        return _json_encoder.encode(message).decode()
    return _msgpack_encoder.encode(message)


def _parse(data: bytes | str) -> ClientMessage:
    if isinstance(data, str):
        return _json_decoder.decode(data)
    return _msgpack_decoder.decode(data)


def _id_of(data: bytes | str) -> int:
    try:
        if isinstance(data, str):
            found = msgspec.json.decode(data, type=_IdOnly).id
        else:
            found = msgspec.msgpack.decode(data, type=_IdOnly).id
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return 0
    return found if 1 <= found < 2**53 else 0


def _explain(reason: str, id: int) -> MessageError:
    text, _, where = reason.partition(" - at ")
    path = where.strip("`") or "$"
    code: ErrorCode = "message"
    cure = "see schemas/messages.schema.json"
    field = "type" if text.endswith("field `type`") else re.sub(r"\[.*\]$", "", path).split(".")[-1]
    if "Invalid" in text or text.endswith("field `type`"):
        cure = f"`{field}` is one of {', '.join(_CHOICES.get(field, ()))}"
    elif "unknown field" in text:
        path += "." + text.split("`")[1]
        cure = "remove it or correct its spelling"
    elif "missing required field" in text:
        cure = "add it"
    elif re.search(r"<=|>=|<|>|length", text):
        code = "limit"
        cure = "keep the value within this limit"
    elif "Expected" in text:
        cure = "send the expected type"
    return MessageError(code, f"{path}: {text}; {cure}", path=path, id=id)
