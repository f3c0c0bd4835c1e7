// One plot: lines of one or several channels, of one or two runs, with the time cursor. Clicking and dragging seeks, the wheel zooms.
import { clamp, element, niceStep, short } from "./util.js";
import { LINES } from "./colours.js";
import { trimmed } from "./channels.js";

const LEFT = 52, RIGHT = 10, TOP = 8, BOTTOM = 20;

export class Figure {
  constructor(channel, tracks, clock, { zoom, remove, draws }) {
    Object.assign(this, { channel, tracks, clock, zoom, draws, drawnFor: "" });
    this.names = trimmed(channel.members.map(member => member.name));
    this.base = element("canvas"); this.over = element("canvas", { class: "over" });
    this.values = channel.members.map((_, k) => element("span", { class: "value" }));
    this.keys = element("div", { class: "keys" }, ...channel.members.map((_, k) => element("span", { class: "key" },
      element("i", { style: { background: LINES[k % LINES.length] } }), channel.members.length > 1 ? `${this.names[k]} ` : "", this.values[k])));
    this.plot = element("div", {
      class: "plot", tabindex: "0", role: "slider", "aria-label": `${channel.label}, plot over time; arrow keys move the time`, "aria-valuemin": "0", "aria-valuemax": "0", "aria-valuenow": "0",
    }, this.base, this.over);
    this.box = element("figure", { class: "figure" },
      element("figcaption", {}, element("b", { text: channel.label }), element("span", { class: "unit", text: channel.unit ? `[${channel.unit}]` : "" }),
        element("button", { class: "quiet", title: "remove this plot", "aria-label": `remove the plot of ${channel.label}`, text: "×", on: { click: remove } })),
      this.plot, this.keys);
    this.#listen();
  }

  #listen() {
    const seek = event => { const box = this.plot.getBoundingClientRect(); this.clock.seek(this.timeAt(event.clientX - box.left)); };
    this.plot.addEventListener("pointerdown", event => { if (event.button === 0) { this.plot.setPointerCapture(event.pointerId); seek(event); } });
    this.plot.addEventListener("pointermove", event => { if (this.plot.hasPointerCapture(event.pointerId)) seek(event); });
    this.plot.addEventListener("wheel", event => {
      event.preventDefault();
      const t = this.timeAt(event.clientX - this.plot.getBoundingClientRect().left);
      this.zoom(t, Math.exp(clamp(event.deltaY, -200, 200) / 400));
    }, { passive: false });
    this.plot.addEventListener("dblclick", () => this.zoom(null, 0));
    new ResizeObserver(() => { this.drawnFor = ""; this.draws(); }).observe(this.plot);
  }

  timeAt(x) { const [from, to] = this.span ?? [0, 1]; return from + (to - from) * clamp((x - LEFT) / Math.max(1, this.width - LEFT - RIGHT), 0, 1); }
  xAt(t) { const [from, to] = this.span; return LEFT + (this.width - LEFT - RIGHT) * (t - from) / (to - from || 1); }
  yAt(v) { const [low, high] = this.reach; return TOP + (this.height - TOP - BOTTOM) * (high - v) / (high - low || 1); }

  draw(span) { // the lines, where anything of them has changed
    const ratio = devicePixelRatio || 1;
    this.width = this.plot.clientWidth; this.height = this.plot.clientHeight;
    if (!this.width) return;
    const key = [span, this.width, this.height, ratio, ...this.tracks.map(track => track.version)].join();
    if (key === this.drawnFor) return;
    this.drawnFor = key; this.span = span;
    for (const canvas of [this.base, this.over]) { canvas.width = Math.round(this.width * ratio); canvas.height = Math.round(this.height * ratio); }
    const pen = this.base.getContext("2d");
    pen.scale(ratio, ratio);
    const lines = this.tracks.flatMap((track, run) => this.channel.members.map((member, k) => ({ run, k, points: this.#reduced(member.series(track)) })).filter(line => line.points));
    let low = Infinity, high = -Infinity;
    for (const { points } of lines) for (const [, a, b] of points) { if (a < low) low = a; if (b > high) high = b; }
    if (low > high) [low, high] = [-1, 1];
    const size = Math.max(Math.abs(low), Math.abs(high));
    if (high - low <= 1e-5 * size) { low -= 0.05 * size || 1; high += 0.05 * size || 1; } // constant
    const pad = 0.07 * (high - low);
    this.reach = [low - pad, high + pad];
    this.#axes(pen);
    pen.save(); pen.beginPath(); pen.rect(LEFT, TOP - 2, this.width - LEFT - RIGHT, this.height - TOP - BOTTOM + 4); pen.clip();
    for (const { run, k, points } of lines) {
      pen.strokeStyle = LINES[k % LINES.length]; pen.lineWidth = run ? 1.2 : 1.5; pen.setLineDash(run ? [5, 4] : []); pen.globalAlpha = run ? 0.85 : 1;
      this.#stroke(pen, points);
    }
    pen.restore();
  }

  #reduced(series) { // [t, least, greatest] for each pixel, null where the line breaks
    if (!series || !series.count) return null;
    const [from, to] = this.span, { time, count, at } = series, points = [];
    let i = bisect(time, count, from), last = Math.min(count - 1, bisect(time, count, to) + 1);
    const dense = last - i > 2.5 * this.width;
    if (!dense) { for (; i <= last; i++) { const v = at(i); points.push([time[i], v, v]); } return points; }
    const pixel = (to - from) / (this.width - LEFT - RIGHT), each = Math.max(1, Math.floor((last - i) / (40 * this.width))); // at most 40 looks a pixel
    let edge = time[i] + pixel, now = null;
    for (; i <= last; i += each) {
      const v = at(i);
      if (time[i] > edge) { if (now) points.push(now); else points.push([edge, NaN, NaN]); now = null; while (edge < time[i]) edge += pixel; }
      if (Number.isFinite(v)) { if (!now) now = [time[i], v, v]; else { if (v < now[1]) now[1] = v; if (v > now[2]) now[2] = v; } }
    }
    if (now) points.push(now);
    return points;
  }

  #stroke(pen, points) {
    let open = false;
    pen.beginPath();
    for (let k = 0; k < points.length; k++) {
      const [t, a, b] = points[k], x = this.xAt(t);
      if (!Number.isFinite(a)) { open = false; continue; }
      if (open) pen.lineTo(x, this.yAt(a)); else pen.moveTo(x, this.yAt(a));
      if (b !== a) pen.lineTo(x, this.yAt(b));
      if (!open && !Number.isFinite(points[k + 1]?.[1] ?? NaN)) pen.lineTo(x + 0.6, this.yAt(b)); // a sample alone
      open = true;
    }
    pen.stroke();
  }

  #axes(pen) {
    const [from, to] = this.span, [low, high] = this.reach, right = this.width - RIGHT, bottom = this.height - BOTTOM;
    pen.font = "11px system-ui, sans-serif"; pen.fillStyle = "#8d97a3"; pen.strokeStyle = "#232a32"; pen.lineWidth = 1;
    const line = (x0, y0, x1, y1) => { pen.beginPath(); pen.moveTo(Math.round(x0) + 0.5, Math.round(y0) + 0.5); pen.lineTo(Math.round(x1) + 0.5, Math.round(y1) + 0.5); pen.stroke(); };
    const dy = niceStep(high - low, (bottom - TOP) / 26);
    pen.textAlign = "right"; pen.textBaseline = "middle";
    for (let v = Math.ceil(low / dy) * dy; v <= high; v += dy) {
      const y = this.yAt(v);
      pen.strokeStyle = Math.abs(v) < 1e-9 * dy + 1e-12 ? "#3a444f" : "#232a32"; line(LEFT, y, right, y); pen.fillText(tick(v, dy), LEFT - 6, y);
    }
    const dx = niceStep(to - from, (right - LEFT) / 62);
    pen.textAlign = "center"; pen.textBaseline = "top"; pen.strokeStyle = "#232a32";
    for (let t = Math.ceil(from / dx - 1e-9) * dx; t <= to + 1e-9 * dx; t += dx) { const x = this.xAt(t); line(x, TOP, x, bottom); if (x < right - 18) pen.fillText(tick(t, dx), x, bottom + 5); }
    pen.textAlign = "right"; pen.fillText("s", right, bottom + 5);
  }

  cursor(t) { // the time cursor and the numbers at it
    if (!this.span) return;
    const ratio = devicePixelRatio || 1, pen = this.over.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0); pen.clearRect(0, 0, this.width, this.height);
    const x = this.xAt(t);
    if (x >= LEFT - 1 && x <= this.width - RIGHT + 1) { pen.strokeStyle = "#e7eaee"; pen.globalAlpha = 0.75; pen.beginPath(); pen.moveTo(x, TOP - 4); pen.lineTo(x, this.height - BOTTOM); pen.stroke(); }
    pen.globalAlpha = 1;
    this.channel.members.forEach((member, k) => {
      const texts = [];
      this.tracks.forEach((track, run) => {
        const series = member.series(track);
        if (!series || !series.count) return;
        const v = series.at(bisect(series.time, series.count, t));
        texts.push(short(v));
        if (!Number.isFinite(v) || t < series.time[0] || t > series.time[series.count - 1]) return;
        pen.fillStyle = run ? "#12161b" : LINES[k % LINES.length]; pen.strokeStyle = LINES[k % LINES.length];
        pen.beginPath(); pen.arc(x, this.yAt(v), 2.8, 0, 7); pen.fill(); pen.stroke();
      });
      const text = texts.join(" | ");
      if (this.values[k].textContent !== text) this.values[k].textContent = text;
    });
    this.plot.setAttribute("aria-valuemin", this.clock.start.toFixed(2)); this.plot.setAttribute("aria-valuemax", this.clock.end.toFixed(2)); this.plot.setAttribute("aria-valuenow", t.toFixed(2));
  }
}

function bisect(time, count, t) { // last sample not after t
  let low = 0, high = count - 1;
  while (low < high) { const middle = (low + high + 1) >> 1; if (time[middle] <= t) low = middle; else high = middle - 1; }
  return Math.max(0, low);
}

function tick(value, step) {
  const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  if (Math.abs(value) < 1e-9 * step + 1e-15) return "0";
  return (places > 5 ? value.toExponential(1) : value.toFixed(Math.min(5, places))).replace("-", "−");
}
