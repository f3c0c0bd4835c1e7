// The panel beside the picture: tabs; the wheels' numbers at the time shown; the list of events.
import { byId, element, seconds, short, spoken } from "./util.js";
import { WHEEL, angles } from "./shape.js";
import { slipCss } from "./colours.js";
import { trimmed } from "./channels.js";

export class Tabs {
  constructor() { this.tabs = new Map(); this.bar = byId("tabs"); this.place = byId("panes"); this.now = null; this.opened = () => {}; }
  add(name, label) {
    const pane = element("section", { class: "pane", id: `pane-${name}`, role: "tabpanel", "aria-labelledby": `tab-${name}`, hidden: true });
    const tab = element("button", { type: "button", role: "tab", id: `tab-${name}`, "aria-controls": `pane-${name}`, "aria-selected": "false", tabindex: "-1", text: label, on: { click: () => this.open(name) } });
    tab.addEventListener("keydown", event => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      event.stopPropagation(); event.preventDefault();
      const names = [...this.tabs.keys()];
      this.open(names[(names.indexOf(name) + step + names.length) % names.length]); this.tabs.get(this.now).tab.focus();
    });
    this.tabs.set(name, { tab, pane }); this.bar.append(tab); this.place.append(pane);
    if (!this.now) this.open(name);
    return pane;
  }
  open(name) {
    this.now = name;
    for (const [own, { tab, pane }] of this.tabs) { const on = own === name; pane.hidden = !on; tab.setAttribute("aria-selected", String(on)); tab.tabIndex = on ? 0 : -1; }
    this.opened(name);
  }
}

const COLUMNS = [["slip_ratio", "slip", 1, ""], ["slip_angle", "angle", 180 / Math.PI, "°"], ["sinkage", "sinkage", 1000, "mm"], ["normal_load", "load", 1, "N"], ["drawbar_pull", "pull", 1, "N"], ["side_force", "side", 1, "N"], ["drive_torque", "torque", 1, "N m"]];

export class Numbers { // of every wheel, joint and of the rover, at the time shown
  constructor(place, worlds) {
    this.place = place;
    this.of = worlds.map(world => this.#tables(world, worlds.length > 1));
  }
  #tables(world, titled) {
    const { shape } = world, cell = () => element("td");
    const facts = ["speed", "roll", "pitch", "yaw", "x", "y", "z"].map(name => [name, element("dd")]);
    const names = trimmed(shape.wheels.map(wheel => wheel.name)), wheels = names.map(name => ({ chip: element("i", { class: "chip" }), cells: COLUMNS.map(cell), name }));
    const joints = shape.joints.map(joint => ({ name: joint.name, cells: [cell(), cell(), cell()] }));
    const head = texts => element("thead", {}, element("tr", {}, ...texts.map(([text, unit]) => element("th", { scope: "col" }, text, unit ? element("small", { text: unit }) : ""))));
    this.place.append(
      titled ? element("h2", { text: world.track.label }) : "",
      element("dl", { class: "facts" }, ...facts.map(([name, dd]) => element("div", {}, element("dt", { text: name }), dd))),
      wheels.length ? element("div", { class: "table" }, element("table", {}, head([["wheel"], ...COLUMNS.map(([, label, , unit]) => [label, unit])]),
        element("tbody", {}, ...wheels.map(({ name, chip, cells }) => element("tr", {}, element("th", { scope: "row" }, chip, spoken(name)), ...cells))))) : "",
      joints.length ? element("div", { class: "table" }, element("table", {}, head([["joint"], ["position", "rad, m"], ["velocity", "/s"], ["effort", "N m, N"]]),
        element("tbody", {}, ...joints.map(({ name, cells }) => element("tr", {}, element("th", { scope: "row", text: spoken(name) }), ...cells))))) : "",
    );
    return { world, facts, wheels, joints };
  }
  show() {
    if (!this.place.offsetParent) return;
    for (const { world, facts, wheels, joints } of this.of) {
      const { shape, state, track } = world, root = shape.body(shape.root), [roll, pitch, yaw] = angles(state, root + 3);
      const degrees = value => Number.isFinite(value) ? `${(value * 180 / Math.PI).toFixed(1)}°` : "–";
      const texts = [`${short(speedOf(track, world.time), 3)} m/s`, degrees(roll), degrees(pitch), degrees(yaw),
        ...[0, 1, 2].map(k => Number.isFinite(state[root + k]) ? `${(state[root + k] + shape.origin[k]).toFixed(2)} m` : "–")];
      facts.forEach(([, dd], k) => { dd.textContent = texts[k]; });
      wheels.forEach(({ chip, cells }, w) => {
        const k = shape.wheel(w);
        chip.style.background = slipCss(state[k + WHEEL.slip_ratio]);
        COLUMNS.forEach(([field, , factor], c) => { cells[c].textContent = short(state[k + WHEEL[field]] * factor, 3); });
      });
      joints.forEach(({ cells }, j) => { for (let c = 0; c < 3; c++) cells[c].textContent = short(state[shape.joint(j) + c], 3); });
    }
  }
}

function speedOf(track, t) {
  if (track.count < 2) return NaN;
  const i = track.indexAt(t), a = Math.max(0, i - 2), b = Math.min(track.count - 1, i + 2), at = track.shape.body(track.shape.root), s = track.states, span = track.time[b] - track.time[a];
  const p = a * track.size + at, q = b * track.size + at;
  return span > 0 ? Math.hypot(s[q] - s[p], s[q + 1] - s[p + 1], s[q + 2] - s[p + 2]) / span : NaN;
}

export class Events {
  constructor(place, tracks, clock) { Object.assign(this, { place, tracks, clock, told: [] }); this.list = element("ol", { class: "events" }); place.append(this.list); }
  show() {
    const lists = this.tracks.map(track => track.events);
    if (lists.every((list, run) => list === this.told[run]) || !this.place.offsetParent) return;
    this.told = lists;
    const all = this.tracks.flatMap((track, run) => track.events.map(event => ({ ...event, run }))).sort((a, b) => this.clock.live ? b.time - a.time : a.time - b.time).slice(0, 2000);
    this.list.replaceChildren(...all.map(event => element("li", {}, element("button", { type: "button", class: "row", on: { click: () => this.clock.seek(event.time) } },
      element("time", { text: `${seconds(event.time)} s` }), element("b", { text: spoken(event.kind) }),
      element("span", { text: [this.tracks.length > 1 ? this.tracks[event.run].label : "", event.subject, event.message].filter(Boolean).join(" · ") })))));
    if (!all.length) this.list.append(element("li", { class: "hint", text: "No events." }));
  }
}
