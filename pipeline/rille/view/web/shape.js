// Where each number stands in the state vector: bodies 7, joints 4, wheels 11 each, in the order of the layout's lists.
export const JOINT_FIELDS = ["position", "velocity", "effort", "work"];
export const WHEEL_FIELDS = [
  "x", "y", "z", "ground_height", "slip_ratio", "slip_angle", "sinkage", "normal_load", "drawbar_pull", "side_force", "drive_torque",
];
export const WHEEL = Object.fromEntries(WHEEL_FIELDS.map((name, i) => [name, i]));
const UNITS = {
  slip_ratio: "1", slip_angle: "rad", sinkage: "m", normal_load: "N", drawbar_pull: "N", side_force: "N", drive_torque: "N m",
  ground_height: "m", x: "m", y: "m", z: "m",
};
const JOINT_UNITS = {
  hinge: { position: "rad", velocity: "rad/s", effort: "N m", work: "J" },
  prismatic: { position: "m", velocity: "m/s", effort: "N", work: "J" },
};

export class Shape {
  constructor(layout) {
    this.bodies = layout.bodies ?? []; this.joints = layout.joints ?? []; this.wheels = layout.wheels ?? [];
    this.firstJoint = 7 * this.bodies.length;
    this.firstWheel = this.firstJoint + 4 * this.joints.length;
    this.size = this.firstWheel + 11 * this.wheels.length;
    this.held = !this.bodies.some(body => body.root); // by the world
    this.root = Math.max(0, this.bodies.findIndex(body => body.root));
    this.origin = layout.origin ?? [0, 0, 0];
    this.layout = layout;
  }
  body(i) { return 7 * i; }
  joint(i) { return this.firstJoint + 4 * i; }
  wheel(i) { return this.firstWheel + 11 * i; }
  bodyNamed(name) { return this.bodies.findIndex(body => body.name === name); }
  wheelUnit(field) { return UNITS[field]; }
  jointUnit(i, field) { return (JOINT_UNITS[this.joints[i].kind] ?? JOINT_UNITS.hinge)[field]; }
}

export function turned(q, at, v) { // v, of the frame whose (w, x, y, z) stands at q[at], in W
  const w = q[at], x = q[at + 1], y = q[at + 2], z = q[at + 3];
  const tx = 2 * (y * v[2] - z * v[1]), ty = 2 * (z * v[0] - x * v[2]), tz = 2 * (x * v[1] - y * v[0]);
  return [v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx];
}

export function axleOf(shape, w, s, at = 0) { // of wheel w in W, to the left; where its body's turn is not known, that of the root body
  const body = shape.bodyNamed(shape.wheels[w].body), own = body < 0 ? [NaN] : turned(s, at + shape.body(body) + 3, shape.wheels[w].axle ?? [0, 1, 0]);
  return Number.isFinite(own[0]) ? own : turned(s, at + shape.body(shape.root) + 3, [0, 1, 0]);
}

export function angles(s, at) { // roll, pitch (nose down positive, as by the right hand), yaw of the quaternion at s[at]
  const w = s[at], x = s[at + 1], y = s[at + 2], z = s[at + 3];
  return [
    Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
    Math.asin(Math.min(1, Math.max(-1, 2 * (w * y - z * x)))),
    Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
  ];
}
