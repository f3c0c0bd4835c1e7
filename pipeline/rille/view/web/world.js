// One run in the scene: its rover, its ground with ruts, its overlays.
import { THREE } from "./three.js";
import { Rover } from "./rover.js";
import { Ground } from "./ground.js";
import { soilMaterial } from "./soil.js";
import { refine } from "./tiles.js";
import { Stamps } from "./stamps.js";
import { Path, Trails, groundUnder } from "./trails.js";
import { Arrows } from "./arrows.js";
import { Labels } from "./labels.js";
import { angles } from "./shape.js";
import { LINES } from "./colours.js";

export class World {
  constructor(stage, parsed, track, number, { ghost = false, titled = false } = {}) {
    const { shape } = track;
    Object.assign(this, { stage, track, shape, number, ghost, titled, group: new THREE.Group(), state: new Float32Array(shape.size), pressed: 0, pressedAt: -Infinity, shown: {} });
    const scene = parsed.clone(true), nodes = new Map(), terrain = [], rest = [];
    scene.traverse(node => {
      const { rille, name } = node.userData;
      if (rille === "body") nodes.set(name, node); else if (rille === "terrain") terrain.push(node); else if (rille) rest.push(node);
    });
    this.land = new THREE.Group(); this.group.add(this.land);
    this.rover = new Rover(shape, nodes, this.group, { ghost, tint: new THREE.Color(LINES[number % LINES.length]).getHex() });
    this.ground = null;
    for (const node of [...terrain, ...rest]) {
      this.land.attach(node);
      const meshes = [];
      node.traverse(part => { if (part.isMesh) meshes.push(part); });
      for (const part of meshes) this.#land(part, node.userData);
    }
    if (ghost) this.land.visible = false;
    const posting = this.ground ? Math.max(this.ground.grid.posting_x, this.ground.grid.posting_y) : Infinity;
    this.stamps = new Stamps(track, wheel => Math.min(0.3 * wheel.radius, Math.max(0.4 * posting, 0.08 * wheel.radius)));
    this.trails = new Trails(this.group, this.stamps);
    const under = groundUnder(track);
    this.path = new Path(this.group, track, LINES[number % LINES.length], (x, y, i) => {
      const z = this.ground ? this.ground.heightAt(x, y) : NaN;
      return (Number.isFinite(z) ? z : under(i)) + 0.015;
    });
    this.arrows = new Arrows(this.group, shape, 0.42 * this.rover.radius, { opacity: ghost ? 0.5 : 1 });
    this.labels = new Labels(stage.place, shape, titled ? track.label : null);
    this.extend();
  }

  #land(part, { rille, rows, columns }) {
    const stage = this.stage;
    if (rille === "terrain" && !this.ground && rows * columns === part.geometry.attributes.position.count) {
      part.geometry = part.geometry.clone();
      this.ground = new Ground(part, findGrid(part), stage.toSun, stage.level);
      part.visible = false; this.land.add(this.ground.tiles); // drawn by its tiles
    } else if (rille === "obstacles") {
      part.castShadow = part.receiveShadow = true;
      part.material = part.material.clone();
      if (part.material.metalness !== undefined) part.material.metalness = Math.min(part.material.metalness, 0.2);
    } else {
      part.material = soilMaterial(stage.toSun, stage.level, { grain: true, coloured: Boolean(part.geometry.attributes.color) });
      part.receiveShadow = true;
    }
  }

  extend() { // the track has grown
    this.stamps.extend(); this.trails.extend(); this.path.extend(); this.arrows.weigh(this.track);
  }
  rewind() { // the track was cut at its end
    const t = this.track.count > 1 ? this.track.time[this.track.count - 1] : -Infinity;
    this.stamps.rewind(t); this.trails.rewind(t); this.path.rewind(t); this.pressedAt = Infinity;
  }

  at(t, shown) { // set everything to a time
    this.shown = shown;
    this.track.sample(t, this.state);
    this.known = this.rover.pose(this.state);
    this.rover.tint(this.state, shown.slip && this.known);
    if (this.ground && !this.ghost) this.#ruts(shown.ruts ? t : -Infinity);
    this.trails.show(t, shown.trails && !this.ghost);
    this.path.show(t, shown.path);
    this.arrows.show(this.state, shown.forces && this.known && !this.rover.offset.lengthSq());
  }
  #ruts(t) {
    const { ground, stamps } = this;
    if (t < this.pressedAt) { ground.restore(); this.pressed = 0; }
    const to = stamps.upTo(t);
    for (; this.pressed < to; this.pressed++) ground.press(stamps.all[this.pressed]);
    this.pressedAt = t;
    ground.flush();
  }
  beforeDraw(camera, coarse) { if (this.ground) refine(this.ground.tiles, camera.position, coarse ? 2.5 * this.rover.radius : Infinity); }
  afterDraw(camera, left, width, height) {
    this.labels.show(this.state, camera, left, width, height, { wheels: this.shown.labels && this.known, title: this.known, centre: this.rover.centre, radius: this.rover.radius });
  }
  yaw() { return angles(this.state, this.shape.body(this.shape.root) + 3)[2]; }
  dispose() { // what it holds on the graphics card, too; what it shares with other worlds is uploaded again when they draw it
    this.labels.box.remove(); this.group.removeFromParent();
    this.group.traverse(part => {
      part.geometry?.dispose();
      for (const material of [].concat(part.material ?? [])) material.dispose();
      if (part.isInstancedMesh) part.dispose();
    });
  }
}

function findGrid(part) { // numbers of the grid stand on the node or its parent
  for (let node = part; node; node = node.parent) if (node.userData.columns) return node.userData;
  return null;
}
