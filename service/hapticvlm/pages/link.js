// A connection to the service: sends hello, matches answers by id, and reconnects automatically as an observer.
//
// States: connecting, open, silent (connected, but the service hangs), gone, token
// (the service requires one). Messages are JSON, which browsers parse natively; pictures are base64.

// A link for a phone holds name and password. A page with such an address may fetch nothing, so it begins again
// without them; the browser has them now.
if (new URL(document.URL).password) location.replace(location.href);

const FIRST_WAIT_MS = 500;
const LONGEST_WAIT_MS = 5000;
const SILENT_MS = 3000; // telemetry arrives every 100 ms
const ANSWER_MS = 2000;

export class Link {
  constructor(url, { onMessage, onState = () => {}, token = null, role = "observer", name = "dashboard", keeps = true }) {
    this.url = url;
    this.onMessage = onMessage;
    this.onState = onState;
    this.token = token;
    this.role = role;
    this.name = name;
    this.keeps = keeps; // reconnects
    this.state = "connecting";
    this.receivedAt = null;
    this.pending = new Map();
    this.nextId = 1;
    this.waitMs = FIRST_WAIT_MS;
    this.listening = setInterval(() => this.#listen(), SILENT_MS / 3);
  }

  connect() {
    const socket = new WebSocket(this.url);
    this.socket = socket;
    socket.onopen = () => this.#hello();
    socket.onmessage = ({ data }) => typeof data === "string" && this.#receive(JSON.parse(data));
    socket.onclose = () => this.#lost();
  }

  // Resolves with the answer, {type: "unsent"} without a connection, or {type: "lost"} when no
  // answer arrived. `encode` encodes the message: a picture needs MessagePack.
  ask(fields, encode = JSON.stringify) {
    const id = this.nextId++;
    if (this.socket?.readyState !== WebSocket.OPEN) return Promise.resolve({ type: "unsent" });
    return new Promise((resolve) => {
      const timer = setTimeout(() => this.#answer({ id, type: "lost" }), ANSWER_MS);
      this.pending.set(id, { resolve, timer });
      this.socket.send(encode({ id, ...fields }));
    });
  }

  close() {
    this.keeps = false;
    this.socket?.close();
  }

  offer(token) {
    this.token = token;
    this.#become("connecting");
    this.connect();
  }

  async #hello() {
    const client = { name: this.name, version: "1" };
    const hello = { type: "hello", client, protocol: { major: 1, minor: 0 }, role: this.role };
    const answer = await this.ask(this.token ? { ...hello, token: this.token } : hello);
    if (answer.type === "welcome") this.#welcomed(answer);
    else if (answer.type === "error") this.#refused(answer);
    else this.socket.close();
  }

  #welcomed(welcome) {
    this.waitMs = FIRST_WAIT_MS;
    this.#become("open");
    this.onMessage(welcome);
  }

  #refused(error) {
    if (error.path !== "$.token") return this.onMessage({ ...error, id: 0 });
    const isFirst = !this.token;
    this.#become("token");
    if (isFirst) givenToken().then((token) => token && this.state === "token" && this.offer(token));
  }

  #receive(message) {
    this.receivedAt = performance.now();
    if (this.state === "silent") this.#become("open");
    if (message.id && this.pending.has(message.id)) this.#answer(message);
    else this.onMessage(message);
  }

  #answer(message) {
    const request = this.pending.get(message.id);
    if (!request) return;
    this.pending.delete(message.id);
    clearTimeout(request.timer);
    request.resolve(message);
  }

  #lost() {
    for (const id of [...this.pending.keys()]) this.#answer({ id, type: "lost" });
    if (this.state === "token") return;
    this.#become("gone");
    if (!this.keeps) return clearInterval(this.listening);
    setTimeout(() => this.connect(), this.waitMs * (0.75 + 0.5 * Math.random()));
    this.waitMs = Math.min(2 * this.waitMs, LONGEST_WAIT_MS);
  }

  #listen() {
    if (this.state === "open" && performance.now() - this.receivedAt > SILENT_MS) this.#become("silent");
  }

  #become(state) {
    if (this.state === state) return;
    this.state = state;
    this.onState(state);
  }
}

// Returns the token with which this browser got the page, or null: then the user has to type it.
async function givenToken() {
  try {
    const answer = await fetch("/token", { cache: "no-store" });
    return answer.ok ? await answer.text() : null;
  } catch {
    return null;
  }
}

// Returns the options of fetch for pages of the service, without opening the browser's password dialog.
export function authorised(token) {
  if (!token) return { cache: "no-store" };
  const bytes = new TextEncoder().encode(`:${token}`);
  const credentials = btoa(String.fromCharCode(...bytes));
  return { cache: "no-store", credentials: "omit", headers: { Authorization: `Basic ${credentials}` } };
}
