// The one time that every view shows. Live: it follows the newest state until someone looks back.
import { Listeners, clamp } from "./util.js";

export class Clock extends Listeners {
  constructor(start, end, live = false) {
    super();
    Object.assign(this, { start, end, time: start, speed: 1, playing: false, live, following: live });
  }
  seek(t) {
    if (this.live) this.#follow(false);
    this.#set(clamp(t, this.start, this.end));
  }
  play() {
    if (this.live) { this.#follow(true); this.#set(this.end); return; }
    if (this.time >= this.end - 1e-9) this.#set(this.start);
    this.playing = true; this.emit("state");
  }
  pause() { if (this.live) this.#follow(false); this.playing = false; this.emit("state"); }
  toggle() { if (this.live ? this.following : this.playing) this.pause(); else this.play(); }
  faster(factor) { this.speed = clamp(factor, 0.1, 20); this.emit("state"); }
  range(start, end) { // live: the buffer's ends moved
    this.start = start; this.end = end;
    if (this.following || this.time > end || this.time < start) this.#set(this.following ? end : clamp(this.time, start, end));
    this.emit("range");
  }
  advance(elapsed) {
    if (!this.playing || this.live) return;
    const t = this.time + elapsed * this.speed;
    this.#set(Math.min(t, this.end));
    if (t >= this.end) { this.playing = false; this.emit("state"); }
  }
  #follow(value) { if (this.following !== value) { this.following = value; this.emit("state"); } }
  #set(t) { if (t !== this.time) { this.time = t; this.emit("time", t); } }
}
