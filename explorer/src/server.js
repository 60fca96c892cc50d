import { frame } from "./arrays.js";

/**
 * The Python process behind the page. Each kind of call has one request in flight per key; of the states that come meanwhile
 * the newest is sent when the answer is there, and the others are given up.
 */
export class Server {
  constructor(url, lost) {
    this.lost = lost;
    this.next = 1;
    this.waiting = new Map(); // id -> {resolve, reject}
    this.busy = new Map(); // lane -> newest waiting call or null
    this.url = url;
    this.opened = this.open();
  }

  open() {
    this.socket = new WebSocket(this.url);
    this.socket.binaryType = "arraybuffer";
    this.socket.addEventListener("message", ({ data }) => this.answered(frame(data)));
    return new Promise((resolve, reject) => {
      this.socket.addEventListener("open", resolve);
      this.socket.addEventListener("close", () => {
        const error = new Error("The connection to gonio is closed: is `gonio view` still running? Views that need no Python go on.");
        for (const { reject: fail } of this.waiting.values()) fail(error);
        this.waiting.clear();
        this.busy.clear();
        reject(error);
        this.lost(error);
      });
    });
  }

  answered(header) {
    const waiting = this.waiting.get(header.id);
    this.waiting.delete(header.id);
    if (!waiting) return;
    if (header.ok) waiting.resolve(header.result);
    else waiting.reject(new Error(header.error));
  }

  async send(call, fields) {
    if (this.socket.readyState > WebSocket.OPEN) this.opened = this.open();
    if (this.socket.readyState < WebSocket.OPEN) await this.opened;
    const id = this.next++;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.socket.send(JSON.stringify({ id, call, ...fields }));
    });
  }

  /** The answer to a call; null if a newer call of the same lane took its place. */
  call(name, fields = {}, lane = name) {
    if (this.busy.has(lane)) {
      this.busy.get(lane)?.resolve(null);
      return new Promise((resolve, reject) => this.busy.set(lane, { name, fields, resolve, reject }));
    }
    this.busy.set(lane, null);
    return this.send(name, fields).finally(() => {
      const newer = this.busy.get(lane);
      this.busy.delete(lane);
      if (newer) this.call(newer.name, newer.fields, lane).then(newer.resolve, newer.reject);
    });
  }

  async upload(file) {
    const answer = await fetch(`upload?name=${encodeURIComponent(file.name)}`, { method: "POST", body: file });
    const { text, error } = await answer.json();
    if (error) throw new Error(error);
    return text;
  }
}

/** A page by itself: what it holds is in the page, the rest needs Python. */
export class Offline {
  constructor(held) {
    this.held = held;
  }

  async call(name, { text } = {}) {
    const at = this.held.materials.findIndex((one) => one.text === text);
    if (name === "material" && at >= 0) return this.held.materials[at];
    if (name === "albedo" && this.held.albedo?.[at]) return this.held.albedo[at];
    if (name === "check" && this.held.checks?.[at]) return this.held.checks[at];
    if (name === "names") return { given: this.held.materials.map(({ text }) => ({ text, title: text })), materials: [], models: [], version: this.held.version ?? "" };
    throw new Error(`This page stands alone. "${name}" needs Python: run gonio view.`);
  }

  async upload() {
    throw new Error("This page stands alone. Reading a file needs Python: run gonio view.");
  }
}
