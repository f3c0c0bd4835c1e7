// The bar of time: play, speed, scrubbing, steps of one frame, events as marks.
import { byId, clamp, element, niceStep, seconds, spoken, toggle } from "./util.js";

const SPEEDS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20];
const GRAVE = /spinning|tip|over|stuck|left|diverg|buried|limit|error|contact_lost/;

export class Timeline {
  constructor(tracks, clock) {
    Object.assign(this, { tracks, clock, marks: element("div", { class: "marks" }), counted: -1 });
    this.bar = byId("bar"); this.fill = byId("bar-fill"); this.knob = byId("bar-knob"); this.clockText = byId("clock"); this.playButton = byId("play");
    this.bar.append(this.marks);
    this.tip = byId("bar-tip");
    this.playButton.addEventListener("click", () => clock.toggle());
    byId("back").addEventListener("click", () => this.step(-1));
    byId("next").addEventListener("click", () => this.step(1));
    const speed = byId("speed");
    speed.replaceChildren(...SPEEDS.map(s => element("option", { value: s, text: `${s}×` })));
    speed.value = "1";
    if (!clock.live) speed.addEventListener("change", () => clock.faster(Number(speed.value)));
    this.speed = speed;
    clock.on("state", () => this.state()).on("range", () => this.ends());
    this.#listen(); this.ends(); this.state();
  }

  step(frames) {
    const track = this.tracks[0], { clock } = this;
    if (!track.count) return;
    clock.pause();
    const i = track.indexAt(clock.time), inside = clock.time > track.time[i] + 1e-12;
    clock.seek(track.time[clamp(i + (frames < 0 && inside ? frames + 1 : frames), 0, track.count - 1)]);
  }
  quicker(steps) {
    const away = s => Math.abs(Math.log(s / Number(this.speed.value))), near = SPEEDS.reduce((best, s, k) => away(s) < away(SPEEDS[best]) ? k : best, 0);
    const next = SPEEDS[clamp(near + steps, 0, SPEEDS.length - 1)];
    this.speed.value = String(next); this.speed.dispatchEvent(new Event("change"));
  }

  #listen() {
    const { bar, clock } = this;
    const timeAt = event => { const box = bar.getBoundingClientRect(); return clock.start + (clock.end - clock.start) * clamp((event.clientX - box.left) / box.width, 0, 1); };
    bar.addEventListener("pointerdown", event => { if (event.button === 0) { bar.setPointerCapture(event.pointerId); clock.seek(timeAt(event)); bar.focus({ preventScroll: true }); } });
    bar.addEventListener("pointermove", event => {
      const t = timeAt(event);
      if (bar.hasPointerCapture(event.pointerId)) clock.seek(t);
      this.#hover(t, event.clientX);
    });
    bar.addEventListener("pointerleave", () => { this.tip.hidden = true; });
    bar.addEventListener("keydown", event => {
      const far = (clock.end - clock.start) / 20, move = { PageUp: far, PageDown: -far }[event.key];
      if (move) { event.preventDefault(); clock.seek(clock.time + move); }
    });
  }

  #hover(t, clientX) { // time under the pointer, and the event where there is one
    const box = this.bar.getBoundingClientRect(), reach = 6 / box.width * (this.clock.end - this.clock.start);
    const near = this.tracks.flatMap((track, run) => track.events.filter(event => Math.abs(event.time - t) <= reach).map(event => [event, run])).slice(0, 4);
    this.tip.replaceChildren(element("b", { text: `${seconds(near[0]?.[0].time ?? t)} s` }), ...near.map(([event, run]) => element("div", {
      text: `${this.tracks.length > 1 ? `${this.tracks[run].label}: ` : ""}${told(event)}` })));
    this.tip.hidden = false;
    this.tip.style.left = `${clamp(clientX, 120, innerWidth - 130)}px`;
  }

  ends() { // start, end or events have changed
    const { clock } = this, span = clock.end - clock.start || 1, events = this.tracks.reduce((sum, track) => sum + track.events.length, 0);
    const key = clock.live ? `${events} ${Math.floor(clock.end)} ${Math.floor(clock.start)}` : `${events} ${clock.start} ${clock.end}`;
    this.bar.setAttribute("aria-valuemin", clock.start.toFixed(2)); this.bar.setAttribute("aria-valuemax", clock.end.toFixed(2));
    if (key === this.counted) return;
    this.counted = key;
    const marks = [], dt = niceStep(span, 8);
    for (let t = Math.ceil(clock.start / dt) * dt; t <= clock.end + 1e-9; t += dt) {
      const mark = element("span", { class: "tick" });
      mark.style.left = `${100 * (t - clock.start) / span}%`; marks.push(mark);
    }
    this.tracks.forEach((track, run) => track.events.forEach(event => {
      if (event.time < clock.start - 1e-9 || event.time > clock.end + 1e-9) return;
      const mark = element("span", { class: `event${GRAVE.test(event.kind) ? " grave" : ""}${run ? " second" : ""}` });
      mark.style.left = `${100 * (event.time - clock.start) / span}%`; marks.push(mark);
    }));
    this.marks.replaceChildren(...marks);
  }

  state() {
    const { clock } = this, on = clock.live ? clock.following : clock.playing;
    this.playButton.classList.toggle("on", on); toggle(this.playButton, on);
    this.playButton.title = clock.live ? "follow the newest state" : on ? "pause (space)" : "play (space)";
    this.playButton.setAttribute("aria-label", clock.live ? "follow the newest state" : on ? "pause" : "play");
  }
  show() {
    const { clock } = this, part = 100 * (clock.time - clock.start) / (clock.end - clock.start || 1);
    this.fill.style.width = this.knob.style.left = `${part}%`;
    this.clockText.textContent = `${seconds(clock.time)} / ${seconds(clock.end)} s`;
    this.bar.setAttribute("aria-valuenow", clock.time.toFixed(2)); this.bar.setAttribute("aria-valuetext", `${clock.time.toFixed(2)} seconds`);
  }
}

export const told = event => `${spoken(event.kind)}${event.subject ? ` · ${event.subject}` : ""}${event.message ? `: ${event.message}` : ""}`;
