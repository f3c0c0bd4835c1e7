// Four ways to look: follow (moves with the rover), chase (turns with it too), top, free. In each, the mouse turns and zooms.
import { THREE, OrbitControls } from "./three.js";
import { angles } from "./shape.js";
import { calm, clamp } from "./util.js";

export const CAMERAS = ["follow", "chase", "top", "free"];

export class Camera {
  constructor(stage, world, changed) {
    this.stage = stage; this.mode = "follow"; this.target = world.rover.centre.clone(); this.heading = null; this.radius = world.rover.radius;
    this.controls = new OrbitControls(stage.camera, stage.renderer.domElement);
    Object.assign(this.controls, { enableDamping: false, maxPolarAngle: 0.495 * Math.PI, minDistance: 0.3 * this.radius, maxDistance: 400 });
    this.controls.addEventListener("change", () => { if (!this.moving) changed(); });
    this.anchor = world.rover.centre.clone();
    this.home(world);
  }

  home(world) { // to the rover, from behind and the left
    const heading = this.#yaw(world) ?? 0, turn = heading + Math.PI + 0.62, far = 3.7 * this.radius;
    this.#put(world.rover.centre, [far * Math.cos(turn) * 0.88, far * Math.sin(turn) * 0.88, 0.46 * far]);
  }
  #put(target, offset) {
    this.moving = true;
    this.anchor.copy(target); this.controls.target.copy(target);
    this.controls.target.z -= 0.04 * this.radius;
    this.stage.camera.position.copy(target).add(new THREE.Vector3(...offset));
    this.controls.update(); this.moving = false; this.stage.dirty = true;
  }

  set(mode, world) {
    this.mode = mode; this.heading = this.#yaw(world);
    const heading = this.heading ?? 0, far = 3.4 * this.radius;
    this.controls.maxPolarAngle = mode === "top" ? 0.02 : 0.495 * Math.PI;
    if (mode === "top") this.#put(world.rover.centre, [0, -0.001 * far, 1.7 * far]);
    else if (mode === "chase") this.#put(world.rover.centre, [-far * Math.cos(heading) * 0.93, -far * Math.sin(heading) * 0.93, 0.4 * far]);
    else if (mode === "follow") this.home(world);
  }
  #yaw(world) {
    const { shape, state } = world, yaw = angles(state, shape.body(shape.root) + 3)[2];
    return Number.isFinite(yaw) ? yaw : null;
  }

  follow(world, elapsed) { // the rover has moved
    if (this.mode === "free" || !world.known) { this.#above(world); return; }
    const { camera } = this.stage, { controls } = this;
    this.moving = true;
    const by = world.rover.centre.clone().sub(this.anchor);
    if (by.lengthSq() > 0) { this.anchor.copy(world.rover.centre); controls.target.add(by); camera.position.add(by); }
    if (this.mode === "chase") {
      const yaw = this.#yaw(world);
      if (yaw !== null && this.heading !== null) {
        const whole = Math.atan2(Math.sin(yaw - this.heading), Math.cos(yaw - this.heading));
        const part = whole * (calm.matches ? 1 : clamp(1 - Math.exp(-elapsed / 0.5), 0, 1));
        this.heading += part;
        camera.position.sub(controls.target).applyAxisAngle(new THREE.Vector3(0, 0, 1), part).add(controls.target);
        if (Math.abs(whole - part) > 1e-3) this.stage.dirty = true;
      } else this.heading = yaw;
    }
    controls.update();
    this.#above(world);
    this.moving = false;
  }
  #above(world) { // never below the ground
    const { camera } = this.stage, z = world.ground?.heightAt(camera.position.x, camera.position.y), least = z + 0.12 * this.radius;
    if (camera.position.z < least) { camera.position.z = least; camera.lookAt(this.controls.target); }
  }

  shifted(from, to) { // side by side: the same look at the other rover; answer: back again
    if (this.mode === "free" || from === to || !to.known) return undefined;
    const by = to.rover.centre.clone().sub(from.rover.centre), { camera } = this.stage;
    camera.position.add(by); camera.updateMatrixWorld();
    return () => { camera.position.sub(by); camera.updateMatrixWorld(); };
  }
}
