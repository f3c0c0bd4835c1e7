// The wheels' trails in the colour of their slip, and the path of the root body: bright where it has been, faint where it will go.
import { THREE } from "./three.js";
import { slipColour } from "./colours.js";
import { WHEEL } from "./shape.js";
import { Ribbon } from "./ribbon.js";

export class Trails {
  constructor(group, stamps) {
    this.stamps = stamps; this.read = 0;
    this.of = stamps.shape.wheels.map(() => ({ ribbon: new Ribbon(group, { opacity: 0.5 }), times: [] }));
    this.colour = new THREE.Color();
  }
  extend() {
    const { all } = this.stamps;
    for (; this.read < all.length; this.read++) {
      const s = all[this.read], { ribbon, times } = this.of[s.wheel], half = 0.3 * s.width, z = s.z - s.sinkage + 0.006;
      const rgb = slipColour(s.slip);
      this.colour.setRGB(...rgb, THREE.SRGBColorSpace);
      ribbon.push([s.x - s.forwardY * half, s.y + s.forwardX * half, z], [s.x + s.forwardY * half, s.y - s.forwardX * half, z], this.colour.toArray(), s.begins);
      times.push(s.time);
    }
  }
  rewind(t) {
    this.read = this.stamps.all.length;
    for (const each of this.of) { const keep = countTo(each.times, t - 1e-12); each.times.length = keep; each.ribbon.cut(keep); }
  }
  show(t, visible) { for (const { ribbon, times } of this.of) { ribbon.visible = visible; if (visible) ribbon.show(0, countTo(times, t)); } }
}

export class Path {
  constructor(group, track, colour, height) { // height(x, y, z): where the band lies
    const make = opacity => new Ribbon(group, { opacity, colour, order: 2 });
    this.track = track; this.height = height; this.past = make(0.8); this.future = make(0.25); this.times = []; this.points = []; this.until = -Infinity;
    this.half = 0.5 * (track.shape.wheels[0]?.width ?? 0.1) * 0.16;
  }
  extend() {
    const { track } = this, { shape } = track, at = shape.body(shape.root), step = 6 * this.half;
    let i = track.count ? track.indexAt(this.until) : 0;
    while (i < track.count && track.time[i] <= this.until) i++;
    for (; i < track.count; i++) {
      const k = i * track.size + at, x = track.states[k], y = track.states[k + 1], last = this.points[this.points.length - 1];
      this.until = track.time[i];
      if (!Number.isFinite(x + y)) continue;
      const dx = last ? x - last[0] : 0, dy = last ? y - last[1] : 0, way = Math.hypot(dx, dy);
      if (last && way < step) continue;
      const z = this.height(x, y, i), fx = way ? dx / way : 1, fy = way ? dy / way : 0;
      const left = [x - fy * this.half, y + fx * this.half, z], right = [x + fy * this.half, y - fx * this.half, z];
      for (const band of [this.past, this.future]) band.push(left, right, [1, 1, 1], !last);
      this.points.push([x, y]); this.times.push(track.time[i]);
    }
  }
  rewind(t) {
    const keep = countTo(this.times, t - 1e-12);
    this.times.length = keep; this.points.length = keep; this.past.cut(keep); this.future.cut(keep); this.until = Math.min(this.until, t - 1e-9);
  }
  show(t, visible) {
    this.past.visible = visible; this.future.visible = visible;
    if (!visible) return;
    const now = countTo(this.times, t);
    this.past.show(0, now); this.future.show(Math.max(0, now - 1), this.times.length);
  }
}

export function groundUnder(track) { // mean height of the ground under the wheels in a frame, else the root body's own
  const { shape } = track;
  return i => {
    let sum = 0, n = 0;
    shape.wheels.forEach((_, w) => { const z = track.states[i * track.size + shape.wheel(w) + WHEEL.ground_height]; if (Number.isFinite(z)) { sum += z; n++; } });
    return n ? sum / n : track.states[i * track.size + shape.body(shape.root) + 2];
  };
}

function countTo(times, t) {
  let low = 0, high = times.length;
  while (low < high) { const middle = (low + high) >> 1; if (times[middle] <= t) low = middle + 1; else high = middle; }
  return low;
}
