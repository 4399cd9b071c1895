/**
 * The scripts of touches: their objects, order and pictures; `?script=NAME` selects one.
 *
 * `probe` is a point on the object, `toward` the finger's direction into it, `slide` the length of the stroke (m),
 * `speed` the speed of impact (m/s), `hold` its duration (s), `stay` the time the finger then rests (s), `lead` the extra time of its approach
 * (s), `gaze` the distance of the head (m). `side` and `quality` are those of the JPEG; a picture is
 * taken every `every` steps, and every `still` steps while a hand has rested on one object for a while.
 */
const EVERY_OBJECT = [
  {hand: 'right', name: 'Oak_Table_02', speed: 0.5,
   probe: [0.03, 0.74, -0.06], toward: [0, -1, -0.2], slide: [0.06, 0, 0.01]},
  {hand: 'right', name: 'Newspaper_A3', speed: 0.25,
   probe: [0.23, 0.76, 0], toward: [0, -1, -0.2], slide: [0.07, 0, -0.02]},
  {hand: 'left', name: 'TeaMug_01', speed: 0.25, hold: 0.85, gaze: 0.33,
   probe: [-0.25, 0.8, -0.01], toward: [0.1, -0.35, -1], slide: [0.004, 0.005, 0]},
  {hand: 'right', name: 'LeatherJournal', speed: 0.25,
   probe: [0.5, 0.78, 0], toward: [0, -1, -0.25], slide: [0.06, 0, -0.03]},
  {hand: 'right', name: 'Object_19', speed: 0.5,
   probe: [0.76, 0.8, 0.02], toward: [0, -0.5, -1], slide: [0.03, 0.01, 0]},
  {hand: 'right', name: 'Curtain.001', speed: 0.25, lead: 0.3,
   probe: [0.8, 1.1, -0.75], toward: [0, 0, -1], slide: [-0.07, -0.03, 0]},
  {hand: 'right', name: 'Sphere.021', speed: 0.25, lead: 0.1, gaze: 0.38,
   probe: [0.8, 0.83, -0.4], toward: [0, -0.3, -1], slide: [-0.03, 0.01, 0]},
  {hand: 'right', name: 'Object_07', speed: 0.4, gaze: 0.38,
   probe: [0.5, 0.82, -0.38], toward: [0, -0.3, -1], slide: [-0.02, -0.02, 0]},
  {hand: 'right', name: 'Mesh_31', speed: 0.35, gaze: 0.4,
   probe: [0.25, 0.82, -0.36], toward: [0, -0.3, -1], slide: [0.03, 0.015, 0]},
  {hand: 'right', name: 'Cube.003', speed: 0.5, gaze: 0.4,
   probe: [0.01, 0.87, -0.42], toward: [0, -1, -0.35], slide: [-0.05, 0, 0.01]},
  {hand: 'left', name: 'Mesh_12', speed: 0.25,
   probe: [-0.5, 0.84, -0.02], toward: [0, -1, -0.25], slide: [-0.06, 0, -0.02]},
  {hand: 'right', name: 'GlassVase', speed: 0.4, gaze: 0.36,
   probe: [-0.25, 0.84, -0.36], toward: [-0.1, -0.3, -1], slide: [-0.02, 0.02, 0]},
  {hand: 'left', name: 'Torus.002', speed: 0.3,
   probe: [-0.7, 0.81, -0.0], toward: [0, -1, -0.25], slide: [0.02, 0, -0.03]},
  {hand: 'right', name: 'M_BrushedSteel_Kettle', speed: 0.5,
   probe: [-0.48, 0.83, -0.36], toward: [-0.1, -0.4, -1], slide: [-0.04, 0.02, 0]},
  {hand: 'left', name: 'Prop_Crate', speed: 0.4,
   probe: [-0.78, 0.87, -0.36], toward: [0, -0.5, -1], slide: [0.05, 0, 0]},
  {hand: 'left', name: 'Plant_Monstera', speed: 0.25, lead: 0.1,
   probe: [-1.0, 0.99, -0.25], toward: [0, -1, -0.4], slide: [0.015, 0.01, 0.04]},
];

/** Fewer touches, beginning with the warm mug, long enough to feel warmth; small pictures for the package. */
const DEMO = [
  {hand: 'left', name: 'TeaMug_01', speed: 0.25, hold: 1.2, stay: 2.9, gaze: 0.36, lead: 0.4,
   probe: [-0.25, 0.8, -0.01], toward: [0.1, -0.35, -1], slide: [0.006, 0.005, 0]},
  {hand: 'left', name: 'Mesh_12', speed: 0.25, hold: 0.9, stay: 0.1, lead: 3.9,
   probe: [-0.46, 0.84, -0.02], toward: [0, -1, -0.25], slide: [-0.1, 0, -0.02]},
  {hand: 'right', name: 'Oak_Table_02', speed: 0.5, hold: 0.8, stay: 0.1, lead: 1,
   probe: [-0.02, 0.74, -0.06], toward: [0, -1, -0.2], slide: [0.1, 0, 0.02]},
  {hand: 'right', name: 'Mesh_31', speed: 0.35, hold: 0.7, stay: 0.1, gaze: 0.4, lead: 0.9,
   probe: [0.24, 0.82, -0.36], toward: [0, -0.3, -1], slide: [0.04, 0.015, 0]},
  {hand: 'right', name: 'Cube.003', speed: 0.5, hold: 0.8, stay: 0.1, gaze: 0.4, lead: 0.8,
   probe: [0.04, 0.87, -0.42], toward: [0, -1, -0.35], slide: [-0.08, 0, 0.01]},
  {hand: 'right', name: 'M_BrushedSteel_Kettle', speed: 0.5, hold: 1.2, stay: 2.9, lead: 0.9,
   probe: [-0.48, 0.83, -0.36], toward: [-0.1, -0.4, -1], slide: [-0.03, 0.015, 0]},
  {hand: 'right', name: 'Object_07', speed: 0.4, hold: 0.4, stay: 0.1, gaze: 0.38, lead: 4,
   probe: [0.5, 0.82, -0.38], toward: [0, -0.3, -1], slide: [-0.02, -0.02, 0]},
  {hand: 'left', name: 'Torus.002', speed: 0.3, hold: 0.7, stay: 0.1, lead: 0.6,
   probe: [-0.7, 0.81, -0.0], toward: [0, -1, -0.25], slide: [0.03, 0, -0.04]},
];

const SCRIPTS = {
  living_room: {side: 448, quality: 0.56, every: 3, still: 3, touches: EVERY_OBJECT},
  demo: {side: 320, quality: 0.5, every: 15, still: 60, touches: DEMO},
};

export const SCRIPT = SCRIPTS[new URLSearchParams(location.search).get('script') ?? 'living_room'];
