// Draws on a canvas at the screen's resolution, in the page's colours.
import { eachFrame } from "./dom.js";

const MAX_PIXELS = 2; // per CSS pixel; more is invisible and slow
const CALM_MS = 1000; // between frames when the user prefers reduced motion
const YIELD_MS = 60; // after a key or a press, so that its effect is painted first
const YIELDS_EACH_MS = 400; // so that keys held down do not stop the charts
const COLOURS = ["ink", "soft", "line", "card", "setpoint", "wave", "wave-soft"];
const calm = matchMedia("(prefers-reduced-motion: reduce)");
let colours = null;
let yieldsUntil = -Infinity;

// Returns the colours for the canvas; reads them from the page once per theme.
export function palette() {
  if (colours === null) {
    const probe = document.body.appendChild(document.createElement("span"));
    const resolve = (name) => {
      probe.style.color = `var(--${name})`;
      return [name, getComputedStyle(probe).color];
    };
    colours = Object.fromEntries(COLOURS.map(resolve));
    probe.remove();
  }
  return colours;
}

document.addEventListener("themechange", () => (colours = null));
for (const act of ["pointerdown", "pointerup", "keydown", "keyup"]) {
  document.addEventListener(act, ({ timeStamp }) => yieldTo(timeStamp), { capture: true, passive: true });
}

function yieldTo(actedAt) {
  if (actedAt > yieldsUntil + YIELDS_EACH_MS) yieldsUntil = actedAt + YIELD_MS;
}

// Returns a function that runs `paint` at the next multiple of `everyMs`, however often it is called. What changes at
// the same multiples shares a frame of the browser, which costs more than what is painted in it.
export function inStep(paint, everyMs) {
  let timer = null;
  const run = () => {
    timer = null;
    paint();
  };
  return () => (timer ??= setTimeout(run, untilStep(everyMs)));
}

const untilStep = (everyMs) => everyMs - (performance.now() % everyMs);

// A canvas that is repainted on request (at multiples of `everyMs`), when its size changes and when the
// theme changes. paint(context, width, height) works in CSS pixels. The size comes from an observer and is
// never read, because reading it would force the browser to lay out the page immediately.
export class Chart {
  constructor(canvas, paint, everyMs = 0) {
    this.canvas = canvas;
    this.paint = paint;
    this.everyMs = everyMs;
    this.size = null;
    this.timer = null;
    this.inFrame = eachFrame(() => this.#draw());
    new ResizeObserver(([{ contentRect }]) => {
      this.size = contentRect;
      this.inFrame();
    }).observe(canvas);
    document.addEventListener("themechange", () => this.inFrame());
  }

  change() {
    const everyMs = calm.matches ? CALM_MS : this.everyMs;
    if (!everyMs) this.inFrame();
    else this.timer ??= setTimeout(() => this.inFrame(), untilStep(everyMs));
  }

  #draw() {
    clearTimeout(this.timer);
    const yieldMs = yieldsUntil - performance.now();
    this.timer = yieldMs > 0 ? setTimeout(() => this.inFrame(), yieldMs) : null;
    if (this.timer) return;
    if (!this.size) return;
    const { width, height } = this.size;
    const scale = Math.min(devicePixelRatio, MAX_PIXELS);
    fit(this.canvas, Math.round(width * scale), Math.round(height * scale));
    const context = this.canvas.getContext("2d");
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.clearRect(0, 0, width, height);
    context.font = "11px system-ui, sans-serif";
    this.paint(context, width, height);
  }
}

// Draws a thin horizontal line with its label above it.
export function rule(context, y, width, words) {
  const { line, soft } = palette();
  context.fillStyle = line;
  context.fillRect(0, Math.round(y), width, 1);
  context.fillStyle = soft;
  context.fillText(words, 2, y - 3);
}

// Draws `count` points, x(i) and y(i); NaN, a missing reading, leaves a gap. `dash` distinguishes lines without colour.
export function trace(context, { count, x, y, colour, dash = [], thick = 2 }) {
  context.strokeStyle = colour;
  context.lineWidth = thick;
  context.lineJoin = "round";
  context.setLineDash(dash);
  context.beginPath();
  let isDrawing = false;
  for (let index = 0; index < count; index++) {
    const height = y(index);
    if (Number.isNaN(height)) isDrawing = false;
    else if (isDrawing) context.lineTo(x(index), height);
    else {
      context.moveTo(x(index), height);
      isDrawing = true;
    }
  }
  context.stroke();
  context.setLineDash([]);
}

function fit(canvas, width, height) {
  if (canvas.width !== width) canvas.width = width;
  if (canvas.height !== height) canvas.height = height;
}
