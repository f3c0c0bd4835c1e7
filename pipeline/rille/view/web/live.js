// A live session: its status, who commands, and the buttons of the run.
import { asked } from "./source.js";
import { Drive } from "./drive.js";
import { Link, framesOf } from "./link.js";
import { Objects } from "./objects.js";
import { Placing } from "./place.js";
import { Clock } from "./clock.js";
import { Shape } from "./shape.js";
import { Track } from "./track.js";
import { Viewer, parsedScene } from "./viewer.js";
import { banner, toast } from "./toast.js";
import { byId, element, seconds, short, spoken } from "./util.js";

const MOST_BYTES = 96e6, MOST_FRAMES = 36_000, MOST_EVENTS = 5000;
const GONE = "The live server does not answer. Is `rille serve` running? Trying again.";

export async function startLive() {
  for (let wait = 500; ; wait = Math.min(8000, 2 * wait)) {
    try {
      if (location.protocol === "file:") throw Object.assign(new Error("A live page is opened from its server: run `rille serve MODEL.db` and open the address that it prints."), { final: true });
      const layout = await asked("api/layout"), scene = await parsedScene(await asked("scene.glb", "bytes"));
      const history = await asked("api/history", "bytes").catch(() => new ArrayBuffer(0));
      banner("");
      return new Live(layout, scene, history);
    } catch (error) {
      banner(error.final ? error.message : error instanceof TypeError ? GONE : `${GONE} (${error.message})`, "bad");
      if (error.final) throw error;
      await new Promise(done => setTimeout(done, wait));
    }
  }
}

export class Live {
  constructor(layout, scene, history) { // history: the run so far, frames as they come over the line
    this.shape = new Shape(layout); this.track = new Track(this.shape, "live"); this.clock = new Clock(0, 0, true); this.status = { state: "ready", time: 0, speed: 1, commander: null, saves: [] };
    this.room = Math.max(600, Math.min(MOST_FRAMES, Math.floor(MOST_BYTES / (4 * this.shape.size + 8))));
    for (const { time, state } of framesOf(history, this.shape.size)) this.track.push(time, state, this.room);
    this.clock.range(this.track.start, this.track.end);
    this.rate = 0; this.frames = 0; this.real = null; this.anew = false; this.heard = []; this.speedsAsked = 0; // anew: the next frame is another run's; heard: events since the newest frame or status; speedsAsked: not answered yet
    this.viewer = new Viewer(this.shape, scene, [this.track], this.clock, "single");
    const { tabs, keys } = this.viewer;
    this.link = new Link();
    this.drive = new Drive(tabs.add("drive", "Drive"), layout, this);
    this.objects = new Objects(tabs.add("objects", "Objects"), this);
    this.placing = new Placing(this.viewer, this);
    keys.on([" "], "start, pause the simulation", () => this.go());
    keys.tell(["W", "A", "S", "D", "ArrowUp", "ArrowLeft", "ArrowDown", "ArrowRight"], "drive while held");
    keys.tell(["drag"], "the rover, before the first step: places it; with shift: turns it");
    this.#buttons(); tabs.open("drive");
    this.link.on("frame", (time, state) => this.#frame(time, state)).on("status", status => this.#status(status)).on("event", event => this.#event(event))
      .on("open", () => banner("")).on("close", why => { banner(why ? `${GONE} (${why})` : GONE, "bad"); this.status = { ...this.status, commander: null }; this.#show(); });
    this.#show();
    this.link.connect();
    this.first = new Promise(done => { this.arrived = done; });
  }

  get mine() { return this.status.commander === this.link.sender; }
  get placeable() { return this.clock.following && (this.status.state === "ready" || (this.status.state === "paused" && this.status.time === 0)); }
  say(text, tone) { toast(text, tone); }

  async ask(kind, fields) { // a command; a refusal is told
    if ((kind === "steer" || kind === "drive") && !this.mine) {
      if (fields.forward || fields.turn || fields.value) toast("Take the command first; then the rover obeys you.", "bad");
      return { accepted: false };
    }
    const answer = await this.link.command(kind, fields);
    if (!answer.accepted && answer.sentence && !(answer.lost && kind === "steer")) toast(answer.sentence, "bad");
    return answer;
  }
  go() { this.ask(this.status.state === "running" ? "pause" : "start"); }

  #frame(time, state) {
    if (state.length !== this.shape.size) { banner("The server now shows another model; load this page again.", "bad"); return; }
    if (this.anew) this.track.clear();
    const pushed = this.track.push(time, state, this.room), how = this.anew ? "back" : pushed;
    this.anew = false; this.heard = []; this.frames++;
    if (how === "same" && !this.arrived) return; // of a run that waits the history has shown it all; the page is ready all the same
    if (how === "back") this.track.events = this.track.events.filter(event => event.time <= time);
    this.viewer.grown(how === "back");
    this.clock.range(this.track.start, this.track.end);
    if (this.clock.following) this.viewer.refresh();
    if (this.arrived) { this.arrived(); this.arrived = null; this.viewer.refresh(); requestAnimationFrame(() => this.viewer.look("follow")); }
  }

  #event({ time, event, subject, message }) {
    const told = { time, kind: event, subject, message };
    this.track.events = [...this.track.events.slice(-MOST_EVENTS), told]; this.heard.push(told);
    this.viewer.timeline.ends();
    toast(`${seconds(time)} s · ${message || `${spoken(event)} ${subject}`}`, "event");
  }

  #status(status) {
    const was = this.status, now = performance.now();
    if (status.state === "running" && this.real && status.time > this.real[1]) {
      const span = (now - this.real[0]) / 1000;
      if (span > 0.8) { this.rate = (status.time - this.real[1]) / span; this.hertz = (this.frames - this.real[2]) / span; this.real = [now, status.time, this.frames]; }
    } else { this.real = [now, status.time, this.frames]; if (status.state !== "running") this.rate = 0; }
    if (was.run_id !== undefined && status.run_id !== was.run_id) { this.anew = true; this.track.events = this.heard; } // a run's first events come before its status
    this.status = status; this.heard = [];
    if (status.asked_by && status.asked_by !== was.asked_by && this.mine) toast(`${status.asked_by} asks for the command.`, "event");
    if (status.state === "ended" && was.state !== "ended" && status.outcome) toast(`The run has ended: ${spoken(status.outcome)}${status.message ? `. ${status.message}` : ""}`, "event");
    if (was.commander !== status.commander && this.mine) toast("You have the command.", "good");
    this.#show();
  }

  #buttons() {
    const button = (text, title, act, name) => element("button", { type: "button", title, text, id: `do-${name}`, on: { click: act } });
    this.goButton = button("Start", "let time pass, or hold it (space)", () => this.go(), "go");
    this.goButton.classList.add("main");
    this.saveName = element("input", { type: "text", size: "9", maxlength: "64", placeholder: "name", "aria-label": "name of the saved state" });
    this.saves = element("select", { "aria-label": "saved states" });
    const save = element("form", { class: "save", on: { submit: event => { event.preventDefault(); this.#save(); } } }, this.saveName, element("button", { type: "submit", text: "Save" }));
    this.controls = [
      button("Step", "take ten time steps", () => this.ask("step", { count: 10 }), "step"),
      button("Reset", "end this run; begin another at the start", () => this.ask("reset"), "reset"), button("Stop", "end this run; it can be replayed", () => this.ask("stop"), "stop"),
    ];
    this.loadButton = button("Load", "go on from the saved state", () => { if (this.saves.value) this.ask("load", { name: this.saves.value }); }, "load");
    byId("run").append(this.goButton, ...this.controls, save, this.saves, this.loadButton);
    byId("run").hidden = false;
    const { speed } = this.viewer.timeline;
    speed.title = "simulated time per real time";
    speed.addEventListener("change", () => this.#run(Number(speed.value)));
    this.state = element("span", { class: "state", id: "state" }); this.who = element("span", { class: "who", id: "who" }); this.facts = element("span", { class: "facts", id: "live-facts" });
    this.take = element("button", { type: "button", id: "take", on: { click: () => this.ask(this.mine ? "release" : "take") } });
    this.hand = element("button", { type: "button", id: "hand-over", class: "main", hidden: true, on: { click: () => this.ask("hand_over", { to: this.status.asked_by }) } });
    byId("live").append(this.state, this.facts, this.who, this.take, this.hand); byId("live").hidden = false;
    byId("play").textContent = "Live"; byId("play").className = "live-button"; this.viewer.timeline.state();
  }
  #save() { const name = this.saveName.value.trim(); if (name) this.ask("save", { name }).then(answer => { if (answer.accepted) { this.saveName.value = ""; toast(`Saved as ${name}.`, "good"); } }); }

  #show() {
    const { status, mine, link } = this, open = link.open;
    this.state.textContent = open ? status.state : "no server"; this.state.dataset.state = open ? status.state : "gone";
    const parts = [`${seconds(status.time)} s`];
    if (status.state === "running" && this.rate) parts.push(`${short(this.rate, 2)}× real time`);
    if (status.viewers) parts.push(`${status.viewers} ${status.viewers === 1 ? "viewer" : "viewers"}`);
    if (Number.isFinite(link.delay)) parts.push(`${short(link.delay, 2)} ms`);
    this.facts.textContent = parts.join(" · "); this.facts.title = `scenario ${status.scenario ?? ""}, run ${status.run_id ?? ""}; ${short(this.hertz ?? NaN, 2)} frames/s`;
    this.who.textContent = mine ? "you command" : status.commander ? `${status.commander} commands` : "nobody commands"; this.who.classList.toggle("mine", mine);
    this.take.textContent = mine ? "Release" : status.commander ? "Ask for the command" : "Take the command"; this.take.classList.toggle("main", !mine && !status.commander); this.take.disabled = !open;
    this.hand.hidden = !(mine && status.asked_by); this.hand.textContent = `Hand over to ${status.asked_by ?? ""}`;
    this.goButton.textContent = status.state === "running" ? "Pause" : "Start";
    for (const each of [this.goButton, ...this.controls, this.loadButton, this.saveName]) each.disabled = !mine;
    this.viewer.timeline.speed.disabled = !mine;
    if (document.activeElement !== this.viewer.timeline.speed && !this.speedsAsked) this.#speed(status.speed);
    const names = status.saves ?? [], key = names.join("\n");
    if (key !== this.savesKey) { this.savesKey = key; this.saves.replaceChildren(...names.map(name => element("option", { value: name, text: name }))); }
    this.saves.hidden = this.loadButton.hidden = !names.length;
    this.drive.show(status.set_values ?? []);
    this.drive.allow(mine, mine ? "" : "Take the command, then drive.");
    byId("place-hint").hidden = !(mine && this.placeable);
  }
  async #run(factor) { // until it is answered, a status that was on its way may still tell the speed before; the choice shown stays
    this.speedsAsked++;
    const { accepted } = await this.ask("speed", { factor });
    this.speedsAsked--;
    if (accepted) this.status = { ...this.status, speed: factor };
    this.#show();
  }
  #speed(factor) {
    const { speed } = this.viewer.timeline;
    if (![...speed.options].some(option => Number(option.value) === factor)) speed.append(element("option", { value: factor, text: `${factor}×` }));
    speed.value = String(factor);
  }
}
