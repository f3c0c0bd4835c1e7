// Colours that mean something; each stands in a legend.
import { clamp } from "./util.js";

export const FORCES = [
  { field: "normal_load", label: "normal load", colour: "#f2f4f7" },
  { field: "drawbar_pull", label: "drawbar pull", colour: "#5fd38d" },
  { field: "side_force", label: "side force", colour: "#c79bff" },
];
export const LINES = ["#6fb1ea", "#f0a35e", "#7fd0a0", "#d98fd0", "#e6d36a", "#8f9cf0", "#ef7f7a", "#6fd0d0", "#b9a58c", "#a7b4c0"];
const STOPS = [ // slip ratio: skidding blue, rolling grey, spinning orange to red
  [-1, 0x2f6fe0], [-0.4, 0x6fa8f5], [0, 0xb9bdb8], [0.15, 0xe8d27a], [0.4, 0xf0933e], [0.7, 0xe2512e], [1, 0xb3123a],
];

export function slipColour(slip, out = [0, 0, 0]) { // sRGB 0..1
  const s = Number.isFinite(slip) ? clamp(slip, -1, 1) : 0;
  let i = 1;
  while (i < STOPS.length - 1 && STOPS[i][0] < s) i++;
  const [a, ca] = STOPS[i - 1], [b, cb] = STOPS[i], u = clamp((s - a) / (b - a), 0, 1);
  for (let k = 0; k < 3; k++) {
    const shift = 16 - 8 * k;
    out[k] = (((ca >> shift) & 255) * (1 - u) + ((cb >> shift) & 255) * u) / 255;
  }
  return out;
}
export const slipCss = slip => `rgb(${slipColour(slip).map(c => Math.round(255 * c)).join(" ")})`;
export const slipGradient = () => `linear-gradient(90deg, ${STOPS.map(([s, c]) => `#${c.toString(16).padStart(6, "0")} ${(50 * (s + 1)).toFixed(1)}%`).join(", ")})`;
