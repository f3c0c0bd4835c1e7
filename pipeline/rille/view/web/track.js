// States over time of one run; a live one grows, and goes back where the session does.
import { clamp } from "./util.js";

export class Track {
  constructor(shape, label, { time = new Float64Array(0), states = new Float32Array(0), events = [], extra = [] } = {}) {
    Object.assign(this, { shape, label, time, states, events, extra, size: shape.size, count: time.length, version: 0 });
    if (states.length !== time.length * this.size) {
      throw new Error(`run ${label}: ${states.length} numbers for ${time.length} times of ${this.size} each; the page and its data do not belong together`);
    }
  }
  get start() { return this.count ? this.time[0] : 0; }
  get end() { return this.count ? this.time[this.count - 1] : 0; }

  indexAt(t) { // last frame not after t
    let low = 0, high = this.count - 1;
    while (low < high) { const middle = (low + high + 1) >> 1; if (this.time[middle] <= t) low = middle; else high = middle - 1; }
    return Math.max(0, low);
  }

  sample(t, out) { // interpolated state; orientations by slerp
    if (!this.count) return out.fill(NaN);
    const i = this.indexAt(t), j = Math.min(i + 1, this.count - 1), a = i * this.size, b = j * this.size, s = this.states;
    const span = this.time[j] - this.time[i], u = span > 0 ? clamp((t - this.time[i]) / span, 0, 1) : 0;
    if (u === 0) { out.set(s.subarray(a, a + this.size)); return out; }
    for (let k = 0; k < this.size; k++) {
      const from = s[a + k], to = s[b + k];
      out[k] = Number.isNaN(to) ? from : from + (to - from) * u;
    }
    for (let k = 3; k < this.shape.firstJoint; k += 7) slerp(s, a + k, b + k, u, out, k);
    return out;
  }

  clear() { this.count = 0; this.version++; }
  push(time, state, room) { // live: "same" where nothing is new, "back" where the session went back or the rover was placed, else "on"
    let back = false;
    if (this.count && time <= this.end) {
      if (time === this.end && this.#same(state)) return "same";
      back = true;
      let keep = this.count;
      while (keep && this.time[keep - 1] >= time) keep--;
      this.count = keep;
    }
    if (this.count >= room) { // the oldest quarter goes
      const drop = room >> 2;
      this.time.copyWithin(0, drop, this.count); this.states.copyWithin(0, drop * this.size, this.count * this.size); this.count -= drop;
    }
    if (this.count >= this.time.length) this.#grow(Math.min(room, Math.max(512, 2 * this.time.length)));
    this.time[this.count] = time; this.states.set(state, this.count * this.size); this.count++; this.version++;
    return back ? "back" : "on";
  }
  #same(state) {
    const at = (this.count - 1) * this.size;
    for (let k = 0; k < this.size; k++) if (this.states[at + k] !== state[k] && !(Number.isNaN(state[k]) && Number.isNaN(this.states[at + k]))) return false;
    return true;
  }
  #grow(length) {
    const time = new Float64Array(length), states = new Float32Array(length * this.size);
    time.set(this.time.subarray(0, this.count)); states.set(this.states.subarray(0, this.count * this.size));
    this.time = time; this.states = states;
  }
}

function slerp(s, a, b, u, out, at) {
  let dot = 0, length = 0;
  for (let k = 0; k < 4; k++) dot += s[a + k] * s[b + k];
  if (Number.isNaN(dot)) { for (let k = 0; k < 4; k++) out[at + k] = s[a + k]; return; }
  const sign = dot < 0 ? -1 : 1, angle = Math.acos(Math.min(1, Math.abs(dot))), sine = Math.sin(angle);
  const p = sine > 1e-6 ? Math.sin((1 - u) * angle) / sine : 1 - u, q = sign * (sine > 1e-6 ? Math.sin(u * angle) / sine : u);
  for (let k = 0; k < 4; k++) { out[at + k] = p * s[a + k] + q * s[b + k]; length += out[at + k] ** 2; }
  length = Math.sqrt(length) || 1;
  for (let k = 0; k < 4; k++) out[at + k] /= length;
}
