// Renderer, sky and sun. Worlds (one for each run) are put on it; side by side each has its half.
import { THREE } from "./three.js";

const SKIES = [ // by gravity [m/s^2]
  { below: 2.6, colour: 0x04060a, stars: 1, ambient: 0.30, fog: 0 },
  { below: 6.0, colour: 0x8a6a50, stars: 0, ambient: 0.8, fog: 1 },
  { below: Infinity, colour: 0x6f8596, stars: 0, ambient: 1.0, fog: 1 },
];
export const skyOf = gravity => SKIES.find(sky => gravity < sky.below);

export class Stage {
  constructor(place, layout) {
    this.place = place;
    this.renderer = new THREE.WebGLRenderer({ antialias: true, powerPreference: "high-performance" });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFSoftShadowMap;
    this.ratio = Math.min(devicePixelRatio, 2);
    this.renderer.setPixelRatio(this.ratio);
    this.renderer.domElement.setAttribute("aria-label", "3-D view of the rover on its terrain; drag turns, wheel zooms, right button moves");
    this.renderer.domElement.tabIndex = 0;
    place.prepend(this.renderer.domElement);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(42, 1, 0.02, 2000);
    this.camera.up.set(0, 0, 1);
    this.sky = skyOf(layout.gravity ?? 1.62);
    this.scene.background = new THREE.Color(this.sky.colour);
    const sun = layout.sun ?? [-0.55, 0.45, 0.70];
    this.toSun = new THREE.Vector3(...sun).normalize();
    if (this.toSun.z < 0.2) { this.toSun.z = 0.2; this.toSun.normalize(); }
    this.sun = new THREE.DirectionalLight(0xfff4e4, 2.9);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    this.sun.shadow.bias = -0.0006; this.sun.shadow.normalBias = 0.01;
    this.ambient = new THREE.HemisphereLight(0xb8c6d8, 0x8d857a, this.sky.ambient);
    this.fill = new THREE.DirectionalLight(0xc4d4ea, 0.45); // so that the shaded side is not lost
    this.scene.add(this.sun, this.sun.target, this.ambient, this.fill, this.fill.target);
    if (this.sky.stars) this.scene.add(this.stars = stars());
    this.worlds = []; this.side = false; this.dirty = true; this.width = 1; this.height = 1;
    this.coarse = false; this.slow = 0; this.drawnAt = 0; this.running = 0;
    new ResizeObserver(() => this.resize()).observe(place);
    this.resize();
  }

  // light that a level, sunlit ground gets: the terrain's baked colours are divided by it
  get level() { return (2.9 * this.toSun.z + this.sky.ambient + 0.45 * 0.5) / Math.PI; }

  add(world) { this.worlds.push(world); this.scene.add(world.group); this.dirty = true; }

  resize() {
    this.width = Math.max(1, this.place.clientWidth); this.height = Math.max(1, this.place.clientHeight);
    this.renderer.setSize(this.width, this.height, false);
    this.dirty = true;
  }

  light(centre, radius) {
    const box = this.sun.shadow.camera, reach = 1.5 * radius;
    this.sun.target.position.copy(centre);
    this.sun.position.copy(centre).addScaledVector(this.toSun, 6 * radius);
    if (box.right !== reach) {
      Object.assign(box, { left: -reach, right: reach, top: reach, bottom: -reach, near: 0.1 * radius, far: 12 * radius });
      box.updateProjectionMatrix();
    }
    this.fill.target.position.copy(centre);
    this.fill.position.copy(centre).add(new THREE.Vector3(-this.toSun.x, -this.toSun.y, 0.5));
  }

  views() { // [left, width] of each world's part, in CSS pixels
    return this.side && this.worlds.length > 1 ? [[0, this.width / 2], [this.width / 2, this.width / 2]] : [[0, this.width]];
  }

  draw(cameraFor) { // cameraFor(world): places the camera
    const { renderer, camera } = this, views = this.views();
    renderer.setScissorTest(views.length > 1);
    views.forEach(([left, width], k) => {
      const world = this.worlds[k];
      renderer.setViewport(left, 0, width, this.height); renderer.setScissor(left, 0, width, this.height);
      camera.aspect = width / this.height; camera.updateProjectionMatrix();
      if (views.length > 1) this.worlds.forEach((other, m) => { other.group.visible = m === k; });
      else for (const each of this.worlds) each.group.visible = true;
      const back = cameraFor(world);
      world.beforeDraw(camera, this.coarse);
      this.light(world.rover.centre, world.rover.radius);
      if (this.stars) this.stars.position.copy(camera.position);
      renderer.render(this.scene, camera);
      for (const seen of views.length > 1 ? [world] : this.worlds) seen.afterDraw(camera, left, width, this.height);
      back?.();
    });
    this.dirty = false;
  }

  pace(now) { // a slow machine (software rendering) gets a coarser picture while it moves, the full one as soon as it rests
    if (!this.dirty) {
      this.running = 0;
      if (this.coarse && now - this.drawnAt > 250) this.#resolve(false);
      return;
    }
    const span = now - this.drawnAt;
    if (this.running++ > 1) this.slow += 0.3 * (Math.min(span, 400) - this.slow);
    if (this.slow > 70) this.#resolve(true);
    this.drawnAt = now;
  }
  #resolve(coarse) {
    if (this.coarse === coarse) return;
    this.coarse = coarse; this.renderer.setPixelRatio(coarse ? 0.6 * this.ratio : this.ratio); this.resize();
  }

  ray(clientX, clientY) { // in the view under the pointer
    const box = this.renderer.domElement.getBoundingClientRect(), x = clientX - box.left, views = this.views();
    const k = views.findIndex(([left, width]) => x >= left && x <= left + width), [left, width] = views[Math.max(0, k)];
    this.camera.aspect = width / this.height; this.camera.updateProjectionMatrix();
    const caster = new THREE.Raycaster();
    caster.setFromCamera(new THREE.Vector2(2 * (x - left) / width - 1, 1 - 2 * (clientY - box.top) / this.height), this.camera);
    return { caster, world: this.worlds[Math.max(0, k)] };
  }
}

function stars() { // always the same ones
  let seed = 7;
  const random = () => (seed = (seed * 16807) % 2147483647) / 2147483647;
  const count = 900, places = new Float32Array(3 * count), colours = new Float32Array(3 * count);
  for (let i = 0; i < count; i++) {
    const z = 2 * random() - 1, turn = 2 * Math.PI * random(), flat = Math.sqrt(1 - z * z), light = 0.12 + 0.75 * random() ** 6;
    places.set([1500 * flat * Math.cos(turn), 1500 * flat * Math.sin(turn), 1500 * z], 3 * i);
    colours.set([light, light, light * (0.9 + 0.2 * random())], 3 * i);
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(places, 3));
  geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3));
  const points = new THREE.Points(geometry, new THREE.PointsMaterial({ size: 1.6, sizeAttenuation: false, vertexColors: true, depthWrite: false }));
  points.renderOrder = -1; points.frustumCulled = false;
  return points;
}
