// A flat band along a way: coloured at each point, shown from one point to another, growing as long as points come.
import { THREE } from "./three.js";

export class Ribbon {
  constructor(group, { opacity = 0.85, colour = null, order = 1 } = {}) {
    this.count = 0; this.room = 256; this.dirty = false; this.place = new Float32Array(6 * this.room); this.tone = new Float32Array(6 * this.room);
    this.index = new Uint32Array(6 * this.room);
    this.geometry = new THREE.BufferGeometry();
    this.material = new THREE.MeshBasicMaterial({
      vertexColors: !colour, color: colour ?? 0xffffff, transparent: true, opacity, depthWrite: false, side: THREE.DoubleSide,
      polygonOffset: true, polygonOffsetFactor: -3, polygonOffsetUnits: -6,
    });
    this.mesh = new THREE.Mesh(this.geometry, this.material);
    this.mesh.frustumCulled = false; this.mesh.renderOrder = order;
    this.#attach(); group.add(this.mesh);
  }
  #attach() {
    this.geometry.setAttribute("position", new THREE.BufferAttribute(this.place, 3));
    this.geometry.setAttribute("color", new THREE.BufferAttribute(this.tone, 3));
    this.geometry.setIndex(new THREE.BufferAttribute(this.index, 1));
  }
  #grow() {
    this.room *= 2;
    for (const name of ["place", "tone", "index"]) { const wider = new this[name].constructor(6 * this.room); wider.set(this[name]); this[name] = wider; }
    this.geometry.dispose(); this.#attach();
  }
  push(left, right, colour, begins) { // left, right: points of the two edges; colour: linear rgb
    if (this.count >= this.room) this.#grow();
    const n = this.count++, a = 2 * n;
    this.place.set(left, 6 * n); this.place.set(right, 6 * n + 3);
    this.tone.set(colour, 6 * n); this.tone.set(colour, 6 * n + 3);
    this.index.set(n === 0 || begins ? [0, 0, 0, 0, 0, 0] : [a - 2, a - 1, a, a, a - 1, a + 1], 6 * n);
    this.dirty = true;
  }
  cut(count) { this.count = Math.min(this.count, count); }
  show(from, to) { // points from..to-1
    if (this.dirty) {
      for (const attribute of [this.geometry.attributes.position, this.geometry.attributes.color, this.geometry.index]) attribute.needsUpdate = true;
      this.dirty = false;
    }
    const first = from + 1, last = Math.min(to, this.count);
    this.geometry.setDrawRange(6 * first, Math.max(0, 6 * (last - first)));
  }
  set visible(value) { this.mesh.visible = value; }
}
