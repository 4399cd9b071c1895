"""Every wire message of protocol v1, declared once; decode, encode, MessageError.

After `decode` a message is right: type, range, size, finiteness. Units stand in the field names
(`_c` degC, `_s` s, `_ms` ms, `_mps` m/s, `_n` N). Knows nothing of sockets, sessions or devices.

The text below a field or a choice says what it means. `make schemas` carries it from here into the
JSON Schema, AsyncAPI and docs/protocol.md, so that each is said once.
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

RequestId = Annotated[int, Meta(ge=1, le=2**53 - 1)]
Clock = Annotated[float, Meta(ge=-1e12, le=1e12)]
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
"""Not allowed in this state or role (protocol), malformed (message), out of range (limit). Too much
waits (overload), or a stop holds the outputs (unsafe). An output (device) or a network (model)
fails. Another scene owns the outputs (not_owner)."""
Scope = Literal["all", "speaker", "peltier"]
"""Which outputs a stop rests. The scope speaker includes controllers."""
Phase = Literal["approach", "contact", "slide", "release"]
"""approach: near and not touching yet; contact: touches, without rubbing; slide: rubs along;
release: touches nothing any more."""
Interaction = Literal["tap", "strike", "press", "slide", "carve", "swing"]
"""The kind of touch. A swing moves through air and needs no contact."""
HandName = Literal["left", "right"]
"""Each hand is rendered by itself."""
Rung = Literal["scene", "name", "shader", "encoder", "vlm", "unknown"]
"""What a material is decided from: the scene states it, the object's name or shader implies it, the
network or the vision-language model saw it, or nothing is sure enough."""
AmbientSource = Literal["scene", "vlm", "default"]
"""Stated by the scene, read from a picture by the vision-language model, or 22 degC."""
Limit = Literal["setpoint", "slew", "current", "sink", "dose"]
"""What kept the plate from the physical value: its band of temperatures, its speed, its current, a
hot sink, or the dose of heat that skin may take."""
SurfaceSource = Literal["scene", "name", "sun", "ambient"]
"""What the surface's temperature is taken from; ambient where nothing else says anything."""
SkipReason = Literal["superseded", "stale", "unchanged", "rate"]
"""superseded: a newer frame took its place; stale: older than its max_age_ms; unchanged: shows the
object as before; rate: more than frames_per_s."""
FeelForm = Literal["amplitude", "parametric"]
"""amplitude: one value each 12.5 ms, for actuators of one frequency; parametric: amplitude and
frequency each 5 ms, and transients."""
Basis = Literal["material", "expectation", "neutral"]
"""What the feel is made from: the decided material, the expectation over all materials believed in
while none is sure enough to be named, or neither."""
HelloRole = Literal["scene", "observer"]
"""A scene has objects and touches; an observer only watches. Anybody may stop."""
FrameFormat = Literal["jpeg", "png", "rgb8", "rgba8"]
"""rgb8 and rgba8 are raw: width x height x 3 or 4 bytes, row by row."""
FrameOrigin = Literal["top", "bottom"]
"""Whether the first row of the picture is its top or, as OpenGL reads it, its bottom."""
FramePurpose = Literal["live", "enrol"]
"""live: what a hand is at, where the newest frame wins; enrol: to be learned, each one is kept."""
Watch = Literal["frames", "waveform", "log"]
"""Pictures as they are recognised, what the speaker plays, or lines of the service's log."""
SetOwnership = Literal["take", "give", "end"]
"""take: drive the outputs from now on; give: free them; end: close their owner's connection."""


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
    """A name to show to people."""
    version: Annotated[str, Meta(max_length=64)]
    """Its version, in any form."""


class ProtocolVersion(Wire, frozen=True):
    """Same major needed; a newer minor is answered with the service's own."""

    major: Annotated[int, Meta(ge=0, le=1000)]
    """Must be the service's."""
    minor: Annotated[int, Meta(ge=0, le=1000)]
    """A newer one only adds: fields, words and messages."""


class Region(Wire, frozen=True):
    """A rectangle of the upright frame, as fractions counted from the top left."""

    x: Share
    """Left edge, as a share of the width."""
    y: Share
    """Upper edge, as a share of the height."""
    w: Annotated[float, Meta(gt=0.0, le=1.0)]
    """Width, as a share of the frame's."""
    h: Annotated[float, Meta(gt=0.0, le=1.0)]
    """Height, as a share of the frame's."""


WHOLE = Region(x=0.0, y=0.0, w=1.0, h=1.0)


class Shader(Wire, frozen=True):
    """Physically based shader parameters; base_color is linear or sRGB red, green, blue."""

    metallic: Share | None = None
    """1 is metal."""
    roughness: Share | None = None
    """0 is a mirror."""
    transmission: Share | None = None
    """1 is clear as glass."""
    base_color: tuple[Share, Share, Share] | None = None
    """Red, green and blue."""


class Vibrates(Wire, frozen=True):
    """How an object vibrates by itself; `level` is how strongly it is felt in the hand."""

    frequency_hz: Annotated[float, Meta(ge=15.0, le=360.0)]
    """Its fundamental."""
    level: Share
    """As felt by a hand on it."""
    on: bool = True
    """False: it is switched off, also where its name says that it hums."""


class SceneObject(Wire, frozen=True):
    """What the scene says of one object; everything but the id is optional.

    `sunlit` says whether the sun shines on it now: an object in the sun is warmer than the air.
    What `vibrates` is felt through whatever touches it: `stands_on` names what carries an object.
    Without `vibrates` its name may say so; `on` false says that it does not.
    """

    object_id: ObjectId
    """The client's own name for it, the same in touches and frames."""
    name: Label | None = None
    """As the scene calls it, in any language: Oak_Table_02."""
    material: MaterialName | None = None
    """What it is made of, one of the materials in `welcome`; then nothing is to be recognised."""
    temperature_c: Celsius | None = None
    """Of its surface, when the scene knows it."""
    shader: Shader | None = None
    """How it is drawn, which tells metal and glass."""
    thickness_m: Annotated[float, Meta(gt=0.0, le=10.0)] | None = None
    """Thin things take on the temperature of the hand; absent is thick."""
    sunlit: bool | None = None
    """Whether the sun shines on it now."""
    vibrates: Vibrates | None = None
    """How it hums by itself."""
    stands_on: Annotated[list[ObjectId], Meta(max_length=16)] | None = None
    """Ids of what carries it."""


class Hello(Wire, frozen=True, tag="hello", tag_field="type"):
    """First message of every connection."""

    id: RequestId
    """Echoed in the reply."""
    client: Party
    """Who connects."""
    protocol: ProtocolVersion
    """What the client speaks."""
    role: HelloRole
    """Whether it has a scene or watches."""
    token: Annotated[str, Meta(max_length=256)] | None = None
    """Needed where the service was started with one, as it is for other machines."""


class Scene(Wire, frozen=True, tag="scene", tag_field="type"):
    """Objects of the scene; `replace` forgets those not listed.

    `forget` names objects that are no more: what breaks or is shot costs a scene one id then, and
    not all its objects anew. An id that is not known is no error.
    `materials` are all that the scene's objects can be made of: recognition considers no other.
    An observer on the service's own machine may state materials of the owner's objects: `object_id`
    and `material` only, with `replace` false.
    """

    id: RequestId
    """Echoed in the reply."""
    objects: Annotated[list[SceneObject], Meta(max_length=4096)]
    """New objects, and known ones with all that is said of them."""
    replace: bool
    """True: these are all objects; false: those not listed stay as they are."""
    forget: Annotated[list[ObjectId], Meta(max_length=4096)] | None = None
    """Ids of objects that are no more."""
    ambient_c: AmbientCelsius | None = None
    """Air temperature of the scene."""
    materials: Annotated[list[MaterialName], Meta(min_length=1, max_length=64)] | None = None
    """All that objects can be made of; absent: every material of `welcome`."""


class Frame(Wire, frozen=True, tag="frame", tag_field="type"):
    """One rendered frame; `mask` is an 8-bit PNG of the frame's size, nonzero = object."""

    id: RequestId
    """Echoed in the reply."""
    captured_at: Clock
    """When it was rendered, on the client's clock."""
    format: FrameFormat
    """How `image` is written."""
    width: Side
    """In px; must be that of the picture."""
    height: Side
    """In px; must be that of the picture."""
    image: Picture
    """The picture. 448 x 448 px as JPEG, about 20 KB, is enough."""
    origin: FrameOrigin
    """Which row comes first."""
    purpose: FramePurpose = "live"
    """What it is for."""
    object_id: ObjectId | None = None
    """The object it shows; absent: a view in which touches may name regions."""
    region: Region | None = None
    """Where in the upright picture the object is."""
    mask: Picture | None = None
    """Which pixels are the object, which says more than a region."""
    max_age_ms: Annotated[float, Meta(ge=0.0, le=60_000.0)] | None = None
    """Older than this it is skipped; absent: it never is."""


class Touch(Wire, frozen=True, tag="touch", tag_field="type"):
    """What a hand does now; renews that hand's lease unless it is a release.

    `distance_m` to the object and `closing_mps`, the speed at which it shrinks (negative: it
    grows), say when an approach will become a contact; the plate leads by that time.
    """

    id: RequestId
    """Echoed in the reply."""
    phase: Phase
    """What the hand does."""
    captured_at: Clock
    """When it did, on the client's clock."""
    hand: HandName
    """Which hand."""
    speed_mps: Annotated[float, Meta(ge=0.0, le=20.0)]
    """Of the hand relative to the surface; at contact how fast it hits."""
    force_n: Annotated[float, Meta(ge=0.0, le=200.0)]
    """How hard it presses; 1.5 where an engine knows no force."""
    object_id: ObjectId | None = None
    """What it touches. This or a region is needed, but for release and swing."""
    region: Region | None = None
    """What it touches, as a part of the newest frame."""
    interaction: Interaction | None = None
    """The kind of touch; absent: strike at contact, slide while sliding."""
    distance_m: Annotated[float, Meta(ge=0.0, le=100.0)] | None = None
    """To the object, of an approach."""
    closing_mps: Annotated[float, Meta(ge=-20.0, le=20.0)] | None = None
    """How fast the distance shrinks, of an approach."""


class Feel(Wire, frozen=True):
    """Which hands get `vibration` events, and in which form; a hand that is absent gets none.

    `amplitude` is one value a display frame, for actuators of one frequency; `parametric` is finer
    and brings frequencies and transients too.
    """

    left: FeelForm | None = None
    """For the left hand."""
    right: FeelForm | None = None
    """For the right hand."""


class Set(Wire, frozen=True, tag="set", tag_field="type"):
    """Settings of this connection's session; `feel` and gains are the owner's alone.

    `ownership`: a scene may take the outputs when nobody owns them or their owner has touched
    nothing for 30 s. Their owner may give them up, as a tool that only shows pictures does.
    Anybody may end the owner's connection. The event `ownership` says when the outputs are free.
    Gains, `feel` and the touch are sent again after they were taken.
    """

    id: RequestId
    """Echoed in the reply."""
    ambient_c: AmbientCelsius | None = None
    """Air temperature of the scene."""
    vibration_gain: Share | None = None
    """Half the gain is half the vibration. The owner's alone."""
    thermal_gain: Share | None = None
    """0 keeps the plate neutral. The owner's alone."""
    watch: Annotated[list[Watch], Meta(max_length=3)] | None = None
    """What `view` events show. Observers' alone."""
    feel: Feel | None = None
    """Which hands get `vibration` events. The owner's alone."""
    ownership: SetOwnership | None = None
    """Who drives the outputs."""


class Stop(Wire, frozen=True, tag="stop", tag_field="type"):
    """Rest the outputs at once; always honoured, never queued.

    The scope is held at rest for each hand until the owner sends `release` of that hand and then a
    new `approach` or `contact`. A new session does not undo it: a scene that begins sends
    `release` of each hand that touches nothing, so that its first touch is felt.
    """

    id: RequestId
    """Echoed in the reply."""
    scope: Scope
    """Which outputs."""


ClientMessage = Hello | Scene | Frame | Touch | Set | Stop


class SetpointRange(Wire, frozen=True):
    """The band the plate's setpoint is kept in, degC."""

    low: float
    """Coldest, degC."""
    high: float
    """Warmest, degC."""


class Limits(Wire, frozen=True):
    """What the service enforces."""

    message_bytes: int
    """A larger message closes the connection with 1009."""
    pixels: int
    """Longest side of a frame."""
    frames_per_s: float
    """More frames are skipped."""
    lease_ms: int
    """So long an output goes on without a touch that renews it."""
    setpoint_c: SetpointRange
    """The plate's."""


class Device(Wire, frozen=True):
    """One output and whether it is simulated."""

    name: str
    """As a person knows it."""
    simulated: bool
    """Whether nothing real is driven."""


class Devices(Wire, frozen=True):
    """The outputs of this service."""

    speaker: Device
    """What vibrates."""
    peltier: Device
    """What is warm or cold."""


class Models(Wire, frozen=True):
    """What decides; absent = not loaded."""

    encoder: str | None = None
    """The network that sees materials."""
    gallery: str | None = None
    """The reference pictures it compares with."""
    vlm: str | None = None
    """The vision-language model."""


class Privacy(Wire, frozen=True):
    """What happens to pictures; a crop shows one object, cut out of its frame."""

    frames_stored: bool
    """Whether frames are kept on the service's disk."""
    frames_leave_machine: bool
    """Whether frames come from or go to another machine."""
    crops_leave_machine: bool = False
    """Whether cut-out objects go to another machine's recogniser."""


class Welcome(Wire, frozen=True, tag="welcome", tag_field="type"):
    """The answer to hello."""

    id: RequestId
    """Of the hello."""
    service: Party
    """Who answers."""
    protocol: ProtocolVersion
    """What the service speaks."""
    session: str
    """A new one for each connection: what was known of objects before is forgotten."""
    owner: bool
    """Whether this scene drives the outputs."""
    limits: Limits
    """What the service enforces."""
    devices: Devices
    """What it drives."""
    models: Models
    """What it decides with."""
    materials: list[str]
    """All that an object can be stated to be of."""
    privacy: Privacy
    """What happens to pictures."""


class EvidenceItem(Wire, frozen=True):
    """What one rung of the ladder says."""

    rung: Rung
    """Who says it."""
    material: str
    """What it says."""
    confidence: Share
    """How sure it is."""


class Decision(Wire, frozen=True, tag="decision", tag_field="type"):
    """What an object is and how it will feel; id 0 when it is an event.

    `sub_material` is what its name says it is made of more exactly, with bulk values of its own;
    `thickness_m` is the thickness that its temperature is computed with, absent when it is thick.
    `basis` says what the feel is made from: the material, the expectation over all materials
    believed in while none is sure enough to be named, or neither (neutral).
    Observers also get its `name`, as the scene gave it.
    """

    id: int
    """Of the frame it answers, or 0."""
    material: str
    """One of the materials in `welcome`, or unknown."""
    confidence: Share
    """Calibrated: of all that are said with .8, four in five are right."""
    source: Rung
    """What weighed most."""
    cached: bool
    """Whether it was decided before."""
    evidence: list[EvidenceItem]
    """All that was considered."""
    ambient_c: float
    """Air temperature."""
    ambient_low_c: float
    """Lower end of its interval."""
    ambient_high_c: float
    """Upper end of its interval."""
    ambient_source: AmbientSource
    """Where it is from."""
    surface_c: float
    """The object's surface before it is touched."""
    surface_low_c: float
    """Lower end of its interval."""
    surface_high_c: float
    """Upper end of its interval."""
    surface_source: SurfaceSource
    """Where it is from."""
    surface_why: str
    """The same in words for people."""
    contact_c: float | None
    """Where skin and object meet; null: nothing is known to be felt."""
    setpoint_c: float
    """Where the plate goes."""
    unlimited_c: float
    """Where physics alone would put it."""
    thermal_cue: bool
    """Whether the difference to the skin is large enough to be noticed."""
    object_id: str | None = None
    """What was decided; absent: a region of a frame."""
    name: str | None = None
    """As the scene gave it; to observers only."""
    runner_up: str | None = None
    """The second likeliest material."""
    limited_by: Limit | None = None
    """Why setpoint_c is not unlimited_c."""
    pattern: str | None = None
    """What vibrates, such as wood strike; absent: not touched, or nothing is played."""
    basis: Basis | None = None
    """What the feel is made from."""
    stages_ms: dict[str, float] = {}
    """How long each stage of a recognition took; empty where there was none."""
    frame_age_ms: float | None = None
    """How old the frame was that it answers."""
    sub_material: str | None = None
    """What its name says it is made of more exactly, such as cork."""
    thickness_m: float | None = None
    """What its temperature is computed with; absent: thick."""


class Telemetry(Wire, frozen=True, tag="telemetry", tag_field="type"):
    """State of the outputs, ten times a second, to every connection.

    `speaker_level` is the rms of the loudest few milliseconds since the telemetry before.
    """

    id: int
    """0: an event."""
    plate_c: float | None
    """The plate's surface; null: no reading."""
    setpoint_c: float
    """Where it goes."""
    sink_c: float | None
    """Its heat sink; null: no reading."""
    duty: float
    """Its power, -1 (cools) to 1 (heats)."""
    speaker_level: float
    """Of full scale, 0 to 1."""
    underruns: int
    """Blocks that the speaker missed since the start."""
    dropped_frames: int
    """Frames of all connections that were not looked at since the start."""
    leases: int
    """Hands that touch or approach something now."""
    faults: list[str]
    """What is wrong with speaker or plate now; empty: nothing."""


class View(Wire, frozen=True, tag="view", tag_field="type"):
    """What an observer asked to watch; nobody else gets it.

    A waveform comes in pieces that follow each other: `start` is the number of its first sample,
    counted at `rate_hz` since the audio engine began.
    """

    id: int
    """0: an event."""
    kind: Watch
    """Which of the fields below are there."""
    object_id: str | None = None
    """frames: what it shows."""
    region: Region | None = None
    """frames: where in it."""
    format: str | None = None
    """frames: jpeg or png."""
    image: bytes | None = None
    """frames: the picture; base64 in JSON."""
    mask: bytes | None = None
    """frames: which pixels are the object."""
    origin: FrameOrigin | None = None
    """frames: which row comes first."""
    rate_hz: float | None = None
    """waveform: samples in a second."""
    start: int | None = None
    """waveform: number of the first sample."""
    samples: list[float] | None = None
    """waveform: of the speaker's full scale, -1 to 1."""
    text: str | None = None
    """log: one line."""


class Transient(Wire, frozen=True):
    """A short pulse within a plan, `at_ms` after the plan begins."""

    at_ms: float
    """After the plan begins."""
    amplitude: Share
    """On the scale of the plan."""
    frequency_hz: float
    """Of the pulse."""


class Vibration(Wire, frozen=True, tag="vibration", tag_field="type"):
    """What one hand feels from now on: a short plan that replaces the one before. An event.

    `amplitude` holds one value for each `period_ms`, 1 for the strongest that a controller can: it
    is on the scale of controllers, so play it as it is. After the last value there is silence, so a
    lost link ends within 100 ms. `frequency_hz` is as long or, in the form `amplitude`, empty; a
    transient is part of the amplitude too. An empty plan means silence now; `stopped` says that a
    `stop`, perhaps of another connection, holds the vibration.
    """

    id: int
    """0: an event."""
    hand: HandName
    """Which hand it is for."""
    period_ms: float
    """So long each value holds."""
    amplitude: list[Share] = []
    """0 to 1, at most 100 ms of it. Absent: silence now."""
    frequency_hz: list[float] = []
    """Of each period, in the form parametric; absent in the other."""
    transients: list[Transient] = []
    """Pulses for actuators that can click, in the form parametric; absent: none."""
    stopped: bool = False
    """Whether a `stop` holds the vibration."""


class Ownership(Wire, frozen=True, tag="ownership", tag_field="type"):
    """Sent to each scene when the outputs become free or change hands. An event.

    `owner`: whether this scene owns them now. `free`: whether nobody does; a scene that wants them
    answers `set` with `ownership` take, and the first that asks gets them.
    """

    id: int
    """0: an event."""
    owner: bool
    """Whether this scene owns the outputs now."""
    free: bool
    """Whether nobody does."""


class Skipped(Wire, frozen=True, tag="skipped", tag_field="type"):
    """A frame that was not looked at, and why."""

    id: int
    """Of the frame."""
    reason: SkipReason
    """Why."""


class Ok(Wire, frozen=True, tag="ok", tag_field="type"):
    """Done as asked."""

    id: int
    """Of the request."""


class Error(Wire, frozen=True, tag="error", tag_field="type"):
    """Refused, and why; id 0 when the request had none or it is an event."""

    id: int
    """Of the request, or 0."""
    code: ErrorCode
    """For programs."""
    text: str
    """For people: what is wrong and what to do."""
    path: str | None = None
    """The field it is about, such as $.objects[3].material."""


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
