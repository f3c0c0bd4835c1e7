// The fine terrain grid into which wheels press ruts: the same for a replay and a live session. A place keeps its deepest rut, so that the
// order does not matter, and looking back presses anew from the untouched ground.
import { THREE } from "./three.js";
import { clamp, smooth } from "./util.js";
import { soilMaterial } from "./soil.js";
import { tiled } from "./tiles.js";

const DARK = 0.30; // of a rut's light that is lost where it is deep
const BERM = 0.22; // height of the raised rim, of the sinkage

export class Ground {
  constructor(mesh, grid, toSun, level) {
    this.mesh = mesh; this.grid = grid; this.toSun = toSun;
    const geometry = mesh.geometry, from = geometry.attributes.position, n = from.count, colour = geometry.attributes.color;
    this.position = new Float32Array(3 * n); this.colour = new Float32Array(3 * n);
    mesh.updateMatrixWorld();
    const v = new THREE.Vector3();
    for (let i = 0; i < n; i++) {
      v.fromBufferAttribute(from, i); this.position.set([v.x, v.y, v.z], 3 * i);
      if (colour) this.colour.set([colour.getX(i), colour.getY(i), colour.getZ(i)], 3 * i); else this.colour.fill(0.32, 3 * i, 3 * i + 3);
    }
    this.lift = mesh.matrixWorld.elements[14]; // of the node, where it has one
    this.base = new Float32Array(n); for (let i = 0; i < n; i++) this.base[i] = this.position[3 * i + 2];
    this.baseColour = this.colour.slice();
    this.depth = new Float32Array(n); this.rim = new Float32Array(n);
    geometry.setAttribute("position", this.positions = new THREE.BufferAttribute(this.position, 3).setUsage(THREE.DynamicDrawUsage));
    geometry.setAttribute("color", this.colours = new THREE.BufferAttribute(this.colour, 3).setUsage(THREE.DynamicDrawUsage));
    geometry.deleteAttribute("normal");
    mesh.material = soilMaterial(toSun, level);
    this.tiles = tiled(mesh, grid);
    this.tiles.applyMatrix4(mesh.matrixWorld);
    this.touched = new Set(); this.changed = new Set();
  }

  heightAt(x, y, values = this.base) { // of the untouched ground (or other values at the grid), NaN outside
    const { rows, columns, x_west, y_north, posting_x, posting_y } = this.grid;
    const c = (x - x_west) / posting_x, r = (y_north - y) / posting_y;
    if (!(c >= 0 && r >= 0 && c <= columns - 1 && r <= rows - 1)) return NaN;
    const j = Math.min(columns - 2, Math.floor(c)), i = Math.min(rows - 2, Math.floor(r)), u = c - j, w = r - i, k = i * columns + j;
    return (1 - w) * ((1 - u) * values[k] + u * values[k + 1]) + w * ((1 - u) * values[k + columns] + u * values[k + columns + 1]) + this.lift;
  }

  press({ x, y, forwardX, forwardY, sinkage, radius, width }) { // a wheel's footprint; forward: unit vector
    if (!(sinkage > 0)) return;
    const { rows, columns, x_west, y_north, posting_x, posting_y } = this.grid, posting = Math.max(posting_x, posting_y);
    const s = Math.min(sinkage, radius), long = Math.max(Math.sqrt(s * (2 * radius - s)), 0.75 * posting), half = 0.5 * width;
    const edge = Math.max(half + 0.35 * posting, 1.08 * half), outer = edge + Math.max(0.6 * width, 1.5 * posting), reach = Math.hypot(long, outer);
    const j0 = Math.max(0, Math.ceil((x - reach - x_west) / posting_x)), j1 = Math.min(columns - 1, Math.floor((x + reach - x_west) / posting_x));
    const i0 = Math.max(0, Math.ceil((y_north - y - reach) / posting_y)), i1 = Math.min(rows - 1, Math.floor((y_north - y + reach) / posting_y));
    for (let i = i0; i <= i1; i++) {
      for (let j = j0; j <= j1; j++) {
        const dx = x_west + j * posting_x - x, dy = y_north - i * posting_y - y;
        const along = Math.abs(dx * forwardX + dy * forwardY), across = Math.abs(dy * forwardX - dx * forwardY);
        if (along > long || across > outer) continue;
        const k = i * columns + j, arc = clamp(along / long, 0, 1), floor = s * (1 - arc * arc);
        const deep = floor * (1 - smooth(0.8 * half, edge, across));
        const middle = edge + 0.35 * (outer - edge), rim = BERM * floor * smooth(0.9 * half, middle, across) * (1 - smooth(middle, outer, across));
        if (deep > this.depth[k]) { this.depth[k] = deep; this.changed.add(k); }
        if (rim > this.rim[k]) { this.rim[k] = rim; this.changed.add(k); }
      }
    }
  }

  restore() { // the untouched ground
    for (const k of this.touched) { this.depth[k] = 0; this.rim[k] = 0; this.changed.add(k); }
    this.touched.clear();
  }

  flush() { // heights, tint and light of what changed
    if (!this.changed.size) return false;
    const { columns, rows } = this.grid, around = new Set(), { position, base, depth, rim } = this;
    for (const k of this.changed) {
      position[3 * k + 2] = base[k] - depth[k] + Math.max(0, rim[k] - depth[k]);
      if (depth[k] > 0 || rim[k] > 0) this.touched.add(k);
      const j = k % columns, i = (k - j) / columns;
      around.add(k);
      if (j > 0) around.add(k - 1);
      if (j < columns - 1) around.add(k + 1);
      if (i > 0) around.add(k - columns);
      if (i < rows - 1) around.add(k + columns);
    }
    let low = Infinity, high = -1;
    for (const k of around) {
      const tint = 1 - DARK * smooth(0, 0.018, depth[k]), light = tint * this.#relit(k);
      for (let m = 0; m < 3; m++) this.colour[3 * k + m] = this.baseColour[3 * k + m] * light;
      if (k < low) low = k;
      if (k > high) high = k;
    }
    this.changed.clear();
    for (const attribute of [this.positions, this.colours]) { attribute.addUpdateRange(3 * low, 3 * (high - low + 1)); attribute.needsUpdate = true; }
    return true;
  }

  #relit(k) { // light after the rut, of that before
    const { columns, rows, posting_x, posting_y } = this.grid, j = k % columns, i = (k - j) / columns;
    const e = j < columns - 1 ? k + 1 : k, w = j > 0 ? k - 1 : k, n = i > 0 ? k - columns : k, s = i < rows - 1 ? k + columns : k;
    const dx = posting_x * ((j < columns - 1) + (j > 0)), dy = posting_y * ((i > 0) + (i < rows - 1)), p = this.position, b = this.base;
    const light = (gx, gy) => 0.22 + 0.78 * Math.max(0, (this.toSun.z - gx * this.toSun.x - gy * this.toSun.y) / Math.hypot(1, gx, gy));
    const after = light((p[3 * e + 2] - p[3 * w + 2]) / dx, (p[3 * n + 2] - p[3 * s + 2]) / dy), before = light((b[e] - b[w]) / dx, (b[n] - b[s]) / dy);
    return clamp(after / before, 0.35, 1.7);
  }
}
