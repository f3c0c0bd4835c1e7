// Forces of the soil on each wheel, beside its contact: normal load up, drawbar pull along the heading, side force along the axle. As long as
// they are large against the rover's weight on one wheel.
import { THREE } from "./three.js";
import { FORCES } from "./colours.js";
import { WHEEL, axleOf } from "./shape.js";

export class Arrows {
  constructor(group, shape, reach, { opacity = 1 } = {}) {
    this.shape = shape; this.reach = reach; this.weight = shape.layout.weight ?? 0; // of a wheel's share
    this.scale = 1;
    const count = Math.max(1, 3 * shape.wheels.length), shaft = new THREE.CylinderGeometry(1, 1, 1, 10), tip = new THREE.ConeGeometry(1, 1, 14);
    shaft.translate(0, 0.5, 0).rotateX(Math.PI / 2); tip.translate(0, 0.5, 0).rotateX(Math.PI / 2); // along z, from 0 to 1
    const material = new THREE.MeshBasicMaterial({ transparent: opacity < 1, opacity });
    this.shafts = new THREE.InstancedMesh(shaft, material, count); this.tips = new THREE.InstancedMesh(tip, material, count);
    const colour = new THREE.Color();
    for (let i = 0; i < count; i++) for (const mesh of [this.shafts, this.tips]) mesh.setColorAt(i, colour.set(FORCES[i % 3].colour));
    for (const mesh of [this.shafts, this.tips]) { mesh.frustumCulled = false; group.add(mesh); }
    this.turn = new THREE.Quaternion(); this.to = new THREE.Vector3(); this.from = new THREE.Vector3(); this.size = new THREE.Vector3(); this.matrix = new THREE.Matrix4();
  }

  weigh(track) { // where the layout does not say: the first loads
    if (this.weight > 0) return;
    for (let i = 0; i < Math.min(track.count, 200) && !(this.weight > 0); i++) {
      let sum = 0;
      for (let w = 0; w < this.shape.wheels.length; w++) sum += track.states[i * track.size + this.shape.wheel(w) + WHEEL.normal_load];
      if (sum > 0) this.weight = sum;
    }
  }
  get unit() { return this.weight > 0 && this.shape.wheels.length ? this.weight / this.shape.wheels.length : 0; } // [N] for an arrow as long as reach

  show(state, visible) {
    this.shafts.visible = this.tips.visible = visible && this.unit > 0;
    if (!this.shafts.visible) return;
    const { shape } = this, centre = shape.body(shape.root);
    shape.wheels.forEach((wheel, w) => {
      const k = shape.wheel(w), axle = axleOf(shape, w, state);
      const flat = Math.hypot(axle[0], axle[1]) || 1, forward = [axle[1] / flat, -axle[0] / flat, 0];
      const outer = (state[k] - state[centre]) * axle[0] + (state[k + 1] - state[centre + 1]) * axle[1] < 0 ? -1 : 1, away = outer * (0.5 * wheel.width + 0.25 * wheel.radius);
      const bottom = Number.isFinite(state[k + WHEEL.ground_height]) ? state[k + WHEEL.ground_height] + 0.02 : state[k + 2] - wheel.radius;
      this.from.set(state[k] + axle[0] * away, state[k + 1] + axle[1] * away, bottom);
      [[0, 0, 1], forward, axle].forEach((direction, f) => this.#arrow(3 * w + f, direction, state[k + WHEEL[FORCES[f].field]]));
    });
    for (const mesh of [this.shafts, this.tips]) mesh.instanceMatrix.needsUpdate = true;
  }

  #arrow(i, direction, force) {
    const long = Number.isFinite(force) ? this.scale * this.reach * force / this.unit : 0, size = Math.abs(long), thick = 0.022 * this.reach;
    if (size < 0.02 * this.reach || !Number.isFinite(this.from.x)) {
      this.matrix.makeScale(0, 0, 0); this.shafts.setMatrixAt(i, this.matrix); this.tips.setMatrixAt(i, this.matrix); return;
    }
    const head = Math.min(0.2 * this.reach, 0.5 * size);
    this.to.set(...direction).multiplyScalar(Math.sign(long)).normalize();
    this.turn.setFromUnitVectors(new THREE.Vector3(0, 0, 1), this.to);
    this.matrix.compose(this.from, this.turn, this.size.set(thick, thick, size - head)); this.shafts.setMatrixAt(i, this.matrix);
    this.to.multiplyScalar(size - head).add(this.from);
    this.matrix.compose(this.to, this.turn, this.size.set(2.6 * thick, 2.6 * thick, head)); this.tips.setMatrixAt(i, this.matrix);
  }
}
