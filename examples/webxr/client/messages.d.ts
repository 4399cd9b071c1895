// Made from schemas/asyncapi.yaml by tests/contract/types.mjs; not edited by hand.

export type Socket = Welcome | Decision | Telemetry | View | Vibration | Ownership | Skipped | Ok | Error;

/**
 * First message of every connection.
 */
export interface Hello {
  'type': 'hello';
  /**
   * Echoed in the reply.
   */
  'id': number;
  /**
   * Who speaks: a client or the service.
   */
  'client': Party;
  /**
   * Same major needed; a newer minor is answered with the service's own.
   */
  'protocol': ProtocolVersion;
  /**
   * A scene has objects and touches; an observer only watches. Anybody may stop.
   */
  'role': HelloRole;
  /**
   * Needed where the service was started with one, as it is for other machines.
   */
  'token'?: string | null;
}

/**
 * Who speaks: a client or the service.
 */
export interface Party {
  /**
   * A name to show to people.
   */
  'name': string;
  /**
   * Its version, in any form.
   */
  'version': string;
}

/**
 * Same major needed; a newer minor is answered with the service's own.
 */
export interface ProtocolVersion {
  /**
   * Must be the service's.
   */
  'major': number;
  /**
   * A newer one only adds: fields, words and messages.
   */
  'minor': number;
}

/**
 * A scene has objects and touches; an observer only watches. Anybody may stop.
 */
export type HelloRole = "observer" | "scene";

/**
 * Objects of the scene; `replace` forgets those not listed.
 *
 * `forget` names objects that are no more: what breaks or is shot costs a scene one id then, and
 * not all its objects anew. An id that is not known is no error.
 * `materials` are all that the scene's objects can be made of: recognition considers no other.
 * An observer on the service's own machine may state materials of the owner's objects: `object_id`
 * and `material` only, with `replace` false.
 */
export interface Scene {
  'type': 'scene';
  /**
   * Echoed in the reply.
   */
  'id': number;
  /**
   * New objects, and known ones with all that is said of them.
   */
  'objects': SceneObject[];
  /**
   * True: these are all objects; false: those not listed stay as they are.
   */
  'replace': boolean;
  /**
   * Ids of objects that are no more.
   */
  'forget'?: string[] | null;
  /**
   * Air temperature of the scene.
   */
  'ambient_c'?: number | null;
  /**
   * All that objects can be made of; absent: every material of `welcome`.
   */
  'materials'?: string[] | null;
}

/**
 * What the scene says of one object; everything but the id is optional.
 *
 * `sunlit` says whether the sun shines on it now: an object in the sun is warmer than the air.
 * What `vibrates` is felt through whatever touches it: `stands_on` names what carries an object.
 * Without `vibrates` its name may say so; `on` false says that it does not.
 */
export interface SceneObject {
  /**
   * The client's own name for it, the same in touches and frames.
   */
  'object_id': string;
  /**
   * As the scene calls it, in any language: Oak_Table_02.
   */
  'name'?: string | null;
  /**
   * What it is made of, one of the materials in `welcome`; then nothing is to be recognised.
   */
  'material'?: string | null;
  /**
   * Of its surface, when the scene knows it.
   */
  'temperature_c'?: number | null;
  /**
   * How it is drawn, which tells metal and glass.
   */
  'shader'?: Shader | null;
  /**
   * Thin things take on the temperature of the hand; absent is thick.
   */
  'thickness_m'?: number | null;
  /**
   * Whether the sun shines on it now.
   */
  'sunlit'?: boolean | null;
  /**
   * How it hums by itself.
   */
  'vibrates'?: Vibrates | null;
  /**
   * Ids of what carries it.
   */
  'stands_on'?: string[] | null;
}

/**
 * Physically based shader parameters; base_color is linear or sRGB red, green, blue.
 */
export interface Shader {
  /**
   * 1 is metal.
   */
  'metallic'?: number | null;
  /**
   * 0 is a mirror.
   */
  'roughness'?: number | null;
  /**
   * 1 is clear as glass.
   */
  'transmission'?: number | null;
  /**
   * Red, green and blue.
   */
  'base_color'?: [number, number, number] | null;
}

/**
 * How an object vibrates by itself; `level` is how strongly it is felt in the hand.
 */
export interface Vibrates {
  /**
   * Its fundamental.
   */
  'frequency_hz': number;
  /**
   * As felt by a hand on it.
   */
  'level': number;
  /**
   * False: it is switched off, also where its name says that it hums.
   */
  'on'?: boolean;
}

/**
 * One rendered frame; `mask` is an 8-bit PNG of the frame's size, nonzero = object.
 */
export interface Frame {
  'type': 'frame';
  /**
   * Echoed in the reply.
   */
  'id': number;
  /**
   * When it was rendered, on the client's clock.
   */
  'captured_at': number;
  /**
   * rgb8 and rgba8 are raw: width x height x 3 or 4 bytes, row by row.
   */
  'format': FrameFormat;
  /**
   * In px; must be that of the picture.
   */
  'width': number;
  /**
   * In px; must be that of the picture.
   */
  'height': number;
  /**
   * The picture. 448 x 448 px as JPEG, about 20 KB, is enough.
   */
  'image': Uint8Array;
  /**
   * Whether the first row of the picture is its top or, as OpenGL reads it, its bottom.
   */
  'origin': FrameOrigin;
  /**
   * live: what a hand is at, where the newest frame wins; enrol: to be learned, each one is kept.
   */
  'purpose'?: FramePurpose;
  /**
   * The object it shows; absent: a view in which touches may name regions.
   */
  'object_id'?: string | null;
  /**
   * Where in the upright picture the object is.
   */
  'region'?: Region | null;
  /**
   * Which pixels are the object, which says more than a region.
   */
  'mask'?: Uint8Array | null;
  /**
   * Older than this it is skipped; absent: it never is.
   */
  'max_age_ms'?: number | null;
}

/**
 * rgb8 and rgba8 are raw: width x height x 3 or 4 bytes, row by row.
 */
export type FrameFormat = "jpeg" | "png" | "rgb8" | "rgba8";

/**
 * Whether the first row of the picture is its top or, as OpenGL reads it, its bottom.
 */
export type FrameOrigin = "bottom" | "top";

/**
 * live: what a hand is at, where the newest frame wins; enrol: to be learned, each one is kept.
 */
export type FramePurpose = "enrol" | "live";

/**
 * A rectangle of the upright frame, as fractions counted from the top left.
 */
export interface Region {
  /**
   * Left edge, as a share of the width.
   */
  'x': number;
  /**
   * Upper edge, as a share of the height.
   */
  'y': number;
  /**
   * Width, as a share of the frame's.
   */
  'w': number;
  /**
   * Height, as a share of the frame's.
   */
  'h': number;
}

/**
 * What a hand does now; renews that hand's lease unless it is a release.
 *
 * `distance_m` to the object and `closing_mps`, the speed at which it shrinks (negative: it
 * grows), say when an approach will become a contact; the plate leads by that time.
 */
export interface Touch {
  'type': 'touch';
  /**
   * Echoed in the reply.
   */
  'id': number;
  /**
   * approach: near and not touching yet; contact: touches, without rubbing; slide: rubs along; release: touches nothing any more.
   */
  'phase': Phase;
  /**
   * When it did, on the client's clock.
   */
  'captured_at': number;
  /**
   * Each hand is rendered by itself.
   */
  'hand': HandName;
  /**
   * Of the hand relative to the surface; at contact how fast it hits.
   */
  'speed_mps': number;
  /**
   * How hard it presses; 1.5 where an engine knows no force.
   */
  'force_n': number;
  /**
   * What it touches. This or a region is needed, but for release and swing.
   */
  'object_id'?: string | null;
  /**
   * What it touches, as a part of the newest frame.
   */
  'region'?: Region | null;
  /**
   * The kind of touch; absent: strike at contact, slide while sliding.
   */
  'interaction'?: Interaction | null;
  /**
   * To the object, of an approach.
   */
  'distance_m'?: number | null;
  /**
   * How fast the distance shrinks, of an approach.
   */
  'closing_mps'?: number | null;
}

/**
 * approach: near and not touching yet; contact: touches, without rubbing; slide: rubs along; release: touches nothing any more.
 */
export type Phase = "approach" | "contact" | "release" | "slide";

/**
 * Each hand is rendered by itself.
 */
export type HandName = "left" | "right";

/**
 * The kind of touch. A swing moves through air and needs no contact.
 */
export type Interaction = "carve" | "press" | "slide" | "strike" | "swing" | "tap";

/**
 * Settings of this connection's session; `feel` and gains are the owner's alone.
 *
 * `ownership`: a scene may take the outputs when nobody owns them or their owner has touched
 * nothing for 30 s. Their owner may give them up, as a tool that only shows pictures does.
 * Anybody may end the owner's connection. The event `ownership` says when the outputs are free.
 * Gains, `feel` and the touch are sent again after they were taken.
 */
export interface Set {
  'type': 'set';
  /**
   * Echoed in the reply.
   */
  'id': number;
  /**
   * Air temperature of the scene.
   */
  'ambient_c'?: number | null;
  /**
   * Half the gain is half the vibration. The owner's alone.
   */
  'vibration_gain'?: number | null;
  /**
   * 0 keeps the plate neutral. The owner's alone.
   */
  'thermal_gain'?: number | null;
  /**
   * What `view` events show. Observers' alone.
   */
  'watch'?: Watch[] | null;
  /**
   * Which hands get `vibration` events. The owner's alone.
   */
  'feel'?: Feel | null;
  /**
   * Who drives the outputs.
   */
  'ownership'?: SetOwnership | null;
}

/**
 * Pictures as they are recognised, what the speaker plays, or lines of the service's log.
 */
export type Watch = "frames" | "log" | "waveform";

/**
 * Which hands get `vibration` events, and in which form; a hand that is absent gets none.
 *
 * `amplitude` is one value a display frame, for actuators of one frequency; `parametric` is finer
 * and brings frequencies and transients too.
 */
export interface Feel {
  /**
   * For the left hand.
   */
  'left'?: FeelForm | null;
  /**
   * For the right hand.
   */
  'right'?: FeelForm | null;
}

/**
 * amplitude: one value each 12.5 ms, for actuators of one frequency; parametric: amplitude and frequency each 5 ms, and transients.
 */
export type FeelForm = "amplitude" | "parametric";

/**
 * take: drive the outputs from now on; give: free them; end: close their owner's connection.
 */
export type SetOwnership = "end" | "give" | "take";

/**
 * Rest the outputs at once; always honoured, never queued.
 *
 * The scope is held at rest for each hand until the owner sends `release` of that hand and then a
 * new `approach` or `contact`. A new session does not undo it: a scene that begins sends
 * `release` of each hand that touches nothing, so that its first touch is felt.
 */
export interface Stop {
  'type': 'stop';
  /**
   * Echoed in the reply.
   */
  'id': number;
  /**
   * Which outputs a stop rests. The scope speaker includes controllers.
   */
  'scope': Scope;
}

/**
 * Which outputs a stop rests. The scope speaker includes controllers.
 */
export type Scope = "all" | "peltier" | "speaker";

/**
 * The answer to hello.
 */
export interface Welcome {
  'type': 'welcome';
  /**
   * Of the hello.
   */
  'id': number;
  /**
   * Who speaks: a client or the service.
   */
  'service': Party;
  /**
   * Same major needed; a newer minor is answered with the service's own.
   */
  'protocol': ProtocolVersion;
  /**
   * A new one for each connection: what was known of objects before is forgotten.
   */
  'session': string;
  /**
   * Whether this scene drives the outputs.
   */
  'owner': boolean;
  /**
   * What the service enforces.
   */
  'limits': Limits;
  /**
   * The outputs of this service.
   */
  'devices': Devices;
  /**
   * What decides; absent = not loaded.
   */
  'models': Models;
  /**
   * All that an object can be stated to be of.
   */
  'materials': string[];
  /**
   * What happens to pictures; a crop shows one object, cut out of its frame.
   */
  'privacy': Privacy;
}

/**
 * What the service enforces.
 */
export interface Limits {
  /**
   * A larger message closes the connection with 1009.
   */
  'message_bytes': number;
  /**
   * Longest side of a frame.
   */
  'pixels': number;
  /**
   * More frames are skipped.
   */
  'frames_per_s': number;
  /**
   * So long an output goes on without a touch that renews it.
   */
  'lease_ms': number;
  /**
   * The band the plate's setpoint is kept in, degC.
   */
  'setpoint_c': SetpointRange;
}

/**
 * The band the plate's setpoint is kept in, degC.
 */
export interface SetpointRange {
  /**
   * Coldest, degC.
   */
  'low': number;
  /**
   * Warmest, degC.
   */
  'high': number;
}

/**
 * The outputs of this service.
 */
export interface Devices {
  /**
   * One output and whether it is simulated.
   */
  'speaker': Device;
  /**
   * One output and whether it is simulated.
   */
  'peltier': Device;
}

/**
 * One output and whether it is simulated.
 */
export interface Device {
  /**
   * As a person knows it.
   */
  'name': string;
  /**
   * Whether nothing real is driven.
   */
  'simulated': boolean;
}

/**
 * What decides; absent = not loaded.
 */
export interface Models {
  /**
   * The network that sees materials.
   */
  'encoder'?: string | null;
  /**
   * The reference pictures it compares with.
   */
  'gallery'?: string | null;
  /**
   * The vision-language model.
   */
  'vlm'?: string | null;
}

/**
 * What happens to pictures; a crop shows one object, cut out of its frame.
 */
export interface Privacy {
  /**
   * Whether frames are kept on the service's disk.
   */
  'frames_stored': boolean;
  /**
   * Whether frames come from or go to another machine.
   */
  'frames_leave_machine': boolean;
  /**
   * Whether cut-out objects go to another machine's recogniser.
   */
  'crops_leave_machine'?: boolean;
}

/**
 * What an object is and how it will feel; id 0 when it is an event.
 *
 * `sub_material` is what its name says it is made of more exactly, with bulk values of its own;
 * `thickness_m` is the thickness that its temperature is computed with, absent when it is thick.
 * `basis` says what the feel is made from: the material, the expectation over all materials
 * believed in while none is sure enough to be named, or neither (neutral).
 * Observers also get its `name`, as the scene gave it.
 */
export interface Decision {
  'type': 'decision';
  /**
   * Of the frame it answers, or 0.
   */
  'id': number;
  /**
   * One of the materials in `welcome`, or unknown.
   */
  'material': string;
  /**
   * Calibrated: of all that are said with .8, four in five are right.
   */
  'confidence': number;
  /**
   * What a material is decided from: the scene states it, the object's name or shader implies it, the network or the vision-language model saw it, or nothing is sure enough.
   */
  'source': Rung;
  /**
   * Whether it was decided before.
   */
  'cached': boolean;
  /**
   * All that was considered.
   */
  'evidence': EvidenceItem[];
  /**
   * Air temperature.
   */
  'ambient_c': number;
  /**
   * Lower end of its interval.
   */
  'ambient_low_c': number;
  /**
   * Upper end of its interval.
   */
  'ambient_high_c': number;
  /**
   * Stated by the scene, read from a picture by the vision-language model, or 22 degC.
   */
  'ambient_source': AmbientSource;
  /**
   * The object's surface before it is touched.
   */
  'surface_c': number;
  /**
   * Lower end of its interval.
   */
  'surface_low_c': number;
  /**
   * Upper end of its interval.
   */
  'surface_high_c': number;
  /**
   * What the surface's temperature is taken from; ambient where nothing else says anything.
   */
  'surface_source': SurfaceSource;
  /**
   * The same in words for people.
   */
  'surface_why': string;
  /**
   * Where skin and object meet; null: nothing is known to be felt.
   */
  'contact_c': number | null;
  /**
   * Where the plate goes.
   */
  'setpoint_c': number;
  /**
   * Where physics alone would put it.
   */
  'unlimited_c': number;
  /**
   * Whether the difference to the skin is large enough to be noticed.
   */
  'thermal_cue': boolean;
  /**
   * What was decided; absent: a region of a frame.
   */
  'object_id'?: string | null;
  /**
   * As the scene gave it; to observers only.
   */
  'name'?: string | null;
  /**
   * The second likeliest material.
   */
  'runner_up'?: string | null;
  /**
   * Why setpoint_c is not unlimited_c.
   */
  'limited_by'?: Limit | null;
  /**
   * What vibrates, such as wood strike; absent: not touched, or nothing is played.
   */
  'pattern'?: string | null;
  /**
   * What the feel is made from.
   */
  'basis'?: Basis | null;
  /**
   * How long each stage of a recognition took; empty where there was none.
   */
  'stages_ms'?: Record<string, number>;
  /**
   * How old the frame was that it answers.
   */
  'frame_age_ms'?: number | null;
  /**
   * What its name says it is made of more exactly, such as cork.
   */
  'sub_material'?: string | null;
  /**
   * What its temperature is computed with; absent: thick.
   */
  'thickness_m'?: number | null;
}

/**
 * What a material is decided from: the scene states it, the object's name or shader implies it, the network or the vision-language model saw it, or nothing is sure enough.
 */
export type Rung = "encoder" | "name" | "scene" | "shader" | "unknown" | "vlm";

/**
 * What one rung of the ladder says.
 */
export interface EvidenceItem {
  /**
   * What a material is decided from: the scene states it, the object's name or shader implies it, the network or the vision-language model saw it, or nothing is sure enough.
   */
  'rung': Rung;
  /**
   * What it says.
   */
  'material': string;
  /**
   * How sure it is.
   */
  'confidence': number;
}

/**
 * Stated by the scene, read from a picture by the vision-language model, or 22 degC.
 */
export type AmbientSource = "default" | "scene" | "vlm";

/**
 * What the surface's temperature is taken from; ambient where nothing else says anything.
 */
export type SurfaceSource = "ambient" | "name" | "scene" | "sun";

/**
 * What kept the plate from the physical value: its band of temperatures, its speed, its current, a hot sink, or the dose of heat that skin may take.
 */
export type Limit = "current" | "dose" | "setpoint" | "sink" | "slew";

/**
 * What the feel is made from: the decided material, the expectation over all materials believed in while none is sure enough to be named, or neither.
 */
export type Basis = "expectation" | "material" | "neutral";

/**
 * State of the outputs, ten times a second, to every connection.
 *
 * `speaker_level` is the rms of the loudest few milliseconds since the telemetry before.
 */
export interface Telemetry {
  'type': 'telemetry';
  /**
   * 0: an event.
   */
  'id': number;
  /**
   * The plate's surface; null: no reading.
   */
  'plate_c': number | null;
  /**
   * Where it goes.
   */
  'setpoint_c': number;
  /**
   * Its heat sink; null: no reading.
   */
  'sink_c': number | null;
  /**
   * Its power, -1 (cools) to 1 (heats).
   */
  'duty': number;
  /**
   * Of full scale, 0 to 1.
   */
  'speaker_level': number;
  /**
   * Blocks that the speaker missed since the start.
   */
  'underruns': number;
  /**
   * Frames of all connections that were not looked at since the start.
   */
  'dropped_frames': number;
  /**
   * Hands that touch or approach something now.
   */
  'leases': number;
  /**
   * What is wrong with speaker or plate now; empty: nothing.
   */
  'faults': string[];
}

/**
 * What an observer asked to watch; nobody else gets it.
 *
 * A waveform comes in pieces that follow each other: `start` is the number of its first sample,
 * counted at `rate_hz` since the audio engine began.
 */
export interface View {
  'type': 'view';
  /**
   * 0: an event.
   */
  'id': number;
  /**
   * Pictures as they are recognised, what the speaker plays, or lines of the service's log.
   */
  'kind': Watch;
  /**
   * frames: what it shows.
   */
  'object_id'?: string | null;
  /**
   * frames: where in it.
   */
  'region'?: Region | null;
  /**
   * frames: jpeg or png.
   */
  'format'?: string | null;
  /**
   * frames: the picture; base64 in JSON.
   */
  'image'?: Uint8Array | null;
  /**
   * frames: which pixels are the object.
   */
  'mask'?: Uint8Array | null;
  /**
   * frames: which row comes first.
   */
  'origin'?: FrameOrigin | null;
  /**
   * waveform: samples in a second.
   */
  'rate_hz'?: number | null;
  /**
   * waveform: number of the first sample.
   */
  'start'?: number | null;
  /**
   * waveform: of the speaker's full scale, -1 to 1.
   */
  'samples'?: number[] | null;
  /**
   * log: one line.
   */
  'text'?: string | null;
}

/**
 * What one hand feels from now on: a short plan that replaces the one before. An event.
 *
 * `amplitude` holds one value for each `period_ms`, 1 for the strongest that a controller can: it
 * is on the scale of controllers, so play it as it is. After the last value there is silence, so a
 * lost link ends within 100 ms. `frequency_hz` is as long or, in the form `amplitude`, empty; a
 * transient is part of the amplitude too. An empty plan means silence now; `stopped` says that a
 * `stop`, perhaps of another connection, holds the vibration.
 */
export interface Vibration {
  'type': 'vibration';
  /**
   * 0: an event.
   */
  'id': number;
  /**
   * Each hand is rendered by itself.
   */
  'hand': HandName;
  /**
   * So long each value holds.
   */
  'period_ms': number;
  /**
   * 0 to 1, at most 100 ms of it. Absent: silence now.
   */
  'amplitude'?: number[];
  /**
   * Of each period, in the form parametric; absent in the other.
   */
  'frequency_hz'?: number[];
  /**
   * Pulses for actuators that can click, in the form parametric; absent: none.
   */
  'transients'?: Transient[];
  /**
   * Whether a `stop` holds the vibration.
   */
  'stopped'?: boolean;
}

/**
 * A short pulse within a plan, `at_ms` after the plan begins.
 */
export interface Transient {
  /**
   * After the plan begins.
   */
  'at_ms': number;
  /**
   * On the scale of the plan.
   */
  'amplitude': number;
  /**
   * Of the pulse.
   */
  'frequency_hz': number;
}

/**
 * Sent to each scene when the outputs become free or change hands. An event.
 *
 * `owner`: whether this scene owns them now. `free`: whether nobody does; a scene that wants them
 * answers `set` with `ownership` take, and the first that asks gets them.
 */
export interface Ownership {
  'type': 'ownership';
  /**
   * 0: an event.
   */
  'id': number;
  /**
   * Whether this scene owns the outputs now.
   */
  'owner': boolean;
  /**
   * Whether nobody does.
   */
  'free': boolean;
}

/**
 * A frame that was not looked at, and why.
 */
export interface Skipped {
  'type': 'skipped';
  /**
   * Of the frame.
   */
  'id': number;
  /**
   * superseded: a newer frame took its place; stale: older than its max_age_ms; unchanged: shows the object as before; rate: more than frames_per_s.
   */
  'reason': SkipReason;
}

/**
 * superseded: a newer frame took its place; stale: older than its max_age_ms; unchanged: shows the object as before; rate: more than frames_per_s.
 */
export type SkipReason = "rate" | "stale" | "superseded" | "unchanged";

/**
 * Done as asked.
 */
export interface Ok {
  'type': 'ok';
  /**
   * Of the request.
   */
  'id': number;
}

/**
 * Refused, and why; id 0 when the request had none or it is an event.
 */
export interface Error {
  'type': 'error';
  /**
   * Of the request, or 0.
   */
  'id': number;
  /**
   * Not allowed in this state or role (protocol), malformed (message), out of range (limit). Too much waits (overload), or a stop holds the outputs (unsafe). An output (device) or a network (model) fails. Another scene owns the outputs (not_owner).
   */
  'code': ErrorCode;
  /**
   * For people: what is wrong and what to do.
   */
  'text': string;
  /**
   * The field it is about, such as $.objects[3].material.
   */
  'path'?: string | null;
}

/**
 * Not allowed in this state or role (protocol), malformed (message), out of range (limit). Too much waits (overload), or a stop holds the outputs (unsafe). An output (device) or a network (model) fails. Another scene owns the outputs (not_owner).
 */
export type ErrorCode = "device" | "limit" | "message" | "model" | "not_owner" | "overload" | "protocol" | "unsafe";
