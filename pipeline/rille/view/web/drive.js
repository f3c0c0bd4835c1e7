// Steering by keys, stick, gamepad and sliders. A dead man's switch: what is no longer held, stops.
import { byId, clamp, element, short, spoken, typing } from "./util.js";

const STEER_EVERY = 80; // [ms] between steering commands
const LASTS = 1; // [s] that the server lets the rover drive on after the last of them: a page that hangs must not
const HELD = { ArrowUp: [1, 0], w: [1, 0], ArrowDown: [-1, 0], s: [-1, 0], ArrowLeft: [0, 1], a: [0, 1], ArrowRight: [0, -1], d: [0, -1] };

export class Drive {
  constructor(place, layout, live) {
    Object.assign(this, { live, held: new Set(), sliders: [], stick: null, sent: [0, 0], last: 0, fastest: fastestOf(layout) });
    const wide = widthOf(layout);
    this.mostTurn = Math.min(1.5, this.fastest / wide);
    this.#build(place, layout);
    addEventListener("keydown", event => {
      const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
      if (!HELD[key] || typing(event) || event.ctrlKey || event.metaKey || event.altKey || byId("help").open) return;
      if (event.target instanceof HTMLElement && event.target.matches("input[type=range]") && key.startsWith("Arrow")) return; // that slider's own keys
      event.preventDefault();
      if (event.repeat) return;
      this.held.add(key); this.#now();
    });
    addEventListener("keyup", event => { const key = event.key.length === 1 ? event.key.toLowerCase() : event.key; if (this.held.delete(key)) this.#now(); });
    const drop = () => { this.held.clear(); this.stick = null; this.#now(); };
    addEventListener("blur", drop);
    document.addEventListener("visibilitychange", () => { if (document.hidden) drop(); });
    setInterval(() => this.#now(), STEER_EVERY);
  }

  #build(place, layout) {
    this.power = element("input", { type: "range", min: "5", max: "100", value: "60", "aria-label": "largest speed, share of what the drives can" });
    this.powerText = element("output");
    const tell = () => { this.powerText.textContent = `${short(this.fastest * this.power.value / 100, 2)} m/s`; };
    this.power.addEventListener("input", tell); tell();
    this.knob = element("i"); this.pad = element("div", { class: "stick", role: "application", "aria-label": "stick: drag to drive, let go to stop; arrow keys or W A S D do the same" }, this.knob);
    const at = event => {
      const box = this.pad.getBoundingClientRect();
      this.stick = [clamp(1 - 2 * (event.clientY - box.top) / box.height, -1, 1), clamp(1 - 2 * (event.clientX - box.left) / box.width, -1, 1)];
      this.#now();
    };
    this.pad.addEventListener("pointerdown", event => { this.pad.setPointerCapture(event.pointerId); at(event); });
    this.pad.addEventListener("pointermove", event => { if (this.pad.hasPointerCapture(event.pointerId)) at(event); });
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) this.pad.addEventListener(name, () => { if (this.stick) { this.stick = null; this.#now(); } });
    this.told = element("output", { class: "told" });
    this.gamepad = element("p", { class: "hint", text: "A gamepad joins when one of its buttons is pressed." });
    this.fields = element("fieldset", {},
      element("div", { class: "steer" }, this.pad, element("div", {},
        element("p", {}, element("kbd", { text: "W" }), element("kbd", { text: "A" }), element("kbd", { text: "S" }), element("kbd", { text: "D" }), " or arrow keys drive while held; let go to stop."),
        element("label", { class: "row" }, element("span", { text: "top speed" }), this.power, this.powerText), this.told)),
      this.gamepad,
      element("h2", { text: "Drives" }),
      ...layout.drives?.length ? layout.drives.map(drive => this.#slider(drive, layout.joints.some(joint => joint.name === drive.joint && joint.kind === "prismatic"))) : [element("p", { class: "hint", text: "This machine has no drives." })]);
    this.hint = element("p", { class: "hint take" });
    place.append(this.hint, this.fields);
  }

  #slider(drive, slides) { // slides: its joint does not turn
    const [low, high] = rangeOf(drive, slides), unit = (slides ? { speed: "m/s", torque: "N", position: "m" } : { speed: "rad/s", torque: "N m", position: "rad" })[drive.mode] ?? "";
    const input = element("input", { type: "range", min: low, max: high, step: (high - low) / 200, value: "0", "aria-label": `${drive.name}: ${drive.mode} [${unit}]` });
    const output = element("output", { text: "–" });
    let waiting = null;
    const send = () => { waiting = null; this.live.ask("drive", { drive: drive.name, value: Number(input.value) }); };
    input.addEventListener("input", () => { output.textContent = `${short(Number(input.value), 2)} ${unit}`; waiting ??= setTimeout(send, STEER_EVERY); });
    const zero = element("button", { type: "button", class: "quiet", title: "to zero", "aria-label": `${drive.name} to zero`, text: "0", on: { click: () => { input.value = "0"; input.dispatchEvent(new Event("input")); } } });
    this.sliders.push({ touched: () => waiting !== null || document.activeElement === input && input.matches(":active"), show: value => { input.value = String(value); output.textContent = `${short(value, 2)} ${unit}`; } });
    return element("label", { class: "row" }, element("span", { text: spoken(drive.name), title: drive.mode }), input, output, zero);
  }

  show(values) { // what the drives are set to, whoever set them
    this.sliders.forEach((slider, k) => { if (k < values.length && !slider.touched()) slider.show(values[k]); });
  }

  allow(yes, why) { this.fields.disabled = !yes; this.hint.textContent = why; this.hint.hidden = !why; }

  wanted() { // [forward, turn to the left], each -1..1
    if (this.stick) return this.stick;
    let forward = 0, turn = 0;
    for (const key of this.held) { forward += HELD[key][0]; turn += HELD[key][1]; }
    if (!forward && !turn) for (const pad of navigator.getGamepads?.() ?? []) {
      if (!pad?.connected) continue;
      this.gamepad.textContent = `Gamepad: ${pad.id}`;
      const dead = v => Math.abs(v) < 0.15 ? 0 : v;
      const right = pad.mapping === "standard" ? pad.axes[2] : 0; // elsewhere it may be a trigger, which rests at -1
      forward = -dead(pad.axes[1] ?? 0); turn = -dead(right ?? 0) || -dead(pad.axes[0] ?? 0);
      if (forward || turn) break;
    }
    return [clamp(forward, -1, 1), clamp(turn, -1, 1)];
  }

  #now() { // tell the server what is wanted, where that has changed; again and again while something is held
    const [f, t] = this.wanted(), share = this.power.value / 100, now = performance.now();
    const aim = [Number((f * share * this.fastest).toFixed(4)), Number((t * share * this.mostTurn).toFixed(4))];
    const far = 42 / Math.max(1, Math.hypot(f, t)); // the knob stays in its circle
    this.knob.style.transform = `translate(${(-far * t).toFixed(1)}px, ${(-far * f).toFixed(1)}px)`;
    const same = aim[0] === this.sent[0] && aim[1] === this.sent[1], still = !aim[0] && !aim[1];
    if (same && (still || now - this.last < 4 * STEER_EVERY)) return;
    if (!still && now - this.last < STEER_EVERY - 5 && !same && (this.sent[0] || this.sent[1])) return; // the rate is limited; stopping is not
    this.sent = aim; this.last = now;
    this.told.textContent = still ? "" : `${short(aim[0], 2)} m/s · ${short(aim[1], 2)} rad/s`;
    this.live.ask("steer", { forward: aim[0], turn: aim[1], lasts: LASTS });
  }
}

function fastestOf(layout) { // [m/s] that the slowest driven wheel can
  let least = Infinity;
  for (const wheel of layout.wheels ?? []) for (const drive of layout.drives ?? []) if (drive.joint === wheel.joint && drive.mode === "speed" && drive.max_speed) least = Math.min(least, drive.max_speed * wheel.radius);
  return Number.isFinite(least) ? least : 0.2;
}
function widthOf(layout) { return Math.max(0.3, 6 * Math.max(0.05, ...(layout.wheels ?? []).map(wheel => wheel.radius))); }
function rangeOf({ mode, lower, upper, max_torque, max_speed }, slides) { // of a drive's set value; where the model gives no bound: half a turn or a metre, 10 rad/s or 1 m/s
  const far = slides ? 1 : Math.PI, most = mode === "torque" ? max_torque : max_speed ?? (slides ? 1 : 10);
  if (mode !== "position") return [-most, most];
  return [lower ?? Math.min(-far, (upper ?? 0) - far), upper ?? Math.max(far, (lower ?? 0) + far)];
}
