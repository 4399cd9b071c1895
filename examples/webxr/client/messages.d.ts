// Made from schemas/asyncapi.yaml by tests/contract/types.mjs; not edited by hand.

export type Socket = Welcome | Decision | Telemetry | View | Vibration | Ownership | Textures | Skipped | Ok | Error;

/**
 * The first message of every connection.
 */
export interface Hello {
  'type': 'hello';
  /**
   * Id of the request, echoed in the reply.
   */
  'id': number;
  /**
   * Name and version of a client or of the service.
   */
  'client': Party;
  /**
   * Version of the protocol. Majors must match; a newer minor is answered with the service's.
   */
  'protocol': ProtocolVersion;
  /**
   * A scene declares objects and sends touches; an observer only watches. Both may send `stop`.
   */
  'role': HelloRole;
  /**
   * Required if the service was started with a token, as it must be for other machines.
   */
  'token'?: string | null;
}

/**
 * Name and version of a client or of the service.
 */
export interface Party {
  /**
   * Name to display.
   */
  'name': string;
  /**
   * Version, in any format.
   */
  'version': string;
}

/**
 * Version of the protocol. Majors must match; a newer minor is answered with the service's.
 */
export interface ProtocolVersion {
  /**
   * Must equal the service's major number.
   */
  'major': number;
  /**
   * A newer minor version only adds fields, values and messages.
   */
  'minor': number;
}

/**
 * A scene declares objects and sends touches; an observer only watches. Both may send `stop`.
 */
export type HelloRole = "observer" | "scene";

/**
 * Objects of the scene.
 *
 * `forget` removes single objects, so that a scene need not send all others again. Unknown ids in
 * it are ignored. If `materials` is given, recognition considers only these.
 * An observer on the service's own machine may override materials of the owner's objects: it sends
 * `object_id` and `material` only, of objects or of their surfaces, with `replace` false.
 */
export interface Scene {
  'type': 'scene';
  /**
   * Id of the request, echoed in the reply.
   */
  'id': number;
  /**
   * New or changed objects, each with all of its fields.
   */
  'objects': SceneObject[];
  /**
   * True: objects that are not listed are removed; false: they stay as they are.
   */
  'replace': boolean;
  /**
   * Ids of removed objects.
   */
  'forget'?: string[] | null;
  /**
   * Air temperature of the scene.
   */
  'ambient_c'?: number | null;
  /**
   * Materials that occur in the scene; absent: all materials in `welcome`.
   */
  'materials'?: string[] | null;
}

/**
 * One object of the scene; all fields except the id are optional.
 *
 * An object in the sun (`sunlit`) is warmer than the air. An object that `vibrates` is also felt
 * through objects in contact with it; `stands_on` declares such contacts. Without `vibrates`, the
 * name may imply a hum; `on` false prevents that.
 */
export interface SceneObject {
  /**
   * The client's id of the object; touches and frames use the same.
   */
  'object_id': string;
  /**
   * Name in the scene, such as Oak_Table_02. Names of parents may precede it, as in Rifle/Magazine. English, and common words of German, French, Spanish, Italian, Portuguese, Japanese, Chinese and Korean are read.
   */
  'name'?: string | null;
  /**
   * One of the materials in `welcome`; the object is then not recognised from pictures.
   */
  'material'?: string | null;
  /**
   * Surface temperature, if the scene knows it.
   */
  'temperature_c'?: number | null;
  /**
   * Shader parameters, which reveal metal and glass.
   */
  'shader'?: Shader | null;
  /**
   * Thickness. Thin objects take on the temperature of the hand; absent: thick.
   */
  'thickness_m'?: number | null;
  /**
   * Whether the sun shines on the object now.
   */
  'sunlit'?: boolean | null;
  /**
   * Vibration, if the object hums by itself.
   */
  'vibrates'?: Vibrates | null;
  /**
   * Ids of the objects that carry it.
   */
  'stands_on'?: string[] | null;
  /**
   * Its surfaces, the largest first; their names say more than its own. A touch feels the one that it names by its index in this list. Since 1.2.
   */
  'surfaces'?: ObjectSurface[] | null;
}

/**
 * Physically based shader parameters.
 */
export interface Shader {
  /**
   * 1 is a metal.
   */
  'metallic'?: number | null;
  /**
   * 0 is a mirror.
   */
  'roughness'?: number | null;
  /**
   * 1 is as clear as glass.
   */
  'transmission'?: number | null;
  /**
   * Share of the colour that blending draws over what lies behind, 1 of all; absent: not blended, as with an alpha mask. Since 1.2.
   */
  'opacity'?: number | null;
  /**
   * Red, green and blue, linear or sRGB.
   */
  'base_color'?: [number, number, number] | null;
}

/**
 * Vibration of an object that hums by itself.
 */
export interface Vibrates {
  /**
   * Fundamental frequency.
   */
  'frequency_hz': number;
  /**
   * Strength as felt by a hand on the object.
   */
  'level': number;
  /**
   * False: switched off, even if the object's name implies a hum.
   */
  'on'?: boolean;
}

/**
 * A surface of an object: a primitive of glTF, a sub-mesh of Unity, a surface of Godot.
 */
export interface ObjectSurface {
  /**
   * Name of its material, or file of its texture, such as Oak_Varnished or T_Planks_D.png.
   */
  'name'?: string | null;
  /**
   * One of the materials in `welcome`; absent: as the object states, else as recognised.
   */
  'material'?: string | null;
  /**
   * Shader parameters of its material; absent: those of the object.
   */
  'shader'?: Shader | null;
  /**
   * Content hash of its base-colour map: 32 hex digits, in lower case.
   */
  'texture'?: string | null;
}

/**
 * One rendered frame.
 */
export interface Frame {
  'type': 'frame';
  /**
   * Id of the request, echoed in the reply.
   */
  'id': number;
  /**
   * Time of rendering, on the client's clock.
   */
  'captured_at': number;
  /**
   * rgb8, rgba8 and bgra8 are raw pixels: width x height x 3 or 4 bytes, row by row.
   */
  'format': FrameFormat;
  /**
   * Width in pixels; must equal the picture's.
   */
  'width': number;
  /**
   * Height in pixels; must equal the picture's.
   */
  'height': number;
  /**
   * The picture. A JPEG of 448 x 448 px, about 20 KB, is sufficient.
   */
  'image': Uint8Array;
  /**
   * `top`: the first row is the top of the picture; `bottom`: it is the bottom, as in OpenGL.
   */
  'origin': FrameOrigin;
  /**
   * `live`: to be recognised, and a newer frame replaces a waiting one; `enrol`: reference pictures of an object, each of which is used; `texture`: the base-colour map of a surface (since 1.2).
   */
  'purpose'?: FramePurpose;
  /**
   * Object shown; absent: a view in which touches may name a region.
   */
  'object_id'?: string | null;
  /**
   * Position of the object in the upright picture.
   */
  'region'?: Region | null;
  /**
   * Surface shown, as an index into the object's `surfaces`; absent: the largest. Since 1.2.
   */
  'surface'?: number;
  /**
   * Pixels of the object, more precise than a region: a PNG of the frame's size with 1 to 8 bits a channel, nonzero = object.
   */
  'mask'?: Uint8Array | null;
  /**
   * An older frame is skipped; absent: no age limit.
   */
  'max_age_ms'?: number | null;
}

/**
 * rgb8, rgba8 and bgra8 are raw pixels: width x height x 3 or 4 bytes, row by row.
 */
export type FrameFormat = "bgra8" | "jpeg" | "png" | "rgb8" | "rgba8";

/**
 * `top`: the first row is the top of the picture; `bottom`: it is the bottom, as in OpenGL.
 */
export type FrameOrigin = "bottom" | "top";

/**
 * `live`: to be recognised, and a newer frame replaces a waiting one; `enrol`: reference pictures of an object, each of which is used; `texture`: the base-colour map of a surface (since 1.2).
 */
export type FramePurpose = "enrol" | "live" | "texture";

/**
 * A rectangle of the upright frame, in fractions from its top left corner.
 */
export interface Region {
  /**
   * Left edge, as a fraction of the width.
   */
  'x': number;
  /**
   * Top edge, as a fraction of the height.
   */
  'y': number;
  /**
   * Width, as a fraction of the frame's width.
   */
  'w': number;
  /**
   * Height, as a fraction of the frame's height.
   */
  'h': number;
}

/**
 * Current state of one hand; every phase except `release` renews the hand's lease.
 *
 * From `distance_m` and `closing_mps` the service predicts when an approach becomes a contact, so
 * that the plate can start in time.
 */
export interface Touch {
  'type': 'touch';
  /**
   * Id of the request, echoed in the reply.
   */
  'id': number;
  /**
   * `approach`: near, not touching yet; `contact`: touching without sliding; `slide`: sliding along the surface; `release`: no longer touching.
   */
  'phase': Phase;
  /**
   * Time of the touch, on the client's clock.
   */
  'captured_at': number;
  /**
   * Each hand is rendered separately.
   */
  'hand': HandName;
  /**
   * Speed of the hand relative to the surface; at contact, the impact speed.
   */
  'speed_mps': number;
  /**
   * Contact force; send 1.5 if the engine does not compute forces.
   */
  'force_n': number;
  /**
   * Object touched. Either this or `region` is required, except for release and swing.
   */
  'object_id'?: string | null;
  /**
   * Surface touched, as an index into the object's `surfaces`; absent: the largest. Since 1.2.
   */
  'surface'?: number;
  /**
   * Region of the newest frame that is touched.
   */
  'region'?: Region | null;
  /**
   * Kind of touch; absent: strike at contact, slide while sliding.
   */
  'interaction'?: Interaction | null;
  /**
   * Distance to the object, during an approach.
   */
  'distance_m'?: number | null;
  /**
   * Rate at which the distance shrinks (negative: grows), during an approach.
   */
  'closing_mps'?: number | null;
}

/**
 * `approach`: near, not touching yet; `contact`: touching without sliding; `slide`: sliding along the surface; `release`: no longer touching.
 */
export type Phase = "approach" | "contact" | "release" | "slide";

/**
 * Each hand is rendered separately.
 */
export type HandName = "left" | "right";

/**
 * The kind of touch. A swing moves through the air and needs no contact.
 */
export type Interaction = "carve" | "press" | "slide" | "strike" | "swing" | "tap";

/**
 * Settings of this connection's session.
 *
 * A scene may take the outputs if nobody owns them or if their owner has touched nothing for 30 s.
 * The owner may give them up, as a tool that only sends pictures does. Any connection may end the
 * owner's connection. The event `ownership` reports free outputs. After taking them, a scene sends
 * its gains, `feel` and current touch again.
 */
export interface Set {
  'type': 'set';
  /**
   * Id of the request, echoed in the reply.
   */
  'id': number;
  /**
   * Air temperature of the scene.
   */
  'ambient_c'?: number | null;
  /**
   * Factor on the vibration. Only for the owner.
   */
  'vibration_gain'?: number | null;
  /**
   * Factor on the thermal effect; 0 keeps the plate neutral. Only for the owner.
   */
  'thermal_gain'?: number | null;
  /**
   * Kinds of `view` events to receive. Only for observers.
   */
  'watch'?: Watch[] | null;
  /**
   * Subscription to `vibration` events. Only for the owner.
   */
  'feel'?: Feel | null;
  /**
   * Change of the outputs' owner.
   */
  'ownership'?: SetOwnership | null;
}

/**
 * `frames`: pictures as they are recognised; `waveform`: the speaker's samples; `log`: lines of the service's log.
 */
export type Watch = "frames" | "log" | "waveform";

/**
 * Subscription to `vibration` events per hand; a hand that is absent gets none.
 */
export interface Feel {
  /**
   * Form for the left hand.
   */
  'left'?: FeelForm | null;
  /**
   * Form for the right hand.
   */
  'right'?: FeelForm | null;
}

/**
 * `amplitude`: one value every 12.5 ms, for actuators with a single frequency; `parametric`: amplitude and frequency every 5 ms, and transients.
 */
export type FeelForm = "amplitude" | "parametric";

/**
 * `take`: own the outputs from now on; `give`: free them; `end`: close the owner's connection.
 */
export type SetOwnership = "end" | "give" | "take";

/**
 * Turn outputs off at once; always obeyed, never queued.
 *
 * The outputs stay off for each hand until the owner sends `release` of that hand and then a new
 * `approach` or `contact`. A new session does not end a stop. A new scene therefore sends
 * `release` for each hand that touches nothing, so that its first touch is felt.
 */
export interface Stop {
  'type': 'stop';
  /**
   * Id of the request, echoed in the reply.
   */
  'id': number;
  /**
   * The outputs that a stop turns off. `speaker` includes controllers.
   */
  'scope': Scope;
}

/**
 * The outputs that a stop turns off. `speaker` includes controllers.
 */
export type Scope = "all" | "peltier" | "speaker";

/**
 * The reply to `hello`.
 */
export interface Welcome {
  'type': 'welcome';
  /**
   * Id of the `hello`.
   */
  'id': number;
  /**
   * Name and version of a client or of the service.
   */
  'service': Party;
  /**
   * Version of the protocol. Majors must match; a newer minor is answered with the service's.
   */
  'protocol': ProtocolVersion;
  /**
   * Session id, new for each connection. A new session knows no objects.
   */
  'session': string;
  /**
   * Whether this scene owns the outputs.
   */
  'owner': boolean;
  /**
   * Limits that the service enforces.
   */
  'limits': Limits;
  /**
   * Output devices of the service.
   */
  'devices': Devices;
  /**
   * Models in use; absent: not loaded.
   */
  'models': Models;
  /**
   * Materials that an object may state.
   */
  'materials': string[];
  /**
   * Use of pictures. A crop is the part of a frame that shows one object.
   */
  'privacy': Privacy;
}

/**
 * Limits that the service enforces.
 */
export interface Limits {
  /**
   * Maximum size of a message; a larger one closes the connection with 1009.
   */
  'message_bytes': number;
  /**
   * Maximum side length of a frame.
   */
  'pixels': number;
  /**
   * Maximum frame rate; frames beyond it are skipped.
   */
  'frames_per_s': number;
  /**
   * Time that an output stays on after the last touch message.
   */
  'lease_ms': number;
  /**
   * Range of the plate's setpoint.
   */
  'setpoint_c': SetpointRange;
}

/**
 * Range of the plate's setpoint.
 */
export interface SetpointRange {
  /**
   * Lowest setpoint, degC.
   */
  'low': number;
  /**
   * Highest setpoint, degC.
   */
  'high': number;
}

/**
 * Output devices of the service.
 */
export interface Devices {
  /**
   * One output device.
   */
  'speaker': Device;
  /**
   * One output device.
   */
  'peltier': Device;
}

/**
 * One output device.
 */
export interface Device {
  /**
   * Name to display.
   */
  'name': string;
  /**
   * Whether the device is simulated.
   */
  'simulated': boolean;
}

/**
 * Models in use; absent: not loaded.
 */
export interface Models {
  /**
   * Image network that recognises materials.
   */
  'encoder'?: string | null;
  /**
   * Set of reference pictures.
   */
  'gallery'?: string | null;
  /**
   * Vision-language model.
   */
  'vlm'?: string | null;
}

/**
 * Use of pictures. A crop is the part of a frame that shows one object.
 */
export interface Privacy {
  /**
   * Whether frames are stored on the service's disk.
   */
  'frames_stored': boolean;
  /**
   * Whether frames are received from or sent to another machine.
   */
  'frames_leave_machine': boolean;
  /**
   * Whether crops are sent to a recogniser on another machine.
   */
  'crops_leave_machine'?: boolean;
}

/**
 * Material, temperatures and vibration pattern decided for one object.
 */
export interface Decision {
  'type': 'decision';
  /**
   * Id of the frame that it answers; 0: an event.
   */
  'id': number;
  /**
   * One of the materials in `welcome`, or unknown.
   */
  'material': string;
  /**
   * Calibrated probability: of all decisions with 0.8, four in five are right.
   */
  'confidence': number;
  /**
   * `scene`: stated by the scene; `name`, `shader`: implied by the object's name or shader; `texture`: read off its texture map (since 1.2); `encoder`: recognised by the image network; `vlm`: recognised by the vision-language model; `unknown`: no source is sure enough.
   */
  'source': Rung;
  /**
   * Whether the decision was made before and is unchanged.
   */
  'cached': boolean;
  /**
   * All evidence considered.
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
   * `scene`: stated by the scene; `vlm`: estimated from a picture by the vision-language model; `default`: 22 degC.
   */
  'ambient_source': AmbientSource;
  /**
   * Temperature of the object's surface before the touch.
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
   * The source of the surface temperature. `ambient` applies without any other.
   */
  'surface_source': SurfaceSource;
  /**
   * Reason for the surface temperature, as text to display.
   */
  'surface_why': string;
  /**
   * Temperature at which skin and object meet; null: unknown.
   */
  'contact_c': number | null;
  /**
   * Setpoint of the plate.
   */
  'setpoint_c': number;
  /**
   * Setpoint that physics alone would give, without limits.
   */
  'unlimited_c': number;
  /**
   * Whether a person can notice the difference from skin temperature.
   */
  'thermal_cue': boolean;
  /**
   * Object decided on; absent: a region of a frame.
   */
  'object_id'?: string | null;
  /**
   * Index of the surface decided on, if the object has more than one. Since 1.2.
   */
  'surface'?: number | null;
  /**
   * Name of the object or its surface in the scene; sent to observers only.
   */
  'name'?: string | null;
  /**
   * Second most probable material.
   */
  'runner_up'?: string | null;
  /**
   * Limit that makes `setpoint_c` differ from `unlimited_c`.
   */
  'limited_by'?: Limit | null;
  /**
   * Vibration pattern, such as wood strike; absent: no touch, or no vibration.
   */
  'pattern'?: string | null;
  /**
   * Basis of the rendering: the material, a guess, a mean over probable materials, or nothing.
   */
  'basis'?: Basis | null;
  /**
   * Reason why nothing is rendered, where `basis` is neutral. Since 1.2.
   */
  'neutral_because'?: NeutralCause | null;
  /**
   * Material that is rendered, in heat and vibration; absent: a mean, or nothing. Since 1.2.
   */
  'felt'?: string | null;
  /**
   * Plain words of `felt`: of its surface and its body, such as smooth and rings. Since 1.2.
   */
  'feels'?: string[];
  /**
   * Duration of each stage of the recognition; empty if there was none.
   */
  'stages_ms'?: Record<string, number>;
  /**
   * Age of the frame that it answers.
   */
  'frame_age_ms'?: number | null;
  /**
   * More specific material implied by the name, such as cork.
   */
  'sub_material'?: string | null;
  /**
   * Thickness used for the contact temperature; absent: thick.
   */
  'thickness_m'?: number | null;
}

/**
 * `scene`: stated by the scene; `name`, `shader`: implied by the object's name or shader; `texture`: read off its texture map (since 1.2); `encoder`: recognised by the image network; `vlm`: recognised by the vision-language model; `unknown`: no source is sure enough.
 */
export type Rung = "encoder" | "name" | "scene" | "shader" | "texture" | "unknown" | "vlm";

/**
 * Evidence from one source.
 */
export interface EvidenceItem {
  /**
   * `scene`: stated by the scene; `name`, `shader`: implied by the object's name or shader; `texture`: read off its texture map (since 1.2); `encoder`: recognised by the image network; `vlm`: recognised by the vision-language model; `unknown`: no source is sure enough.
   */
  'rung': Rung;
  /**
   * Most probable material, or living: a person or an animal (since 1.2).
   */
  'material': string;
  /**
   * Its probability.
   */
  'confidence': number;
}

/**
 * `scene`: stated by the scene; `vlm`: estimated from a picture by the vision-language model; `default`: 22 degC.
 */
export type AmbientSource = "default" | "scene" | "vlm";

/**
 * The source of the surface temperature. `ambient` applies without any other.
 */
export type SurfaceSource = "ambient" | "name" | "scene" | "sun";

/**
 * The limit that keeps the plate from the physical value. `setpoint`: its temperature range; `slew`: its rate of change; `current`: its current; `sink`: a hot heat sink; `dose`: the thermal dose allowed for skin.
 */
export type Limit = "current" | "dose" | "setpoint" | "sink" | "slew";

/**
 * `material`: the decided material is rendered; `least_error`: none is probable enough, and the one that errs least on average is rendered (`felt`); `expectation`: the mean over all probable materials, if the service was started with `--feel graded`; `neutral`: nothing.
 */
export type Basis = "expectation" | "least_error" | "material" | "neutral";

/**
 * `living`: the picture shows a person or an animal, which has no material; `guess`: no material is believed enough, so that any would be a guess.
 */
export type NeutralCause = "guess" | "living";

/**
 * State of the outputs, sent to every connection ten times a second.
 */
export interface Telemetry {
  'type': 'telemetry';
  /**
   * Always 0: an event.
   */
  'id': number;
  /**
   * Temperature of the plate's surface; null: no reading.
   */
  'plate_c': number | null;
  /**
   * Setpoint of the plate.
   */
  'setpoint_c': number;
  /**
   * Temperature of the plate's heat sink; null: no reading.
   */
  'sink_c': number | null;
  /**
   * Drive of the plate, from -1 (full cooling) to 1 (full heating).
   */
  'duty': number;
  /**
   * RMS of the loudest few milliseconds since the last telemetry, 0 to 1 of full scale.
   */
  'speaker_level': number;
  /**
   * Audio blocks missed since the start of the service.
   */
  'underruns': number;
  /**
   * Frames of all connections dropped since the start of the service.
   */
  'dropped_frames': number;
  /**
   * Number of hands with a lease, which touch or approach something now.
   */
  'leases': number;
  /**
   * Current faults of speaker and plate; empty: none.
   */
  'faults': string[];
}

/**
 * Data that an observer subscribed to with `set.watch`; other connections do not get it.
 *
 * A waveform comes in consecutive pieces. `start` counts samples at `rate_hz` since the audio
 * engine started.
 */
export interface View {
  'type': 'view';
  /**
   * Always 0: an event.
   */
  'id': number;
  /**
   * `frames`: pictures as they are recognised; `waveform`: the speaker's samples; `log`: lines of the service's log.
   */
  'kind': Watch;
  /**
   * frames: object shown. waveform: object touched; null: none, or a region.
   */
  'object_id'?: string | null;
  /**
   * frames: position of the object.
   */
  'region'?: Region | null;
  /**
   * frames: jpeg or png.
   */
  'format'?: string | null;
  /**
   * frames: the picture, as base64 in JSON.
   */
  'image'?: Uint8Array | null;
  /**
   * frames: pixels of the object.
   */
  'mask'?: Uint8Array | null;
  /**
   * frames: order of the rows.
   */
  'origin'?: FrameOrigin | null;
  /**
   * waveform: sample rate.
   */
  'rate_hz'?: number | null;
  /**
   * waveform: number of the first sample.
   */
  'start'?: number | null;
  /**
   * waveform: samples, -1 to 1 of full scale.
   */
  'samples'?: number[] | null;
  /**
   * waveform: speed of the hand that touches; null: no hand touches. Since 1.2.
   */
  'speed_mps'?: number | null;
  /**
   * log: one line.
   */
  'text'?: string | null;
}

/**
 * Vibration of one hand from now on: a short plan that replaces the previous plan. An event.
 *
 * Amplitudes are scaled for controllers (1 is the strongest), so play them unchanged. After the
 * last value play nothing: vibration then ends within 100 ms if the link is lost. Transients are
 * already contained in the amplitude. An empty plan means silence now.
 */
export interface Vibration {
  'type': 'vibration';
  /**
   * Always 0: an event.
   */
  'id': number;
  /**
   * Each hand is rendered separately.
   */
  'hand': HandName;
  /**
   * Duration of each value.
   */
  'period_ms': number;
  /**
   * One value per period, 0 to 1, at most 100 ms in total; absent: silence now.
   */
  'amplitude'?: number[];
  /**
   * One frequency per period, in the form parametric; absent in the form amplitude.
   */
  'frequency_hz'?: number[];
  /**
   * Pulses for actuators that can click, in the form parametric; absent: none.
   */
  'transients'?: Transient[];
  /**
   * Whether a `stop`, possibly of another connection, holds the vibration off.
   */
  'stopped'?: boolean;
}

/**
 * A short pulse within a vibration plan.
 */
export interface Transient {
  /**
   * Time after the start of the plan.
   */
  'at_ms': number;
  /**
   * Amplitude, on the scale of the plan.
   */
  'amplitude': number;
  /**
   * Frequency of the pulse.
   */
  'frequency_hz': number;
}

/**
 * Sent to each scene when the outputs become free or change owner. An event.
 *
 * A scene that wants free outputs sends `set` with `ownership` take; the first request gets them.
 */
export interface Ownership {
  'type': 'ownership';
  /**
   * Always 0: an event.
   */
  'id': number;
  /**
   * Whether this scene owns the outputs now.
   */
  'owner': boolean;
  /**
   * Whether nobody owns the outputs.
   */
  'free': boolean;
}

/**
 * The texture maps that the service asks for, each once. An event, since 1.2.
 *
 * They are those of surfaces that names and shaders leave unsure. A scene answers each, when it
 * has time, by one `frame` of purpose `texture` that names an object and a surface with this map.
 */
export interface Textures {
  'type': 'textures';
  /**
   * Always 0: an event.
   */
  'id': number;
  /**
   * Hashes as the scene's surfaces state them in `texture`.
   */
  'hashes': string[];
}

/**
 * The reply to a frame that was dropped.
 */
export interface Skipped {
  'type': 'skipped';
  /**
   * Id of the frame.
   */
  'id': number;
  /**
   * `superseded`: replaced by a newer frame; `stale`: older than its `max_age_ms`; `unchanged`: the object looks as before; `rate`: over `frames_per_s`.
   */
  'reason': SkipReason;
}

/**
 * `superseded`: replaced by a newer frame; `stale`: older than its `max_age_ms`; `unchanged`: the object looks as before; `rate`: over `frames_per_s`.
 */
export type SkipReason = "rate" | "stale" | "superseded" | "unchanged";

/**
 * The reply to a request that succeeded.
 */
export interface Ok {
  'type': 'ok';
  /**
   * Id of the request.
   */
  'id': number;
  /**
   * Parts that were left out or changed; absent: none. At most 33. Since 1.2.
   */
  'left_out'?: LeftOut[] | null;
}

/**
 * A part of a request that was left out or changed; the rest was accepted.
 */
export interface LeftOut {
  /**
   * Part concerned, such as objects[3].name.
   */
  'path': string;
  /**
   * Description of the problem, the limit and its fix, as text to display.
   */
  'text': string;
}

/**
 * The reply to a request that was refused, or an event that reports a fault.
 */
export interface Error {
  'type': 'error';
  /**
   * Id of the request; 0: an event, or a request without a readable id.
   */
  'id': number;
  /**
   * `protocol`: not allowed in this state or role; `message`: malformed; `limit`: out of range; `overload`: a queue is full; `unsafe`: a stop holds the outputs; `device`: an output failed; `model`: a network failed; `not_owner`: another scene owns the outputs.
   */
  'code': ErrorCode;
  /**
   * Description of the problem and its fix, as text to display.
   */
  'text': string;
  /**
   * Field concerned, such as $.objects[3].material.
   */
  'path'?: string | null;
}

/**
 * `protocol`: not allowed in this state or role; `message`: malformed; `limit`: out of range; `overload`: a queue is full; `unsafe`: a stop holds the outputs; `device`: an output failed; `model`: a network failed; `not_owner`: another scene owns the outputs.
 */
export type ErrorCode = "device" | "limit" | "message" | "model" | "not_owner" | "overload" | "protocol" | "unsafe";
