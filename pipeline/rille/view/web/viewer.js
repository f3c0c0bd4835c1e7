// Picture, plots and timeline of a set of runs, tied to one clock: the same for a replay and a live session.
import { THREE, GLTFLoader } from "./three.js";
import { Stage } from "./stage.js";
import { World } from "./world.js";
import { Camera, CAMERAS } from "./camera.js";
import { Layers, LAYERS } from "./layers.js";
import { Timeline } from "./timeline.js";
import { Plots } from "./plots.js";
import { Events, Numbers, Tabs } from "./panel.js";
import { Keys } from "./keys.js";
import { byId, element, toggle } from "./util.js";

export async function parsedScene(buffer) { return (await new GLTFLoader().parseAsync(buffer, "")).scene; }

export class Viewer {
  constructor(shape, scene, tracks, clock, mode) {
    Object.assign(this, { shape, scene, tracks, clock, mode, frameCount: 0 });
    this.stage = new Stage(byId("view"), shape.layout);
    this.layers = new Layers(() => this.refresh(), shape.wheels.length > 0);
    this.keys = new Keys();
    this.#worlds();
    this.camera = new Camera(this.stage, this.worlds[0], () => { this.stage.dirty = true; });
    this.timeline = new Timeline(tracks, clock);
    this.tabs = new Tabs();
    this.tabs.opened = () => { if (this.plots) this.plots.redraw = true; };
    this.plots = new Plots(this.tabs.add("plots", "Plots"), shape, tracks, clock);
    this.numbersPane = this.tabs.add("numbers", "Numbers");
    this.numbers = new Numbers(this.numbersPane, this.worlds);
    this.events = new Events(this.tabs.add("events", "Events"), tracks, clock);
    this.#cameras(); this.#modes(); this.#keys();
    clock.on("time", () => this.refresh());
    this.before = [];
    this.last = performance.now();
    requestAnimationFrame(now => this.#frame(now));
  }

  #worlds() {
    for (const world of this.worlds ?? []) world.dispose();
    this.stage.worlds = []; this.stage.side = this.mode === "side";
    const two = this.tracks.length > 1 && this.mode !== "single";
    this.worlds = this.tracks.slice(0, two ? 2 : 1).map((track, k) => new World(this.stage, this.scene, track, k, { ghost: k > 0 && this.mode === "ghost", titled: two }));
    for (const world of this.worlds) { world.time = this.clock.time; world.at(this.clock.time, this.layers.shown); this.stage.add(world); }
    const { arrows } = this.worlds[0];
    this.layers.tell({ force: arrows.unit, length: arrows.reach });
    byId("view").classList.toggle("two", this.stage.side && two);
    if (this.numbers) { this.numbersPane.replaceChildren(); this.numbers = new Numbers(this.numbersPane, this.worlds); }
    if (this.camera) this.camera.anchor.copy(this.worlds[0].rover.centre);
  }
  compare(mode) {
    this.mode = mode;
    for (const button of byId("modes").children) toggle(button, button.dataset.mode === mode);
    this.#worlds(); this.refresh();
  }
  #modes() {
    const place = byId("modes");
    place.hidden = this.tracks.length < 2;
    if (place.hidden) return;
    for (const [mode, label, title] of [["single", "First only", this.tracks[0].label], ["ghost", "Ghost", "both in one scene, the second one transparent"], ["side", "Side by side", "each in its half"]]) {
      place.append(element("button", { type: "button", title, text: label, data: { mode }, "aria-pressed": String(mode === this.mode), on: { click: () => this.compare(mode) } }));
    }
  }
  #cameras() {
    const place = byId("cameras");
    CAMERAS.forEach((mode, k) => place.append(element("button", {
      type: "button", data: { mode }, title: `${TITLES[k]} (${k + 1})`, text: mode[0].toUpperCase() + mode.slice(1), "aria-pressed": String(mode === this.camera.mode), on: { click: () => this.look(mode) } })));
  }
  look(mode) {
    this.camera.set(mode, this.worlds[0]);
    for (const button of byId("cameras").children) toggle(button, button.dataset.mode === mode);
    this.stage.dirty = true;
  }
  #keys() {
    const { keys, clock, timeline } = this;
    if (!clock.live) {
      keys.on([" "], "play, pause", () => clock.toggle());
      keys.on(["ArrowLeft", "ArrowRight"], "a frame back, on (with shift: a second)", event => {
        const way = event.key === "ArrowLeft" ? -1 : 1;
        if (event.shiftKey) clock.seek(clock.time + way); else timeline.step(way);
      });
      keys.on(["Home", "End"], "to the start, to the end", event => clock.seek(event.key === "Home" ? clock.start : clock.end));
    }
    keys.on([",", "."], "a frame back, on", event => timeline.step(event.key === "," ? -1 : 1));
    keys.on(["-", "+"], "slower, faster", event => timeline.quicker(event.key === "-" ? -1 : 1));
    CAMERAS.forEach((mode, k) => keys.on([String(k + 1)], `camera: ${TITLES[k]}`, () => this.look(mode)));
    for (const layer of LAYERS) keys.on([layer.key], layer.title, () => this.layers.flip(layer.name));
    keys.on(["h"], "camera back to the rover", () => this.look(this.camera.mode === "free" ? "follow" : this.camera.mode));
    keys.on(["?"], "this list", () => keys.help());
    keys.tell(["mouse"], "picture: drag turns, wheel zooms, right button moves; plots: click seeks, wheel zooms, double click shows all");
  }

  refresh() { this.stale = true; }
  grown(back) { // live: the newest state has come
    for (const world of this.worlds) { if (back) world.rewind(); world.extend(); }
    if (this.layers.scale?.force !== this.worlds[0].arrows.unit) this.layers.tell({ force: this.worlds[0].arrows.unit, length: this.worlds[0].arrows.reach });
    this.refresh();
  }

  #frame(now) {
    requestAnimationFrame(next => this.#frame(next));
    const elapsed = Math.min(0.25, (now - this.last) / 1000);
    this.last = now;
    for (const act of this.before) act(elapsed, now);
    this.clock.advance(elapsed);
    if (this.stale) {
      this.stale = false;
      for (const world of this.worlds) { world.time = this.clock.time; world.at(this.clock.time, this.layers.shown); }
      this.stage.dirty = true;
    }
    this.stage.pace(now);
    if (this.stage.dirty) {
      this.camera.follow(this.worlds[0], elapsed);
      this.stage.draw(world => this.camera.shifted(this.worlds[0], world));
      this.frameCount++;
    }
    this.timeline.show(); this.plots.show(now); this.numbers.show(); this.events.show();
  }

  pose(name) { // in W, of the first run, as drawn
    const i = this.shape.bodyNamed(name), node = this.worlds[0].rover.nodes[i];
    if (!node) return null;
    if (this.stale) { this.worlds[0].at(this.clock.time, this.layers.shown); }
    const { origin } = this.shape, { position: p, quaternion: q } = node;
    return [p.x + origin[0], p.y + origin[1], p.z + origin[2], q.w, q.x, q.y, q.z];
  }
  onScreen(name) { // where a body stands in the window [px]
    const node = this.worlds[0].rover.nodes[this.shape.bodyNamed(name)], box = this.stage.renderer.domElement.getBoundingClientRect(), [, width] = this.stage.views()[0];
    this.stage.camera.updateMatrixWorld();
    const at = node.getWorldPosition(new THREE.Vector3()).project(this.stage.camera);
    return [box.left + (at.x + 1) * width / 2, box.top + (1 - at.y) * this.stage.height / 2];
  }
}
const TITLES = ["follow the rover", "behind the rover, turning with it", "from above, north up", "free"];
