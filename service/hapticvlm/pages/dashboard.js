// Watches the service as an observer, over the same protocol as any scene; JSON for readability.
const SECONDS = 30;
const byId = (id) => document.getElementById(id);
const degrees = (value) => (value == null ? "no reading" : `${value.toFixed(1)} °C`);
const history = [];
const decisions = new Map();
let socket = null;
let nextId = 2;
let stopId = null;

function connect() {
  socket = new WebSocket(`ws://${location.host}/`);
  socket.onopen = () => send({ type: "hello", id: 1, client: { name: "dashboard", version: "1" }, protocol: { major: 1, minor: 0 }, role: "observer", ...token() });
  socket.onmessage = (event) => take(JSON.parse(event.data));
  socket.onclose = () => { byId("state").textContent = "service gone; trying again"; setTimeout(connect, 1000); };
}

function token() {
  const given = new URLSearchParams(location.hash.slice(1)).get("token");
  return given ? { token: given } : {};
}

function send(message) {
  const isOpen = socket?.readyState === WebSocket.OPEN;
  if (isOpen) socket.send(JSON.stringify(message));
  return isOpen;
}

function take(message) {
  if (message.type === "welcome") welcome(message);
  else if (message.type === "telemetry") telemetry(message);
  else if (message.type === "decision") decide(message);
  else if (message.type === "view" && message.kind === "waveform") drawWave(message.samples);
  else if (message.type === "ok" && message.id === stopId) byId("state").textContent = "stopped: outputs rest until the scene releases and touches anew";
  else if (message.type === "error") byId("state").textContent = message.text;
}

function welcome(message) {
  const { speaker, peltier } = message.devices;
  byId("state").textContent = `watching ${message.service.name} ${message.service.version}`;
  byId("speaker-name").textContent = speaker.name;
  byId("plate-name").textContent = peltier.name;
  send({ type: "set", id: nextId++, watch: ["waveform"] });
}

function telemetry(message) {
  byId("plate").textContent = degrees(message.plate_c);
  byId("setpoint").textContent = degrees(message.setpoint_c);
  byId("sink").textContent = degrees(message.sink_c);
  byId("duty").textContent = `${(100 * message.duty).toFixed(0)} %`;
  byId("level").textContent = message.speaker_level.toFixed(3);
  byId("underruns").textContent = message.underruns;
  byId("faults").textContent = message.faults.length ? `Plate off: ${message.faults.join(", ")}` : "";
  history.push([performance.now() / 1000, message.plate_c, message.setpoint_c]);
  while (history.length && history[0][0] < performance.now() / 1000 - SECONDS) history.shift();
  drawPlate();
}

function decide(message) {
  const name = message.object_id ?? "the view";
  decisions.delete(name);
  decisions.set(name, message);
  const rows = [...decisions].reverse().slice(0, 20).map(([object, decision]) => {
    const row = document.createElement("tr");
    const why = (decision.evidence ?? []).map((item) => `${item.rung}: ${item.material} ${Math.round(100 * item.confidence)} %`).join(", ");
    const limited = decision.limited_by ? ` (limited by ${decision.limited_by})` : "";
    const feels = decision.thermal_cue ? `${degrees(decision.setpoint_c)}${limited}` : "no thermal cue";
    for (const text of [object, decision.material, `${Math.round(100 * decision.confidence)} %`, decision.source, why, feels]) {
      row.insertCell().textContent = text;
    }
    return row;
  });
  byId("decisions").replaceChildren(...rows);
}

function chart(canvas, low, high) {
  const context = canvas.getContext("2d");
  const style = getComputedStyle(document.documentElement);
  const y = (value) => canvas.height - ((value - low) / (high - low)) * canvas.height;
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.font = "16px system-ui";
  context.fillStyle = context.strokeStyle = resolve("--soft");
  return { context, style, y };
}

function resolve(name) {
  const probe = document.createElement("span");
  probe.style.color = `var(${name})`;
  document.body.append(probe);
  const colour = getComputedStyle(probe).color;
  probe.remove();
  return colour;
}

function drawPlate() {
  const canvas = byId("plate-chart");
  const { context, y } = chart(canvas, 16, 42);
  const now = performance.now() / 1000;
  for (const mark of [20, 32, 40]) {
    context.globalAlpha = 0.4;
    context.fillRect(0, y(mark), canvas.width, 1);
    context.globalAlpha = 1;
    context.fillText(`${mark} °C`, 2, y(mark) - 4);
  }
  for (const [column, name] of [[2, "--setpoint"], [1, "--plate"]]) {
    context.beginPath();
    context.lineWidth = 3;
    context.strokeStyle = resolve(name);
    for (const sample of history) {
      if (sample[column] != null) context.lineTo(canvas.width * (1 - (now - sample[0]) / SECONDS), y(sample[column]));
    }
    context.stroke();
  }
}

function drawWave(samples) {
  const canvas = byId("wave-chart");
  const { context, y } = chart(canvas, -1, 1);
  context.beginPath();
  context.lineWidth = 2;
  context.strokeStyle = resolve("--setpoint");
  samples.forEach((sample, index) => context.lineTo((canvas.width * index) / (samples.length - 1), y(sample)));
  context.stroke();
}

async function count() {
  try {
    const status = await (await fetch("/status")).json();
    const entries = { owner: status.owner ?? "nobody", connections: status.connections, "lost commands": status.speaker.lost_commands, "engine restarts": status.speaker.restarts, "recogniser restarts": status.recogniser.restarts, ...status.counts };
    byId("counts").replaceChildren(...Object.entries(entries).map(([name, value]) => {
      const row = document.createElement("div");
      row.append(Object.assign(document.createElement("dt"), { textContent: name }), Object.assign(document.createElement("dd"), { textContent: value }));
      return row;
    }));
  } catch { /* the socket's own state says that the service is gone */ }
  setTimeout(count, 1000);
}

byId("stop").addEventListener("click", () => {
  stopId = nextId++;
  byId("state").textContent = "stopping";
  const isSent = send({ type: "stop", id: stopId, scope: "all" });
  if (!isSent) byId("state").textContent = "NOT STOPPED: no connection to the service; switch the devices off by hand";
});
connect();
count();
