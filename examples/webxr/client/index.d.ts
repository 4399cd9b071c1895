/** A client of the HapticVLM service for web scenes; messages are those of docs/protocol.md. */
import type {
  Decision, Error as Refusal, Feel, Frame, HandName, ObjectSurface, Ownership, Scene, SceneObject, Scope, Skipped, Telemetry, Textures as WantedTextures, Touch, Vibration,
  Welcome,
} from './messages.js';

export type * from './messages.js';

/** The `detail` of each event of `Haptics`. */
export interface HapticsEvents {
  welcome: Welcome;
  decision: Decision;
  telemetry: Telemetry;
  vibration: Vibration;
  /** The outputs became free, or changed their owner. */
  ownership: Ownership;
  /** The service asks for texture maps; `Textures` answers. */
  textures: WantedTextures;
  /** A frame was not recognised. */
  skipped: Skipped;
  /** The service refused a message; the error states the reason and the remedy. */
  refused: Refusal;
  /** A part of the scene was not sent or not taken; the rest is felt. */
  left_out: {object_id?: string; path: string; text: string};
  state: 'connected' | 'disconnected';
}

export interface HapticsOptions {
  /** Name of this client, shown by the service. */
  name?: string;
  version?: string;
  /** Required if the service was started with a token. */
  token?: string;
  /** The WebSocket class for platforms without one: that of `ws` in Node 20. */
  WebSocket?: unknown;
}

/** A touch without the automatic fields; `captured_at` defaults to now. */
export type TouchFields = Omit<Touch, 'type' | 'id' | 'captured_at'> & {captured_at?: number};
export type FrameFields = Omit<Frame, 'type' | 'id' | 'captured_at'> & {captured_at?: number};

/** A scene's connection: reconnects automatically, sends its scene again, takes the outputs when they are free. */
export class Haptics extends EventTarget {
  constructor(url: string, options?: HapticsOptions);
  readonly isConnected: boolean;
  /** Whether this scene owns the outputs and is felt; one scene does at a time. */
  readonly isOwner: boolean;
  /** The reason why nothing is felt, in one sentence; empty if there is none. */
  readonly silence: string;
  /** Time of the service's last message, on the clock of `performance.now`, ms. */
  readonly receivedAt: number;
  /** Numbers of dropped messages: touches without ownership of the outputs, frames replaced by a newer one. */
  readonly lost: {touches: number; frames: number};
  /** Describes all objects of the scene, now and after each reconnect; replaces earlier objects. */
  scene(objects: SceneObject[], fields?: Pick<Scene, 'ambient_c' | 'materials'>): void;
  /** Changes or adds one object. */
  state(object: SceneObject): void;
  /** Removes objects by their ids. */
  forget(ids: Iterable<string>): void;
  /** Requests `vibration` events for these hands. */
  feel(hands: Feel): void;
  /** Sets the gains of vibration and temperature, each 0 to 1. */
  gains(gains: {vibration_gain?: number; thermal_gain?: number}): void;
  /** Sends a touch; send it at 10 Hz or more while a hand touches, and `release` when it leaves. */
  touch(fields: TouchFields): void;
  /** Sends a frame once the service has answered the last one; the newest waits. */
  frame(fields: FrameFields): void;
  /** Sends the texture map of this hash, if a surface still states it; `Textures` calls it. */
  texture(hash: string, fields: Pick<Frame, 'format' | 'width' | 'height' | 'origin' | 'image'>): void;
  /** Stops outputs at once. */
  stop(scope?: Scope): void;
  /** Takes or releases the outputs; a hidden scene should release them. */
  own(wanted?: boolean): void;
  close(): void;
  addEventListener<K extends keyof HapticsEvents>(
    type: K, listener: (event: CustomEvent<HapticsEvents[K]>) => void, options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(type: string, listener: EventListenerOrEventListenerObject | null, options?: boolean | AddEventListenerOptions): void;
}

/**
 * Makes two hands of all input sources, of which a runtime may list several for one hand. While one of them touches, the
 * others of that hand are not felt; a hand whose source vanishes while it touches is released.
 */
export class Hands<Source extends {handedness: HandName | 'none'} = {handedness: HandName | 'none'}> {
  /** `send` sends a touch of one hand, as `(touch) => haptics.touch(touch)`. */
  constructor(send: (touch: TouchFields, source: Source) => void);
  /** Takes the new touches of each source in this picture; call it for every picture, with all sources. */
  step(sources: {source: Source; touches: Omit<TouchFields, 'hand'>[]}[]): void;
}

/** A controller, compatible with WebXR's `XRInputSource`. */
export interface Controller {
  handedness: HandName | 'none';
  gamepad?: unknown;
  hand?: unknown;
}

/** Plays vibration on controllers, gamepads and phones. */
export class Pulses {
  /** Factor applied to the vibration, 0 to 4; values above 1 help weak motors. */
  gain: number;
  /** Plays the vibration of this connection, and requests it for both hands. */
  follow(haptics: Haptics | Felt): void;
  /** Receives one `vibration` event, for use without `follow`. */
  receive(vibration: Pick<Vibration, 'hand' | 'period_ms' | 'amplitude'>): void;
  /** Drops the current plan. */
  rest(): void;
  /** Returns the strongest value of this hand since the last call, 0 to 1. */
  amplitude(hand: HandName): number;
  /** Drives the motor of a controller; call it for every picture. Returns the played amplitude, 0 to 1. */
  play(source: Controller): number;
  /** Drives a phone held in the hand that touches its screen. */
  playOnPhone(hand?: HandName): number;
  /** Returns the reason why this controller is silent, in one sentence; empty if there is none. */
  silence(source?: Controller): string;
}

/** An Object3D of three.js: a mesh, a model of GLTFLoader, or the `getObject3D('mesh')` of an A-Frame entity. */
export interface Root {
  name?: string;
  updateWorldMatrix(parents: boolean, children: boolean): void;
  traverse(visit: (node: any) => void): unknown;
}

/** An intersection of a Raycaster of three.js. */
export interface Hit {
  object: object;
  face?: {materialIndex: number} | null;
}

/**
 * Returns the surfaces of an object, for its `surfaces`: one for each material of all meshes in `root`, the largest
 * first. A mesh with groups has several, and so has a model of several meshes. Call it again when materials change.
 * With `textures`, surfaces state their base-colour maps, which these send if the service asks for them.
 */
export function surfacesOf(root: Root, textures?: Textures): ObjectSurface[];
/** Returns the index of the surface that a ray hit, for `surface` of a touch; 0, the largest, if it is none of `surfacesOf`. */
export function surfaceAt(root: Root, hit: Hit): number;

/** Sends texture maps, so that the service can tell the material of surfaces that neither name nor shader tells. */
export class Textures {
  /** Number of maps that a canvas could not draw or read, such as compressed ones and those of another origin. */
  unreadable: number;
  /**
   * Returns the hash that a surface with this map states as its `texture`; undefined: the map cannot be read.
   * `region` is the part of the map that the surface uses, in fractions from the top left.
   */
  name(
    image: CanvasImageSource | {data: ArrayLike<number>; width: number; height: number},
    region?: {x: number; y: number; w: number; h: number},
  ): string | undefined;
  /** Sends the maps that the service of this connection asks for, a few a second. */
  follow(haptics: Haptics): void;
  /** Forgets every map, for a scene that replaces another. */
  clear(): void;
}

/** A feel file, opened. */
export interface OpenFeel {
  readonly voice: 'sound' | 'true';
  readonly materials: ReadonlyMap<string, unknown>;
}

/** Opens the parsed contents of `feel.true.json` or `feel.sound.json`. Throws an Error that names the first field that is wrong. */
export function openFeel(file: unknown): OpenFeel;

/** How a touched surface feels: its material, and what `materials.json` says of it. */
export interface FeltSurface {
  material?: string;
  /** Factor of impacts, below 1 where the material is doubtful. */
  impact_gain?: number;
  /** Thickness of a swung object, m. */
  thickness_m?: number;
  hum?: {frequency_hz: number; level: number; drives: number[]};
}

/** A touch as `Haptics.touch` takes it. */
export type PlayedTouch = Omit<Touch, 'type' | 'id' | 'captured_at'>;
export type Plan = Required<Pick<Vibration, 'period_ms' | 'amplitude' | 'frequency_hz' | 'transients'>>;

/** The two hands of one scene without a service; times are in s of any one clock. */
export class FeelPlayer {
  /** With `soundHz` it renders samples, and else it plans. `say` gets each problem of a touch, once; the console does unless stated. */
  constructor(feel: OpenFeel, surfaceOf: (touch: PlayedTouch) => FeltSurface | undefined, options?: {soundHz?: number; say?: (text: string) => void});
  /** Factor of everything, 0 to 1. */
  gain: number;
  /** Fields of which a problem was said. */
  readonly said: ReadonlySet<string>;
  /** Receives a touch; returns whether it begins an impact, which asks for a plan at once. */
  touch(touch: PlayedTouch, now: number): boolean;
  /** Ends everything; a hand is felt again after its release and a new approach or contact. */
  stop(): void;
  /** Whether a stop keeps this hand silent. */
  isHeld(hand: HandName): boolean;
  /** Returns the next 100 ms of a hand; empty lists are silence. */
  plan(hand: HandName, form: 'amplitude' | 'parametric', now: number): Plan;
  /** Returns the next samples of both hands, -1 to 1, at `soundHz`. */
  render(count: number, now: number): Float64Array;
}

/** An object and a surface of it, as a bake has them. */
export interface BakedPart {
  object_id: string;
  surface?: number;
}

/** What is known of a touched thing; `paths` are its names behind its parents' as `engine` spells them, the best first. */
export interface BakeQuery {
  object_id?: string;
  paths?: string[];
  material?: string;
  primitive?: number;
  surface?: number;
  /** `three`, `godot`, or `scene` for an engine that keeps names. */
  engine?: string;
}

/** The contents of `materials.json`, and the rule by which things are found in it. */
export class Bake {
  /** Throws an Error that names the first field that is wrong. */
  constructor(file: unknown);
  /** Returns the part of the bake that an object of three.js, A-Frame or Babylon.js is; `hit` tells the surface. */
  bakedOf(object: {name: string; parent: any} | null | undefined, hit?: Hit): BakedPart | undefined;
  /** Remembers a loaded model of three.js, so that nameless meshes that a page makes of its geometries are found. */
  static learn(model: {traverse(visit: (object: any) => void): void}): void;
  /** Finds a thing by its id, else the path of its names, else its material's name. */
  find(query: BakeQuery): (Required<BakedPart> & {by: 'id' | 'path' | 'material'}) | undefined;
  surface(part: Required<BakedPart> | undefined): FeltSurface | undefined;
  /** Returns the id that is most like a name. */
  nearest(name: string): string | undefined;
}

/** The service where it answers, else a bake. */
export type FeltMode = 'auto' | 'service' | 'baked';

/** One switch for what is felt: the service, or a bake in this page. */
export class Felt extends EventTarget {
  /** `haptics` is null for a page without a service; `materials` is the contents of `materials.json`, or a `Bake`. */
  constructor(haptics: Haptics | null, feel: OpenFeel, options?: {materials?: unknown; mode?: FeltMode});
  mode: FeltMode;
  /** Which of the two is felt now. */
  readonly by: 'service' | 'baked';
  /** The reason why the bake is felt, in one sentence; empty while the service is. */
  readonly bakedBecause: string;
  /** The reason why nothing is felt, in one sentence; empty if there is none. */
  readonly silence: string;
  scene(objects: SceneObject[], fields?: Pick<Scene, 'ambient_c' | 'materials'>): void;
  /** Removes objects; a hand that touches one is released. */
  forget(ids: Iterable<string>): void;
  feel(hands: Feel): void;
  gains(gains: {vibration_gain?: number; thermal_gain?: number}): void;
  /** Returns `object_id` and `surface` of an object of the page for a touch, as the bake has it; `hit` tells the surface. */
  bakedOf(object: {name: string; parent: any}, hit?: Hit): BakedPart;
  /** Returns what is felt of a touched object without the service. */
  surfaceOf(touch: PlayedTouch): FeltSurface;
  /** Sends a touch; send it at 30 Hz or more, so that a change to the bake leaves no gap above 50 ms. */
  touch(fields: TouchFields): void;
  stop(scope?: Scope): void;
  close(): void;
  addEventListener<K extends keyof HapticsEvents>(
    type: K, listener: (event: CustomEvent<HapticsEvents[K]>) => void, options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(type: string, listener: EventListenerOrEventListenerObject | null, options?: boolean | AddEventListenerOptions): void;
}

/** Plays touches as sound in an AudioContext, in the voice of its feel file. */
export class FeltSound {
  /** `context` is an `AudioContext`. Throws where the page has no AudioWorklet. */
  static open(context: unknown, feel: OpenFeel): Promise<FeltSound>;
  /** The `AudioWorkletNode` to connect. */
  readonly output: unknown;
  touch(touch: PlayedTouch, surface?: FeltSurface): void;
  /** Ends everything within 20 ms. */
  stop(): void;
  close(): void;
}
