/** A client of the HapticVLM service for web scenes; messages are those of docs/protocol.md. */
import type {
  Decision, Error as Refusal, Feel, Frame, HandName, Ownership, Scene, SceneObject, Scope, Skipped, Telemetry, Touch, Vibration, Welcome,
} from './messages.js';

export type * from './messages.js';

/** What each event of `Haptics` brings as `detail`. */
export interface HapticsEvents {
  welcome: Welcome;
  decision: Decision;
  telemetry: Telemetry;
  vibration: Vibration;
  /** The outputs became free, or changed hands. */
  ownership: Ownership;
  /** A frame was not looked at. */
  skipped: Skipped;
  /** The service refused something: what, and what to do. */
  refused: Refusal;
  state: 'connected' | 'disconnected';
}

export interface HapticsOptions {
  /** Shown to people who look at the service. */
  name?: string;
  version?: string;
  /** Needed where the service was started with one. */
  token?: string;
  /** What to connect with where the platform has no WebSocket of its own: that of `ws`, in node 20. */
  WebSocket?: unknown;
}

/** A touch without what is filled in: `captured_at` is now unless it is given. */
export type TouchFields = Omit<Touch, 'type' | 'id' | 'captured_at'> & {captured_at?: number};
export type FrameFields = Omit<Frame, 'type' | 'id' | 'captured_at'> & {captured_at?: number};

/** A scene's connection: reconnects by itself, says its scene again, takes the outputs when they are free. */
export class Haptics extends EventTarget {
  constructor(url: string, options?: HapticsOptions);
  readonly isConnected: boolean;
  /** Whether this scene drives the outputs: one scene does, and only it is felt. */
  readonly isOwner: boolean;
  /** Why nothing is felt, in one sentence; empty when nothing stands in the way. */
  readonly silence: string;
  /** What was not sent: touches while another scene was felt or none, frames that a newer one replaced. */
  readonly lost: {touches: number; frames: number};
  /** Says what the scene holds, now and after each reconnect; forgets what it held before. */
  scene(objects: SceneObject[], fields?: Pick<Scene, 'ambient_c' | 'materials'>): void;
  /** States one object anew, or adds it. */
  state(object: SceneObject): void;
  /** Forgets objects that are no more, by their ids. */
  forget(ids: Iterable<string>): void;
  /** Asks for `vibration` events for these hands. */
  feel(hands: Feel): void;
  /** Sets how strong vibration and temperature are, each 0 to 1. */
  gains(gains: {vibration_gain?: number; thermal_gain?: number}): void;
  /** Sends a touch; send it at 10 Hz or more while a hand touches, and `release` when it leaves. */
  touch(fields: TouchFields): void;
  /** Sends a frame when the service has answered the one before; the newest waits. */
  frame(fields: FrameFields): void;
  /** Rests outputs at once. */
  stop(scope?: Scope): void;
  /** Takes the outputs, or gives them up: a scene that nobody looks at should not keep them. */
  own(wanted?: boolean): void;
  close(): void;
  addEventListener<K extends keyof HapticsEvents>(
    type: K, listener: (event: CustomEvent<HapticsEvents[K]>) => void, options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(type: string, listener: EventListenerOrEventListenerObject | null, options?: boolean | AddEventListenerOptions): void;
}

/** A controller as WebXR's `XRInputSource` has it. */
export interface Controller {
  handedness: HandName | 'none';
  gamepad?: unknown;
  hand?: unknown;
}

/** Plays vibration on controllers, gamepads and phones. */
export class Pulses {
  /** Times what the service sends, 0 to 4: more makes weak motors felt. */
  gain: number;
  /** Plays the vibration of this connection, and asks for it for both hands. */
  follow(haptics: Haptics): void;
  /** Receives one `vibration` event; for who does not `follow`. */
  receive(vibration: Pick<Vibration, 'hand' | 'period_ms' | 'amplitude'>): void;
  /** Forgets what was planned. */
  rest(): void;
  /** The strongest that this hand felt since the last call, 0 to 1. */
  amplitude(hand: HandName): number;
  /** Moves the motor of a controller; call it for every picture. Returns what is played, 0 to 1. */
  play(source: Controller): number;
  /** The same on a phone held in the hand that touches its screen. */
  playOnPhone(hand?: HandName): number;
  /** Why this controller is silent, in one sentence; empty when nothing stands in the way. */
  silence(source?: Controller): string;
}
