// Names and numbers beside the wheels, as text over the picture.
import { THREE } from "./three.js";
import { WHEEL } from "./shape.js";
import { element, short, spoken } from "./util.js";
import { slipCss } from "./colours.js";

export class Labels {
  constructor(place, shape, title) {
    this.shape = shape; this.box = element("div", { class: "labels", "aria-hidden": "true" });
    this.title = title ? element("div", { class: "label run" }, title) : null;
    if (this.title) this.box.append(this.title);
    this.of = shape.wheels.map(wheel => {
      const chip = element("i"), text = element("span"), made = element("div", { class: "label" }, element("b", { text: spoken(wheel.name) }), element("br"), chip, text);
      this.box.append(made);
      return { made, chip, text };
    });
    place.append(this.box);
    this.at = new THREE.Vector3();
  }
  show(state, camera, left, width, height, { wheels, title, centre, radius }) {
    this.box.hidden = !wheels && !(title && this.title);
    if (this.box.hidden) return;
    const put = (made, x, y, z, visible) => {
      this.at.set(x, y, z).project(camera);
      made.hidden = !visible || !(Math.abs(this.at.x) < 1 && Math.abs(this.at.y) < 1 && this.at.z < 1);
      if (!made.hidden) made.style.transform = `translate(${(left + (this.at.x + 1) * width / 2).toFixed(1)}px, ${((1 - this.at.y) * height / 2).toFixed(1)}px)`;
    };
    if (this.title) put(this.title, centre.x, centre.y, centre.z + 0.75 * radius, title);
    this.of.forEach(({ made, chip, text }, w) => {
      const k = this.shape.wheel(w);
      put(made, state[k], state[k + 1], state[k + 2] + 1.1 * this.shape.wheels[w].radius, wheels);
      if (made.hidden) return;
      chip.style.background = slipCss(state[k + WHEEL.slip_ratio]);
      text.textContent = `slip ${short(state[k + WHEEL.slip_ratio], 2)} · ${short(1000 * state[k + WHEEL.sinkage], 2)} mm`;
    });
  }
}
