// Footprints of the wheels over time: from these come the ruts and the coloured trails. One is kept wherever a wheel has moved on or sunk deeper.
import { WHEEL, axleOf } from "./shape.js";

const MOST = 200_000;

export class Stamps {
  constructor(track, spacing) { // spacing(wheel) [m]
    this.track = track; this.shape = track.shape; this.all = []; this.done = 0; this.until = -Infinity;
    this.last = this.shape.wheels.map(() => null);
    this.spacing = this.shape.wheels.map(spacing);
  }

  extend() { // all frames of the track that are not yet read
    const { track } = this;
    let i = track.count ? track.indexAt(this.until) : 0;
    while (i < track.count && track.time[i] <= this.until) i++;
    for (; i < track.count; i++) this.#frame(i);
    if (track.count) this.until = Math.max(this.until, track.end);
  }

  rewind(t) { // forget what came at t or later
    while (this.all.length && this.all[this.all.length - 1].time >= t) this.all.pop();
    this.last.fill(null); this.until = Math.min(this.until, t - 1e-9);
  }

  upTo(t) { // number of stamps not after t
    let low = 0, high = this.all.length;
    while (low < high) { const middle = (low + high) >> 1; if (this.all[middle].time <= t) low = middle + 1; else high = middle; }
    return low;
  }

  #frame(i) {
    const { track, shape } = this, at = i * track.size, s = track.states;
    shape.wheels.forEach((wheel, w) => {
      const k = at + shape.wheel(w), x = s[k], y = s[k + 1], sinkage = s[k + WHEEL.sinkage], load = s[k + WHEEL.normal_load];
      const ground = s[k + WHEEL.ground_height], touches = (load > 0 || sinkage > 0) && Number.isFinite(x + y + ground);
      if (!touches) { this.last[w] = null; return; }
      const last = this.last[w];
      if (last && Math.hypot(x - last.x, y - last.y) < this.spacing[w] && !(sinkage > 1.1 * last.sinkage + 0.0005)) return;
      const axle = axleOf(shape, w, s, at);
      if (!Number.isFinite(axle[0])) return;
      const size = Math.hypot(axle[0], axle[1]) || 1; // forward: axle x up
      const stamp = {
        time: track.time[i], wheel: w, x, y, z: ground, forwardX: axle[1] / size, forwardY: -axle[0] / size,
        sinkage: Number.isFinite(sinkage) ? Math.max(0, sinkage) : 0, slip: s[k + WHEEL.slip_ratio], radius: wheel.radius, width: wheel.width, begins: !last,
      };
      this.last[w] = stamp;
      if (this.all.length < MOST) this.all.push(stamp);
    });
  }
}
