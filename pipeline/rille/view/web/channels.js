// Everything that can be plotted: numbers of the state vector, what follows from them, and a recording's own channels.
import { JOINT_FIELDS, WHEEL, WHEEL_FIELDS, angles } from "./shape.js";
import { spoken } from "./util.js";

const shown = WHEEL_FIELDS.slice(3);

export function channelsOf(shape, tracks) {
  const list = [];
  const add = (id, label, name, unit, at) => {
    const channel = { id, label, unit, members: [], name, series: track => ({ time: track.time, count: track.count, at: i => at(track, i) }) };
    channel.members.push(channel); list.push(channel);
    return channel;
  };
  const column = offset => (track, i) => track.states[i * track.size + offset];
  const group = (id, label, unit, members) => { if (members.length > 1) list.push({ id, label, unit, members, name: label }); };
  const root = shape.body(shape.root), rover = shape.bodies[shape.root]?.name ?? "rover";

  const wheels = new Map(shown.map(field => [field, shape.wheels.map((wheel, w) => {
    const own = add(`wheel/${wheel.name}/${field}`, `${spoken(wheel.name)} · ${spoken(field)}`, wheel.name, shape.wheelUnit(field), column(shape.wheel(w) + WHEEL[field]));
    return own;
  })]));
  add("rover/speed", `${spoken(rover)} · speed`, "speed", "m/s", speed(root));
  ["roll", "pitch", "yaw"].forEach((name, k) => add(`rover/${name}`, `${spoken(rover)} · ${name}`, name, "rad", (track, i) => angles(track.states, i * track.size + root + 3)[k]));
  shape.bodies.forEach((body, b) => ["x", "y", "z"].forEach((axis, k) => add(
    `body/${body.name}/${axis}`, `${spoken(body.name)} · position ${axis}`, axis, "m", (track, i) => track.states[i * track.size + shape.body(b) + k] + shape.origin[k])));
  const joints = new Map(JOINT_FIELDS.map((field, k) => [field, shape.joints.map((joint, j) => add(
    `joint/${joint.name}/${field}`, `${spoken(joint.name)} · joint ${field}`, joint.name, shape.jointUnit(j, field), column(shape.joint(j) + k)))]));
  const extra = new Map();
  for (const track of tracks) for (const channel of track.extra) extra.set(channel.label, channel.unit);
  for (const [label, unit] of extra) {
    const channel = { id: `extra/${label}`, label, unit, name: label, members: [], series: track => {
      const own = track.extra.find(each => each.label === label);
      return own ? { time: own.time, count: own.time.length, at: i => own.values[i] } : null;
    } };
    channel.members.push(channel); list.push(channel);
  }
  const single = list.splice(0);
  for (const [field, members] of wheels) group(`wheels/${field}`, `${spoken(field)} · all wheels`, shape.wheelUnit(field), members);
  for (const [field, members] of joints) {
    for (const kind of ["hinge", "prismatic"]) {
      const those = members.filter((_, j) => (shape.joints[j].kind === "prismatic") === (kind === "prismatic"));
      if (those.length) group(`joints/${kind}/${field}`, `joint ${field} · all ${kind === "hinge" ? "hinges" : "slides"}`, those[0].unit, those);
    }
  }
  list.push(...single);
  return list;
}

function speed(root) { // of the root body, over a stretch of five frames
  return (track, i) => {
    const a = Math.max(0, i - 2), b = Math.min(track.count - 1, i + 2), s = track.states, span = track.time[b] - track.time[a], p = a * track.size + root, q = b * track.size + root;
    return span > 0 ? Math.hypot(s[q] - s[p], s[q + 1] - s[p + 1], s[q + 2] - s[p + 2]) / span : NaN;
  };
}

export function trimmed(names) { // what the names differ in: wheel_front_left, wheel_rear_left -> front left, rear left
  const parts = names.map(name => name.split(/[_\s]+/));
  const same = k => parts.every(words => words.length > 1 && words.length > k + 1 && words[k] === parts[0][k]);
  let skip = 0;
  while (names.length > 1 && same(skip)) skip++;
  return parts.map(words => words.slice(skip).join(" "));
}

export function found(channels, text, most = 80) { // those that hold every word
  const words = text.toLowerCase().split(/\s+/).filter(Boolean);
  const fits = channels.filter(channel => { const own = `${channel.label} ${channel.id}`.toLowerCase(); return words.every(word => own.includes(word)); });
  return fits.slice(0, most);
}
