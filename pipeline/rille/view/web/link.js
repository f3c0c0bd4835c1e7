// The line to a live server: frames and texts come, commands go. It is laid again when it breaks.
import { Listeners } from "./util.js";
import { tokenOfPage } from "./source.js";

const MAGIC = 0x52494c4c, HEAD = 16;

export function framesOf(buffer, size) { // frames of so many numbers, one after the other
  const found = [], length = HEAD + 4 * size, head = new DataView(buffer);
  for (let at = 0; size >= 0 && at + length <= buffer.byteLength && head.getUint32(at, true) === MAGIC; at += length) {
    found.push({ time: head.getFloat64(at + 8, true), state: new Float32Array(buffer, at + HEAD, size), number: head.getUint32(at + 4, true) });
  }
  return found;
}

export class Link extends Listeners {
  constructor() {
    super();
    const random = crypto.getRandomValues(new Uint8Array(4));
    this.sender = `page-${[...random].map(byte => byte.toString(16).padStart(2, "0")).join("")}`;
    this.sequence = 0; this.waiting = new Map(); this.tries = 0; this.open = false; this.delays = [];
  }

  connect() {
    const url = new URL("api/stream", location.href);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:"; url.hash = "";
    const socket = new WebSocket(url);
    socket.binaryType = "arraybuffer"; this.socket = socket;
    socket.addEventListener("open", () => { socket.send(JSON.stringify({ kind: "hello", sender: this.sender, token: tokenOfPage() })); this.open = true; this.tries = 0; this.emit("open"); });
    socket.addEventListener("message", ({ data }) => { if (typeof data === "string") this.#text(data); else this.#frame(data); });
    socket.addEventListener("close", event => {
      this.open = false;
      for (const { done } of this.waiting.values()) done({ accepted: false, sentence: "the line to the server broke before it answered", lost: true });
      this.waiting.clear();
      this.emit("close", event.reason || (this.tries ? "" : "the line to the server broke"));
      if (event.code === 4401 || event.code === 4400) return; // refused: trying again would not help
      setTimeout(() => this.connect(), Math.min(8000, 500 * 2 ** this.tries++));
    });
  }

  #frame(buffer) {
    for (const { time, state, number } of framesOf(buffer, (buffer.byteLength - HEAD) / 4)) this.emit("frame", time, state, number);
  }

  #text(data) {
    let message;
    try { message = JSON.parse(data); } catch { return; }
    if (message.kind === "answer") {
      const waits = this.waiting.get(message.sequence);
      if (!waits) return;
      this.waiting.delete(message.sequence);
      this.delays.push(performance.now() - waits.sent);
      if (this.delays.length > 50) this.delays.shift();
      waits.done(message);
    } else this.emit(message.kind, message);
  }

  get delay() { const sorted = [...this.delays].sort((a, b) => a - b); return sorted.length ? sorted[sorted.length >> 1] : NaN; } // [ms] median of the answers

  command(kind, fields = {}) { // -> its answer
    if (!this.open) return Promise.resolve({ accepted: false, sentence: "there is no line to the server", lost: true });
    const sequence = ++this.sequence;
    this.socket.send(JSON.stringify({ sender: this.sender, sequence, time: null, kind, ...fields }));
    return new Promise(done => this.waiting.set(sequence, { done, sent: performance.now() }));
  }
}
