"""Declares every wire message of protocol v1 once, with `decode`, `encode` and `MessageError`.

`decode` checks type, range, size and finiteness, so code behind it need not check again. Field
names carry their units (`_c` degC, `_s` s, `_ms` ms, `_mps` m/s, `_n` N). This module does not
know sockets, sessions or devices.

The text below a field or a choice documents it. `make schemas` copies that text into the JSON
Schema, AsyncAPI, the C# types and docs/protocol.md.
"""

from __future__ import annotations

import re
from typing import Annotated, Literal, get_args, get_origin

import msgspec
from msgspec import Meta, Struct

from hapticvlm import documents
from hapticvlm.errors import HapticVLMError

PROTOCOL_MAJOR = 1
PROTOCOL_MINOR = 2
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
MAX_SURFACES = 64
SurfaceIndex = Annotated[int, Meta(ge=0, le=MAX_SURFACES - 1)]
ContentHash = Annotated[str, Meta(pattern="^[0-9a-f]{32}$")]
Picture = Annotated[bytes, Meta(min_length=1, max_length=MAX_MESSAGE_BYTES)]

ErrorCode = Literal[
    "protocol", "message", "limit", "overload", "unsafe", "device", "model", "not_owner"
]
"""`protocol`: not allowed in this state or role; `message`: malformed; `limit`: out of range;
`overload`: a queue is full; `unsafe`: a stop holds the outputs; `device`: an output failed;
`model`: a network failed; `not_owner`: another scene owns the outputs."""
Scope = Literal["all", "speaker", "peltier"]
"""The outputs that a stop turns off. `speaker` includes controllers."""
MOST_SPEED_MPS, MOST_FORCE_N = 20.0, 200.0  # of a touch
Phase = Literal["approach", "contact", "slide", "release"]
"""`approach`: near, not touching yet; `contact`: touching without sliding; `slide`: sliding along
the surface; `release`: no longer touching."""
Interaction = Literal["tap", "strike", "press", "slide", "carve", "swing"]
"""The kind of touch. A swing moves through the air and needs no contact."""
HandName = Literal["left", "right"]
"""Each hand is rendered separately."""
Rung = Literal["scene", "name", "shader", "texture", "encoder", "vlm", "unknown"]
"""`scene`: stated by the scene; `name`, `shader`: implied by the object's name or shader;
`texture`: read off its texture map (since 1.2); `encoder`: recognised by the image network;
`vlm`: recognised by the vision-language model; `unknown`: no source is sure enough."""
AmbientSource = Literal["scene", "vlm", "default"]
"""`scene`: stated by the scene; `vlm`: estimated from a picture by the vision-language model;
`default`: 22 degC."""
Limit = Literal["setpoint", "slew", "current", "sink", "dose"]
"""The limit that keeps the plate from the physical value. `setpoint`: its temperature range;
`slew`: its rate of change; `current`: its current; `sink`: a hot heat sink; `dose`: the thermal
dose allowed for skin."""
SurfaceSource = Literal["scene", "name", "sun", "ambient"]
"""The source of the surface temperature. `ambient` applies without any other."""
SkipReason = Literal["superseded", "stale", "unchanged", "rate"]
"""`superseded`: replaced by a newer frame; `stale`: older than its `max_age_ms`; `unchanged`: the
object looks as before; `rate`: over `frames_per_s`."""
FeelForm = Literal["amplitude", "parametric"]
"""`amplitude`: one value every 12.5 ms, for actuators with a single frequency; `parametric`:
amplitude and frequency every 5 ms, and transients."""
Basis = Literal["material", "least_error", "expectation", "neutral"]
"""`material`: the decided material is rendered; `least_error`: none is probable enough,
and the one that errs least on average is rendered (`felt`); `expectation`: the mean over all
probable materials, if the service was started with `--feel graded`; `neutral`: nothing."""
NeutralCause = Literal["living", "guess"]
"""`living`: the picture shows a person or an animal, which has no material; `guess`: no material is
believed enough, so that any would be a guess."""
HelloRole = Literal["scene", "observer"]
"""A scene declares objects and sends touches; an observer only watches. Both may send `stop`."""
FrameFormat = Literal["jpeg", "png", "rgb8", "rgba8", "bgra8"]
"""rgb8, rgba8 and bgra8 are raw pixels: width x height x 3 or 4 bytes, row by row."""
FrameOrigin = Literal["top", "bottom"]
"""`top`: the first row is the top of the picture; `bottom`: it is the bottom, as in OpenGL."""
FramePurpose = Literal["live", "enrol", "texture"]
"""`live`: to be recognised, and a newer frame replaces a waiting one; `enrol`: reference pictures
of an object, each of which is used; `texture`: the base-colour map of a surface (since 1.2)."""
Watch = Literal["frames", "waveform", "log"]
"""`frames`: pictures as they are recognised; `waveform`: the speaker's samples; `log`: lines of
the service's log."""
SetOwnership = Literal["take", "give", "end"]
"""`take`: own the outputs from now on; `give`: free them; `end`: close the owner's connection."""


class MessageError(HapticVLMError):
    """Raised for a peer's mistake; says what is wrong, where, and what to do. No output changes."""

    def __init__(self, code: ErrorCode, text: str, *, path: str | None = None, id: int = 0) -> None:
        super().__init__(text)
        self.code: ErrorCode = code
        self.text = text
        self.path = path
        self.id = id


class Wire(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True, kw_only=True):
    """Base of all messages: immutable, refuses unknown fields, omits unset optional fields."""


class Party(Wire, frozen=True):
    """Name and version of a client or of the service."""

    name: Annotated[str, Meta(min_length=1, max_length=128)]
    """Name to display."""
    version: Annotated[str, Meta(max_length=64)]
    """Version, in any format."""


class ProtocolVersion(Wire, frozen=True):
    """Version of the protocol. Majors must match; a newer minor is answered with the service's."""

    major: Annotated[int, Meta(ge=0, le=1000)]
    """Must equal the service's major number."""
    minor: Annotated[int, Meta(ge=0, le=1000)]
    """A newer minor version only adds fields, values and messages."""


class Region(Wire, frozen=True):
    """A rectangle of the upright frame, in fractions from its top left corner."""

    x: Share
    """Left edge, as a fraction of the width."""
    y: Share
    """Top edge, as a fraction of the height."""
    w: Annotated[float, Meta(gt=0.0, le=1.0)]
    """Width, as a fraction of the frame's width."""
    h: Annotated[float, Meta(gt=0.0, le=1.0)]
    """Height, as a fraction of the frame's height."""


WHOLE = Region(x=0.0, y=0.0, w=1.0, h=1.0)


class Shader(Wire, frozen=True):
    """Physically based shader parameters."""

    metallic: Share | None = None
    """1 is a metal."""
    roughness: Share | None = None
    """0 is a mirror."""
    transmission: Share | None = None
    """1 is as clear as glass."""
    opacity: Share | None = None
    """Share of the colour that blending draws over what lies behind, 1 of all; absent: not blended,
    as with an alpha mask. Since 1.2."""
    base_color: tuple[Share, Share, Share] | None = None
    """Red, green and blue, linear or sRGB."""


class Vibrates(Wire, frozen=True):
    """Vibration of an object that hums by itself."""

    frequency_hz: Annotated[float, Meta(ge=15.0, le=360.0)]
    """Fundamental frequency."""
    level: Share
    """Strength as felt by a hand on the object."""
    on: bool = True
    """False: switched off, even if the object's name implies a hum."""


class ObjectSurface(Wire, frozen=True):
    """A surface of an object: a primitive of glTF, a sub-mesh of Unity, a surface of Godot."""

    name: Label | None = None
    """Name of its material, or file of its texture, such as Oak_Varnished or T_Planks_D.png."""
    material: MaterialName | None = None
    """One of the materials in `welcome`; absent: as the object states, else as recognised."""
    shader: Shader | None = None
    """Shader parameters of its material; absent: those of the object."""
    texture: ContentHash | None = None
    """Content hash of its base-colour map: 32 hex digits, in lower case."""


class SceneObject(Wire, frozen=True):
    """One object of the scene; all fields except the id are optional.

    An object in the sun (`sunlit`) is warmer than the air. An object that `vibrates` is also felt
    through objects in contact with it; `stands_on` declares such contacts. Without `vibrates`, the
    name may imply a hum; `on` false prevents that.
    """

    object_id: ObjectId
    """The client's id of the object; touches and frames use the same."""
    name: Label | None = None
    """Name in the scene, such as Oak_Table_02. Names of parents may precede it, as in
    Rifle/Magazine. English, and common words of German, French, Spanish, Italian, Portuguese,
    Japanese, Chinese and Korean are read."""
    material: MaterialName | None = None
    """One of the materials in `welcome`; the object is then not recognised from pictures."""
    temperature_c: Celsius | None = None
    """Surface temperature, if the scene knows it."""
    shader: Shader | None = None
    """Shader parameters, which reveal metal and glass."""
    thickness_m: Annotated[float, Meta(gt=0.0, le=10.0)] | None = None
    """Thickness. Thin objects take on the temperature of the hand; absent: thick."""
    sunlit: bool | None = None
    """Whether the sun shines on the object now."""
    vibrates: Vibrates | None = None
    """Vibration, if the object hums by itself."""
    stands_on: Annotated[list[ObjectId], Meta(max_length=16)] | None = None
    """Ids of the objects that carry it."""
    surfaces: Annotated[list[ObjectSurface], Meta(max_length=MAX_SURFACES)] | None = None
    """Its surfaces, the largest first; their names say more than its own. A touch feels the one
    that it names by its index in this list. Since 1.2."""


class Hello(Wire, frozen=True, tag="hello", tag_field="type"):
    """The first message of every connection."""

    id: RequestId
    """Id of the request, echoed in the reply."""
    client: Party
    """Client name and version."""
    protocol: ProtocolVersion
    """Protocol version of the client."""
    role: HelloRole
    """Role of this connection."""
    token: Annotated[str, Meta(max_length=256)] | None = None
    """Required if the service was started with a token, as it must be for other machines."""


class Scene(Wire, frozen=True, tag="scene", tag_field="type"):
    """Objects of the scene.

    `forget` removes single objects, so that a scene need not send all others again. Unknown ids in
    it are ignored. If `materials` is given, recognition considers only these.
    An observer on the service's own machine may override materials of the owner's objects: it sends
    `object_id` and `material` only, of objects or of their surfaces, with `replace` false.
    """

    id: RequestId
    """Id of the request, echoed in the reply."""
    objects: Annotated[list[SceneObject], Meta(max_length=4096)]
    """New or changed objects, each with all of its fields."""
    replace: bool
    """True: objects that are not listed are removed; false: they stay as they are."""
    forget: Annotated[list[ObjectId], Meta(max_length=4096)] | None = None
    """Ids of removed objects."""
    ambient_c: AmbientCelsius | None = None
    """Air temperature of the scene."""
    materials: Annotated[list[MaterialName], Meta(min_length=1, max_length=64)] | None = None
    """Materials that occur in the scene; absent: all materials in `welcome`."""


class Frame(Wire, frozen=True, tag="frame", tag_field="type"):
    """One rendered frame."""

    id: RequestId
    """Id of the request, echoed in the reply."""
    captured_at: Clock
    """Time of rendering, on the client's clock."""
    format: FrameFormat
    """Encoding of `image`."""
    width: Side
    """Width in pixels; must equal the picture's."""
    height: Side
    """Height in pixels; must equal the picture's."""
    image: Picture
    """The picture. A JPEG of 448 x 448 px, about 20 KB, is sufficient."""
    origin: FrameOrigin
    """Order of the rows."""
    purpose: FramePurpose = "live"
    """Purpose of the frame."""
    object_id: ObjectId | None = None
    """Object shown; absent: a view in which touches may name a region."""
    region: Region | None = None
    """Position of the object in the upright picture."""
    surface: SurfaceIndex = 0
    """Surface shown, as an index into the object's `surfaces`; absent: the largest. Since 1.2."""
    mask: Picture | None = None
    """Pixels of the object, more precise than a region: a PNG of the frame's size with 1 to 8 bits
    a channel, nonzero = object."""
    max_age_ms: Annotated[float, Meta(ge=0.0, le=60_000.0)] | None = None
    """An older frame is skipped; absent: no age limit."""


class Touch(Wire, frozen=True, tag="touch", tag_field="type"):
    """Current state of one hand; every phase except `release` renews the hand's lease.

    From `distance_m` and `closing_mps` the service predicts when an approach becomes a contact, so
    that the plate can start in time.
    """

    id: RequestId
    """Id of the request, echoed in the reply."""
    phase: Phase
    """Phase of the touch."""
    captured_at: Clock
    """Time of the touch, on the client's clock."""
    hand: HandName
    """Hand that touches."""
    speed_mps: Annotated[float, Meta(ge=0.0, le=MOST_SPEED_MPS)]
    """Speed of the hand relative to the surface; at contact, the impact speed."""
    force_n: Annotated[float, Meta(ge=0.0, le=MOST_FORCE_N)]
    """Contact force; send 1.5 if the engine does not compute forces."""
    object_id: ObjectId | None = None
    """Object touched. Either this or `region` is required, except for release and swing."""
    surface: SurfaceIndex = 0
    """Surface touched, as an index into the object's `surfaces`; absent: the largest. Since 1.2."""
    region: Region | None = None
    """Region of the newest frame that is touched."""
    interaction: Interaction | None = None
    """Kind of touch; absent: strike at contact, slide while sliding."""
    distance_m: Annotated[float, Meta(ge=0.0, le=100.0)] | None = None
    """Distance to the object, during an approach."""
    closing_mps: Annotated[float, Meta(ge=-20.0, le=20.0)] | None = None
    """Rate at which the distance shrinks (negative: grows), during an approach."""


class Feel(Wire, frozen=True):
    """Subscription to `vibration` events per hand; a hand that is absent gets none."""

    left: FeelForm | None = None
    """Form for the left hand."""
    right: FeelForm | None = None
    """Form for the right hand."""


class Set(Wire, frozen=True, tag="set", tag_field="type"):
    """Settings of this connection's session.

    A scene may take the outputs if nobody owns them or if their owner has touched nothing for 30 s.
    The owner may give them up, as a tool that only sends pictures does. Any connection may end the
    owner's connection. The event `ownership` reports free outputs. After taking them, a scene sends
    its gains, `feel` and current touch again.
    """

    id: RequestId
    """Id of the request, echoed in the reply."""
    ambient_c: AmbientCelsius | None = None
    """Air temperature of the scene."""
    vibration_gain: Share | None = None
    """Factor on the vibration. Only for the owner."""
    thermal_gain: Share | None = None
    """Factor on the thermal effect; 0 keeps the plate neutral. Only for the owner."""
    watch: Annotated[list[Watch], Meta(max_length=3)] | None = None
    """Kinds of `view` events to receive. Only for observers."""
    feel: Feel | None = None
    """Subscription to `vibration` events. Only for the owner."""
    ownership: SetOwnership | None = None
    """Change of the outputs' owner."""


class Stop(Wire, frozen=True, tag="stop", tag_field="type"):
    """Turn outputs off at once; always obeyed, never queued.

    The outputs stay off for each hand until the owner sends `release` of that hand and then a new
    `approach` or `contact`. A new session does not end a stop. A new scene therefore sends
    `release` for each hand that touches nothing, so that its first touch is felt.
    """

    id: RequestId
    """Id of the request, echoed in the reply."""
    scope: Scope
    """Outputs to turn off."""


ClientMessage = Hello | Scene | Frame | Touch | Set | Stop


class SetpointRange(Wire, frozen=True):
    """Range of the plate's setpoint."""

    low: float
    """Lowest setpoint, degC."""
    high: float
    """Highest setpoint, degC."""


class Limits(Wire, frozen=True):
    """Limits that the service enforces."""

    message_bytes: int
    """Maximum size of a message; a larger one closes the connection with 1009."""
    pixels: int
    """Maximum side length of a frame."""
    frames_per_s: float
    """Maximum frame rate; frames beyond it are skipped."""
    lease_ms: int
    """Time that an output stays on after the last touch message."""
    setpoint_c: SetpointRange
    """Range of the plate's setpoint."""


class Device(Wire, frozen=True):
    """One output device."""

    name: str
    """Name to display."""
    simulated: bool
    """Whether the device is simulated."""


class Devices(Wire, frozen=True):
    """Output devices of the service."""

    speaker: Device
    """Device for vibration."""
    peltier: Device
    """Device for heat and cold."""


class Models(Wire, frozen=True):
    """Models in use; absent: not loaded."""

    encoder: str | None = None
    """Image network that recognises materials."""
    gallery: str | None = None
    """Set of reference pictures."""
    vlm: str | None = None
    """Vision-language model."""


class Privacy(Wire, frozen=True):
    """Use of pictures. A crop is the part of a frame that shows one object."""

    frames_stored: bool
    """Whether frames are stored on the service's disk."""
    frames_leave_machine: bool
    """Whether frames are received from or sent to another machine."""
    crops_leave_machine: bool = False
    """Whether crops are sent to a recogniser on another machine."""


class Welcome(Wire, frozen=True, tag="welcome", tag_field="type"):
    """The reply to `hello`."""

    id: RequestId
    """Id of the `hello`."""
    service: Party
    """Service name and version."""
    protocol: ProtocolVersion
    """Protocol version of the service."""
    session: str
    """Session id, new for each connection. A new session knows no objects."""
    owner: bool
    """Whether this scene owns the outputs."""
    limits: Limits
    """Limits that the service enforces."""
    devices: Devices
    """Output devices."""
    models: Models
    """Models in use."""
    materials: list[str]
    """Materials that an object may state."""
    privacy: Privacy
    """Use of pictures."""


class EvidenceItem(Wire, frozen=True):
    """Evidence from one source."""

    rung: Rung
    """Source of the evidence."""
    material: str
    """Most probable material, or living: a person or an animal (since 1.2)."""
    confidence: Share
    """Its probability."""


class Decision(Wire, frozen=True, tag="decision", tag_field="type"):
    """Material, temperatures and vibration pattern decided for one object."""

    id: int
    """Id of the frame that it answers; 0: an event."""
    material: str
    """One of the materials in `welcome`, or unknown."""
    confidence: Share
    """Calibrated probability: of all decisions with 0.8, four in five are right."""
    source: Rung
    """Source with the greatest weight."""
    cached: bool
    """Whether the decision was made before and is unchanged."""
    evidence: list[EvidenceItem]
    """All evidence considered."""
    ambient_c: float
    """Air temperature."""
    ambient_low_c: float
    """Lower end of its interval."""
    ambient_high_c: float
    """Upper end of its interval."""
    ambient_source: AmbientSource
    """Source of the air temperature."""
    surface_c: float
    """Temperature of the object's surface before the touch."""
    surface_low_c: float
    """Lower end of its interval."""
    surface_high_c: float
    """Upper end of its interval."""
    surface_source: SurfaceSource
    """Source of the surface temperature."""
    surface_why: str
    """Reason for the surface temperature, as text to display."""
    contact_c: float | None
    """Temperature at which skin and object meet; null: unknown."""
    setpoint_c: float
    """Setpoint of the plate."""
    unlimited_c: float
    """Setpoint that physics alone would give, without limits."""
    thermal_cue: bool
    """Whether a person can notice the difference from skin temperature."""
    object_id: str | None = None
    """Object decided on; absent: a region of a frame."""
    surface: int | None = None
    """Index of the surface decided on, if the object has more than one. Since 1.2."""
    name: str | None = None
    """Name of the object or its surface in the scene; sent to observers only."""
    runner_up: str | None = None
    """Second most probable material."""
    limited_by: Limit | None = None
    """Limit that makes `setpoint_c` differ from `unlimited_c`."""
    pattern: str | None = None
    """Vibration pattern, such as wood strike; absent: no touch, or no vibration."""
    basis: Basis | None = None
    """Basis of the rendering: the material, a guess, a mean over probable materials, or nothing."""
    neutral_because: NeutralCause | None = None
    """Reason why nothing is rendered, where `basis` is neutral. Since 1.2."""
    felt: str | None = None
    """Material that is rendered, in heat and vibration; absent: a mean, or nothing. Since 1.2."""
    feels: list[str] = []
    """Plain words of `felt`: of its surface and its body, such as smooth and rings. Since 1.2."""
    stages_ms: dict[str, float] = {}
    """Duration of each stage of the recognition; empty if there was none."""
    frame_age_ms: float | None = None
    """Age of the frame that it answers."""
    sub_material: str | None = None
    """More specific material implied by the name, such as cork."""
    thickness_m: float | None = None
    """Thickness used for the contact temperature; absent: thick."""


class Telemetry(Wire, frozen=True, tag="telemetry", tag_field="type"):
    """State of the outputs, sent to every connection ten times a second."""

    id: int
    """Always 0: an event."""
    plate_c: float | None
    """Temperature of the plate's surface; null: no reading."""
    setpoint_c: float
    """Setpoint of the plate."""
    sink_c: float | None
    """Temperature of the plate's heat sink; null: no reading."""
    duty: float
    """Drive of the plate, from -1 (full cooling) to 1 (full heating)."""
    speaker_level: float
    """RMS of the loudest few milliseconds since the last telemetry, 0 to 1 of full scale."""
    underruns: int
    """Audio blocks missed since the start of the service."""
    dropped_frames: int
    """Frames of all connections dropped since the start of the service."""
    leases: int
    """Number of hands with a lease, which touch or approach something now."""
    faults: list[str]
    """Current faults of speaker and plate; empty: none."""


class View(Wire, frozen=True, tag="view", tag_field="type"):
    """Data that an observer subscribed to with `set.watch`; other connections do not get it.

    A waveform comes in consecutive pieces. `start` counts samples at `rate_hz` since the audio
    engine started.
    """

    id: int
    """Always 0: an event."""
    kind: Watch
    """Kind of event, which decides the fields below."""
    object_id: str | None = None
    """frames: object shown. waveform: object touched; null: none, or a region."""
    region: Region | None = None
    """frames: position of the object."""
    format: str | None = None
    """frames: jpeg or png."""
    image: bytes | None = None
    """frames: the picture, as base64 in JSON."""
    mask: bytes | None = None
    """frames: pixels of the object."""
    origin: FrameOrigin | None = None
    """frames: order of the rows."""
    rate_hz: float | None = None
    """waveform: sample rate."""
    start: int | None = None
    """waveform: number of the first sample."""
    samples: list[float] | None = None
    """waveform: samples, -1 to 1 of full scale."""
    speed_mps: float | None = None
    """waveform: speed of the hand that touches; null: no hand touches. Since 1.2."""
    text: str | None = None
    """log: one line."""


class Transient(Wire, frozen=True):
    """A short pulse within a vibration plan."""

    at_ms: float
    """Time after the start of the plan."""
    amplitude: Share
    """Amplitude, on the scale of the plan."""
    frequency_hz: float
    """Frequency of the pulse."""


class Vibration(Wire, frozen=True, tag="vibration", tag_field="type"):
    """Vibration of one hand from now on: a short plan that replaces the previous plan. An event.

    Amplitudes are scaled for controllers (1 is the strongest), so play them unchanged. After the
    last value play nothing: vibration then ends within 100 ms if the link is lost. Transients are
    already contained in the amplitude. An empty plan means silence now.
    """

    id: int
    """Always 0: an event."""
    hand: HandName
    """Hand that the plan is for."""
    period_ms: float
    """Duration of each value."""
    amplitude: list[Share] = []
    """One value per period, 0 to 1, at most 100 ms in total; absent: silence now."""
    frequency_hz: list[float] = []
    """One frequency per period, in the form parametric; absent in the form amplitude."""
    transients: list[Transient] = []
    """Pulses for actuators that can click, in the form parametric; absent: none."""
    stopped: bool = False
    """Whether a `stop`, possibly of another connection, holds the vibration off."""


class Ownership(Wire, frozen=True, tag="ownership", tag_field="type"):
    """Sent to each scene when the outputs become free or change owner. An event.

    A scene that wants free outputs sends `set` with `ownership` take; the first request gets them.
    """

    id: int
    """Always 0: an event."""
    owner: bool
    """Whether this scene owns the outputs now."""
    free: bool
    """Whether nobody owns the outputs."""


class Textures(Wire, frozen=True, tag="textures", tag_field="type"):
    """The texture maps that the service asks for, each once. An event, since 1.2.

    They are those of surfaces that names and shaders leave unsure. A scene answers each, when it
    has time, by one `frame` of purpose `texture` that names an object and a surface with this map.
    """

    id: int
    """Always 0: an event."""
    hashes: list[ContentHash]
    """Hashes as the scene's surfaces state them in `texture`."""


class Skipped(Wire, frozen=True, tag="skipped", tag_field="type"):
    """The reply to a frame that was dropped."""

    id: int
    """Id of the frame."""
    reason: SkipReason
    """Reason for dropping it."""


class LeftOut(Wire, frozen=True):
    """A part of a request that was left out or changed; the rest was accepted."""

    path: str
    """Part concerned, such as objects[3].name."""
    text: str
    """Description of the problem, the limit and its fix, as text to display."""


class Ok(Wire, frozen=True, tag="ok", tag_field="type"):
    """The reply to a request that succeeded."""

    id: int
    """Id of the request."""
    left_out: list[LeftOut] | None = None
    """Parts that were left out or changed; absent: none. At most 33. Since 1.2."""


class Error(Wire, frozen=True, tag="error", tag_field="type"):
    """The reply to a request that was refused, or an event that reports a fault."""

    id: int
    """Id of the request; 0: an event, or a request without a readable id."""
    code: ErrorCode
    """Kind of error, for programs."""
    text: str
    """Description of the problem and its fix, as text to display."""
    path: str | None = None
    """Field concerned, such as $.objects[3].material."""


ServiceMessage = (
    Welcome | Decision | Telemetry | View | Vibration | Ownership | Textures | Skipped | Ok | Error
)

_msgpack_decoder: msgspec.msgpack.Decoder[ClientMessage] = msgspec.msgpack.Decoder(ClientMessage)
_json_decoder: msgspec.json.Decoder[ClientMessage] = msgspec.json.Decoder(ClientMessage)
_msgpack_encoder = msgspec.msgpack.Encoder()
_json_encoder = msgspec.json.Encoder()


def _words(kind: object) -> tuple[str, ...]:
    """List the values of every choice inside a type."""
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
    id: int | float = 0


def decode(data: bytes | str) -> ClientMessage:
    """Parse one WebSocket message: bytes as MessagePack, str as JSON. Raises MessageError."""
    try:
        message = _parse(data)
    except msgspec.ValidationError as error:
        raise explained(str(error), _id_of(data)) from None
    except (msgspec.DecodeError, ValueError, RecursionError) as error:
        kind = "JSON" if isinstance(data, str) else "MessagePack"
        reason = documents.reason(error)
        text = f"not a {kind} map: {reason}; a message is one {kind} map"
        raise MessageError("message", text) from None
    if isinstance(data, str) and isinstance(message, Frame):
        text = "$.image: text messages carry no images; send frames as MessagePack"
        raise MessageError("message", text, path="$.image", id=message.id)
    return message


def encode(message: ServiceMessage | ClientMessage, *, as_text: bool) -> bytes | str:
    """Encode one message as JSON text or MessagePack bytes."""
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
    return int(found) if 1 <= found < 2**53 and found == int(found) else 0


_CURES = (
    ("unknown field", "remove it or correct its spelling"),
    ("missing required field", "add it"),
    ("NaN", "send a number, or leave the field out if it is optional"),
    ("got `array`", 'send a map with named fields (in C#: [Key("id")], not [Key(0)])'),
)


def explained(reason: str, id: int = 0) -> MessageError:
    """Return msgspec's reason of a refusal with its path, its kind and a cure."""
    text, _, where = reason.partition(" - at ")
    if where.startswith("`key`"):
        where, text = "", "a key of a map is not text"
        cure = 'name fields by text (in C#: [Key("id")], not [Key(0)])'
        return MessageError("message", f"$: {text}; {cure}", path="$", id=id)
    path = where.strip("`") or "$"
    if "unknown field" in text:
        path += "." + text[text.index("`") + 1 : text.rindex("`")]
    is_limit = text.startswith("Expected") and bool(re.search(r"<|>|length", text))
    code: ErrorCode = "limit" if is_limit else "message"
    cure = "keep the value within this limit" if is_limit else _cure(text, path)
    return MessageError(code, f"{path}: {text}; {cure}", path=path, id=id)


def _cure(text: str, path: str) -> str:
    """Return what to do about a fault that is not a limit."""
    is_of_type = text.endswith("field `type`")
    if "Invalid" in text or is_of_type:
        field = "type" if is_of_type else re.sub(r"\[.*\]$", "", path).split(".")[-1]
        return f"`{field}` is one of {', '.join(_CHOICES.get(field, ()))}"
    return next((cure for part, cure in _CURES if part in text), "send the expected type")
