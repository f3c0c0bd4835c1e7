// The rover is dragged over the terrain before the first step; with shift it is turned.
import { THREE } from "./three.js";
import { element } from "./util.js";

export class Placing {
  constructor(viewer, live) {
    Object.assign(this, { viewer, live, drag: null });
    const { stage } = viewer, size = viewer.worlds[0].rover.radius;
    this.mark = new THREE.Group();
    const paint = new THREE.MeshBasicMaterial({ color: 0x6fb1ea, transparent: true, opacity: 0.85, depthTest: false });
    const ring = new THREE.Mesh(new THREE.RingGeometry(0.92 * size, 0.97 * size, 64), paint), nose = new THREE.Mesh(new THREE.CircleGeometry(0.12 * size, 3), paint);
    nose.position.x = 1.06 * size;
    this.mark.add(ring, nose); this.mark.visible = false; this.mark.renderOrder = 10;
    stage.scene.add(this.mark);
    this.text = element("div", { class: "label place" }); this.text.hidden = true;
    stage.place.append(this.text);
    stage.place.addEventListener("pointerdown", event => this.#begin(event), { capture: true });
    addEventListener("pointermove", event => { if (this.drag) this.#move(event); });
    addEventListener("pointerup", () => { if (this.drag) this.#end(); });
    addEventListener("keydown", event => { if (event.key === "Escape" && this.drag) this.#stop(); });
  }

  #begin(event) {
    if (event.button !== 0 || event.target !== this.viewer.stage.renderer.domElement || !this.live.placeable) return;
    const { caster } = this.viewer.stage.ray(event.clientX, event.clientY), { rover } = this.viewer.worlds[0];
    if (caster.ray.distanceToPoint(rover.centre) > 0.5 * rover.radius) return;
    event.stopImmediatePropagation(); event.preventDefault();
    if (!this.live.mine) { this.live.say("Take the command first; then the rover can be placed.", "bad"); return; }
    const start = this.#ground(event) ?? rover.centre.clone();
    this.drag = { from: start, at: rover.centre.clone(), base: rover.centre.clone(), heading: null, yaw: this.viewer.worlds[0].yaw() };
    this.viewer.camera.controls.enabled = false;
  }
  #ground(event) { // where the ray meets the terrain
    const { caster, world } = this.viewer.stage.ray(event.clientX, event.clientY), { origin, direction } = caster.ray, { ground } = world;
    const level = () => { const t = (world.rover.centre.z - origin.z) / direction.z; return t > 0 && t < 500 ? origin.clone().addScaledVector(direction, t) : null; };
    if (!ground) return level();
    let before = null;
    for (let t = 0, step = 0.1 * world.rover.radius; t < 300 * world.rover.radius; t += step, step *= 1.02) {
      const z = ground.heightAt(origin.x + t * direction.x, origin.y + t * direction.y), above = origin.z + t * direction.z - z;
      if (Number.isFinite(above) && above <= 0 && before !== null) {
        let [low, high] = [before, t];
        for (let i = 0; i < 24; i++) { const m = 0.5 * (low + high); if (origin.z + m * direction.z > ground.heightAt(origin.x + m * direction.x, origin.y + m * direction.y)) low = m; else high = m; }
        return origin.clone().addScaledVector(direction, high);
      }
      before = Number.isFinite(above) ? t : null;
    }
    return level();
  }
  #move(event) {
    const { drag, viewer } = this, hit = this.#ground(event);
    if (!hit) return;
    if (event.shiftKey) drag.heading = Math.atan2(hit.y - drag.at.y, hit.x - drag.at.x);
    else { drag.at.set(drag.base.x + hit.x - drag.from.x, drag.base.y + hit.y - drag.from.y, 0); }
    const world = viewer.worlds[0], under = world.ground?.heightAt(drag.at.x, drag.at.y), ground = Number.isFinite(under) ? under : drag.base.z, here = world.ground?.heightAt(drag.base.x, drag.base.y);
    world.rover.offset.set(drag.at.x - drag.base.x, drag.at.y - drag.base.y, Number.isFinite(here) ? ground - here : 0);
    this.mark.position.set(drag.at.x, drag.at.y, ground + 0.03); this.mark.rotation.z = drag.heading ?? drag.yaw; this.mark.visible = true;
    const [ox, oy] = viewer.shape.origin, box = viewer.stage.place.getBoundingClientRect();
    this.text.textContent = `x ${(drag.at.x + ox).toFixed(2)} m · y ${(drag.at.y + oy).toFixed(2)} m${drag.heading === null ? " · shift turns" : ` · ${(drag.heading * 180 / Math.PI).toFixed(0)}°`}`;
    this.text.hidden = false; this.text.style.transform = `translate(${event.clientX - box.left}px, ${event.clientY - box.top - 26}px)`;
    viewer.refresh();
  }
  async #end() {
    const { drag, viewer } = this, moved = this.mark.visible, [ox, oy] = viewer.shape.origin;
    this.drag = null; viewer.camera.controls.enabled = true; this.mark.visible = false; this.text.hidden = true;
    if (moved) await this.live.ask("place", { x: drag.at.x + ox, y: drag.at.y + oy, heading: drag.heading });
    this.#stop();
  }
  #stop() { this.drag = null; this.mark.visible = false; this.text.hidden = true; this.viewer.camera.controls.enabled = true; this.viewer.worlds[0].rover.offset.set(0, 0, 0); this.viewer.refresh(); }
}
