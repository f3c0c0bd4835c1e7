// What is drawn over the picture, by switch; the legend tells colours and scales.
import { byId, element, short, toggle } from "./util.js";
import { FORCES, slipGradient } from "./colours.js";

export const LAYERS = [
  { key: "f", name: "forces", label: "Forces", on: true, title: "force arrows at the wheels" },
  { key: "c", name: "slip", label: "Slip", on: true, title: "wheels in the colour of their slip" },
  { key: "t", name: "trails", label: "Trails", on: true, title: "trails in the colour of slip" },
  { key: "r", name: "ruts", label: "Ruts", on: true, title: "ruts pressed into the ground" },
  { key: "p", name: "path", label: "Path", on: true, title: "path of the rover" },
  { key: "l", name: "labels", label: "Labels", on: false, title: "names and numbers at the wheels" },
];

export class Layers {
  constructor(changed, wheels = true) { // wheels: whether there are any, whose forces, slip and ruts could be shown
    this.wheels = wheels;
    this.shown = Object.fromEntries(LAYERS.map(layer => [layer.name, layer.on]));
    this.changed = changed;
    this.buttons = new Map(LAYERS.map(layer => [layer.name, element("button", {
      type: "button", title: `${layer.title} (${layer.key})`, "aria-pressed": String(layer.on), text: layer.label, on: { click: () => this.flip(layer.name) },
    })]));
    byId("layers").append(...this.buttons.values());
    for (const name of ["forces", "slip", "trails", "ruts"]) this.buttons.get(name).hidden = !wheels;
    this.legend = byId("legend");
  }
  flip(name) {
    this.shown[name] = !this.shown[name]; toggle(this.buttons.get(name), this.shown[name]);
    this.tell(this.scale); this.changed();
  }
  tell(scale) { // scale: {force [N], length [m]} of an arrow
    this.scale = scale;
    const rows = [];
    if (this.shown.forces && scale?.force > 0) {
      rows.push(element("div", { class: "forces" }, ...FORCES.map(force => element("span", {}, element("i", { style: { background: force.colour } }), force.label)),
        element("small", { text: `${short(scale.length, 2)} m ≙ ${short(scale.force, 2)} N` })));
    }
    if (this.wheels && (this.shown.slip || this.shown.trails)) {
      rows.push(element("div", { class: "slips" }, element("span", { text: "slip" }), element("small", { text: "−1 skid" }), element("i", { class: "ramp", style: { background: slipGradient() } }), element("small", { text: "+1 spin" })));
    }
    this.legend.replaceChildren(...rows); this.legend.hidden = !rows.length;
  }
}
