// Connects the dashboard to the service as an observer that can stop it, and wires the panels together.
import { inStep } from "./chart.js";
import * as connecting from "./connect.js";
import * as decisions from "./decisions.js";
import { byId, clock, setText } from "./dom.js";
import * as faults from "./faults.js";
import * as frame from "./frame.js";
import * as gesture from "./gesture.js";
import { Link } from "./link.js";
import { offerSound, sound } from "./hear.js";
import * as log from "./log.js";
import * as plate from "./plate.js";
import * as service from "./service.js";
import * as speaker from "./speaker.js";
import * as stages from "./stages.js";
import { offerStop, showHeld } from "./stop.js";
import * as teach from "./teach.js";
import { offerThemes } from "./theme.js";
import * as trial from "./trial.js";

const STATUS_MS = 1000;
const CALM_STATUS_MS = 3000; // while nothing is felt
const FELT_MS = 12_000; // after the last touch, in which its charts run out
const TELEMETRY_MS = 100;
const SILENT = 1e-4; // of full scale
const STATUS_PATIENCE_MS = 5000;
const TOKEN_KEY = "hapticvlm-token"; // stored until this tab is closed
const VIEWS = { frames: frame.take, waveform, log: log.take };

let faultNames = "";
let connected = "Connected.";
let watched = "";
let leases = 0;
let newest = null; // telemetry
let loudest = 0; // of the readings since the last that was shown, of full scale
let feltAt = performance.now(); // when something was felt last
const url = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/`;
const link = new Link(url, {
  onMessage: receive,
  onState: showState,
  token: new URLSearchParams(location.hash.slice(1)).get("token") ?? sessionStorage.getItem(TOKEN_KEY),
});

function receive(message) {
  switch (message.type) {
    case "welcome":
      return welcome(message);
    case "telemetry":
      return telemetry(message);
    case "decision":
      stages.take(message);
      return decisions.take(message);
    case "view":
      return VIEWS[message.kind]?.(message);
    case "error":
      return faults.trouble(message);
  }
}

function waveform(view) {
  speaker.waveform(view);
  gesture.take(view);
}

function welcome(message) {
  for (const panel of [plate, speaker, service, trial, teach]) panel.welcome(message);
  connected = `Connected to ${message.service.name} ${message.service.version}.`;
  setText(byId("link"), connected);
  watched = "";
  watch();
}

const isCalm = () => performance.now() - feltAt > FELT_MS;

// Requests frames only while the page is visible, and the waveform, fifty pieces a second, only while something is felt
// or heard. A new request begins a tenth of a second in the past, so that the onset is in it.
function watch() {
  const views = document.hidden ? [] : isCalm() && !sound.isOn ? ["frames"] : ["frames", "waveform"];
  if (views.join() === watched) return;
  watched = views.join();
  link.ask({ type: "set", watch: [...views, "log"] });
}

const showTelemetry = inStep(() => {
  if (link.state !== "open") return;
  plate.telemetry(newest);
  speaker.telemetry({ ...newest, speaker_level: loudest });
  loudest = 0;
}, TELEMETRY_MS);

function telemetry(message) {
  newest = message;
  loudest = Math.max(loudest, message.speaker_level); // a strike may be in one reading only
  showTelemetry();
  if (message.leases || message.speaker_level > SILENT) feltAt = performance.now();
  watch();
  const names = message.faults.join();
  if (names !== faultNames || message.leases !== leases) askStatus();
  faultNames = names;
  leases = message.leases;
}

function showState(state) {
  const since = clock();
  const words = { connecting: "Connecting to the service.", open: connected, silent: "No answer.", gone: "Not connected.", token: "Not connected." };
  const trouble = {
    silent: `The service is connected but has sent nothing since ${since}: it hangs.`,
    gone: `Service unreachable since ${since}; retrying. The values shown are old.`,
    token: link.token ? "The token is wrong." : "The service requires its token.",
  };
  document.body.dataset.link = state;
  setText(byId("link"), words[state]);
  setText(byId("gone"), trouble[state] ?? "");
  byId("token-form").hidden = state !== "token";
  if (state !== "open") for (const panel of [plate, speaker, faults, gesture]) panel.gap();
}

async function askStatus() {
  if (document.hidden) return;
  const askedAt = performance.now();
  try {
    const status = await (await fetch("/status", { signal: AbortSignal.timeout(STATUS_PATIENCE_MS) })).json();
    if (link.state !== "open") return;
    service.show(status);
    teach.show(status);
    connecting.show(status);
    decisions.rest(status);
    faults.show(status);
    stages.paint(status.speaker.command_wait_ms);
    showHeld(status, askedAt);
  } catch {
    return; // the state of the connection reports a lost service
  }
}

async function follow() {
  await askStatus();
  setTimeout(follow, isCalm() && document.body.dataset.mode === "idle" ? CALM_STATUS_MS : STATUS_MS);
}

byId("token-form").addEventListener("submit", (event) => {
  event.preventDefault();
  const token = byId("token").value;
  sessionStorage.setItem(TOKEN_KEY, token);
  link.offer(token);
});
document.addEventListener("visibilitychange", () => {
  watch();
  askStatus();
});
offerThemes();
offerSound();
sound.addEventListener("change", watch);
connecting.begin(url);
teach.begin(link);
trial.offerTouches(url, () => ({ token: link.token }));
offerStop(link, askStatus);
service.offerEnd(link, askStatus);
decisions.offerChoice();
link.connect();
follow();
