// A grid's mesh in tiles that share their numbers: what is out of sight is not drawn, and a slow machine draws what is far with fewer triangles.
import { THREE } from "./three.js";

const CELLS = 48, BLOCK = 4; // along a tile's edge; of a block that few triangles stand for

export function tiled(mesh, { rows, columns }, margin = 0.3) { // margin [m]: of a tile's height, for what is pressed into it
  const { position, color } = mesh.geometry.attributes, tiles = new THREE.Group(), at = new THREE.Vector3();
  for (let i0 = 0; i0 < rows - 1; i0 += CELLS) {
    for (let j0 = 0; j0 < columns - 1; j0 += CELLS) {
      const i1 = Math.min(rows - 1, i0 + CELLS), j1 = Math.min(columns - 1, j0 + CELLS), box = new THREE.Box3(), geometry = new THREE.BufferGeometry();
      for (let i = i0; i <= i1; i++) for (let j = j0; j <= j1; j++) box.expandByPoint(at.fromBufferAttribute(position, i * columns + j));
      geometry.setAttribute("position", position); geometry.setAttribute("color", color);
      geometry.boundingBox = box.expandByScalar(margin); geometry.boundingSphere = box.getBoundingSphere(new THREE.Sphere());
      const tile = new THREE.Mesh(geometry, mesh.material);
      tile.userData = { fine: fine(i0, j0, i1, j1, columns), coarse: coarse(i0, j0, i1, j1, columns) };
      geometry.setIndex(tile.userData.fine);
      tile.receiveShadow = true; tiles.add(tile);
    }
  }
  return tiles;
}

export function refine(tiles, camera, near) { // near [m]: as far all triangles are drawn; Infinity: everywhere
  for (const tile of tiles.children) {
    const far = near < Infinity && tile.geometry.boundingBox.distanceToPoint(camera) > near, wanted = far ? tile.userData.coarse : tile.userData.fine;
    if (tile.geometry.index !== wanted) tile.geometry.setIndex(wanted);
  }
}

function fine(i0, j0, i1, j1, columns) {
  const index = new Uint32Array(6 * (i1 - i0) * (j1 - j0));
  let n = 0;
  for (let i = i0; i < i1; i++) for (let j = j0; j < j1; j++) {
    const k = i * columns + j, s = k + columns;
    index[n++] = k; index[n++] = s; index[n++] = k + 1; index[n++] = k + 1; index[n++] = s; index[n++] = s + 1;
  }
  return new THREE.BufferAttribute(index, 1);
}

function coarse(i0, j0, i1, j1, columns) { // a fan about each block's middle; at the tile's edge it takes every point, so that no gap opens to its neighbour
  const index = [];
  for (let i = i0; i < i1; i += BLOCK) for (let j = j0; j < j1; j += BLOCK) {
    const south = Math.min(i + BLOCK, i1), east = Math.min(j + BLOCK, j1), ring = [];
    const middle = Math.floor((i + south) / 2) * columns + Math.floor((j + east) / 2);
    const side = (length, place, all) => { for (let k = 0; k < length; k += all ? 1 : length) ring.push(place(k)); };
    side(south - i, k => (i + k) * columns + j, j === j0); // down the west side, along the south, up the east, back along the north
    side(east - j, k => south * columns + j + k, south === i1);
    side(south - i, k => (south - k) * columns + east, east === j1);
    side(east - j, k => i * columns + east - k, i === i0);
    ring.forEach((point, k) => { const next = ring[(k + 1) % ring.length]; if (point !== middle && next !== middle) index.push(middle, point, next); });
  }
  return new THREE.BufferAttribute(new Uint32Array(index), 1);
}
