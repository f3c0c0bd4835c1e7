// The rover's bodies, set by the state vector. A body whose pose is not known keeps its place relative to the root body.
import { THREE } from "./three.js";
import { slipColour } from "./colours.js";
import { WHEEL } from "./shape.js";

export class Rover {
  constructor(shape, nodes, group, { ghost = false, tint = 0x6fb1ea } = {}) {
    this.shape = shape; this.ghost = ghost; this.centre = new THREE.Vector3(); this.offset = new THREE.Vector3(); this.nodes = shape.bodies.map(body => nodes.get(body.name) ?? new THREE.Group());
    this.meshes = [];
    for (const node of this.nodes) {
      group.add(node);
      node.updateMatrix();
      node.traverse(part => { if (part.isMesh) { this.meshes.push(part); this.#dress(part, tint); } });
    }
    const rootRest = this.nodes[shape.root].matrix.clone().invert();
    this.rest = this.nodes.map(node => rootRest.clone().multiply(node.matrix));
    this.radius = this.#size();
    this.wheelMaterials = shape.wheels.map(wheel => this.#own(shape.bodyNamed(wheel.body)));
    this.slipShown = 0;
  }

  #dress(part, tint) {
    part.castShadow = !this.ghost; part.receiveShadow = !this.ghost;
    const materials = (Array.isArray(part.material) ? part.material : [part.material]).map(material => {
      const own = material.clone();
      if (own.metalness !== undefined) { own.metalness = Math.min(own.metalness, 0.3); own.roughness = Math.max(own.roughness ?? 1, 0.45); }
      if (this.ghost) {
        Object.assign(own, { transparent: true, opacity: 0.34, depthWrite: false, vertexColors: false });
        own.color?.setHex(tint); own.emissive?.setHex(tint); if (own.emissive) own.emissiveIntensity = 0.35;
      }
      return own;
    });
    part.material = Array.isArray(part.material) ? materials : materials[0];
  }

  #own(body) { // a wheel's materials, which slip tints
    const list = [];
    this.nodes[body]?.traverse(part => { if (part.isMesh) for (const m of [].concat(part.material)) if (m.color) list.push({ material: m, colour: m.color.clone() }); });
    return list;
  }

  #box() {
    const box = new THREE.Box3();
    for (const node of this.nodes) { node.updateMatrixWorld(true); box.expandByObject(node); }
    return box;
  }

  #size() {
    const box = this.#box();
    if (box.isEmpty()) return 1;
    return Math.max(0.2, 0.5 * box.getSize(new THREE.Vector3()).length());
  }

  pose(state) { // false where even the root is not known
    const { shape } = this, at = shape.body(shape.root), root = this.nodes[shape.root];
    const known = Number.isFinite(state[at] + state[at + 3]);
    this.nodes.forEach((node, i) => {
      const k = shape.body(i);
      if (!Number.isFinite(state[k] + state[k + 1] + state[k + 2] + state[k + 3])) { node.userData.unknown = true; return; }
      node.userData.unknown = false;
      node.position.set(state[k], state[k + 1], state[k + 2]);
      node.quaternion.set(state[k + 4], state[k + 5], state[k + 6], state[k + 3]);
    });
    if (known) {
      root.updateMatrix();
      this.nodes.forEach((node, i) => { if (node.userData.unknown) root.matrix.clone().multiply(this.rest[i]).decompose(node.position, node.quaternion, node.scale); });
      if (!this.shape.held) this.centre.copy(root.position);
      else if (!this.framed) { this.framed = true; this.#box().getCenter(this.centre); } // what stands on the world is looked at as it first stood
    }
    for (const node of this.nodes) { node.visible = known; node.position.add(this.offset); } // offset: while it is dragged
    return known;
  }

  tint(state, shown) { // wheels in the colour of their slip
    if (this.ghost || (!shown && !this.slipShown)) return;
    this.slipShown = shown;
    const rgb = [0, 0, 0], colour = new THREE.Color();
    this.shape.wheels.forEach((_, w) => {
      const slip = state[this.shape.wheel(w) + WHEEL.slip_ratio], on = shown && Number.isFinite(slip);
      slipColour(slip, rgb); colour.setRGB(...rgb, THREE.SRGBColorSpace);
      for (const { material, colour: own } of this.wheelMaterials[w]) { material.color.copy(own); if (on) material.color.lerp(colour, 0.72); }
    });
  }
}
