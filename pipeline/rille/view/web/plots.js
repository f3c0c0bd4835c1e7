// The list of plots, which share their stretch of time; channels are chosen from a searchable list.
import { Figure } from "./figure.js";
import { picker } from "./picker.js";
import { channelsOf, found } from "./channels.js";
import { clamp, element } from "./util.js";

const FIRST = ["wheels/slip_ratio", "wheels/sinkage", "rover/speed"];
const FIRST_HELD = ["joints/hinge/position", "joints/hinge/velocity", "joints/prismatic/position", "joints/prismatic/velocity"];
const LIVE_STRETCH = 30; // [s]

export class Plots {
  constructor(place, shape, tracks, clock, { first = shape.held ? FIRST_HELD : FIRST } = {}) {
    Object.assign(this, { shape, tracks, clock, figures: [], window: null, redraw: true, last: 0 });
    this.channels = channelsOf(shape, tracks);
    this.list = element("div", { class: "figures" });
    const { box } = picker({
      label: "add a plot", placeholder: "Add a plot: type a name, e.g. sinkage",
      find: text => found(this.channels, text).map(channel => ({ label: channel.label, hint: channel.unit, value: channel })), chosen: channel => this.add(channel),
    });
    const runs = tracks.length > 1 ? element("p", { class: "hint" }, "solid: ", element("b", { text: tracks[0].label }), "; dashed: ", element("b", { text: tracks[1].label })) : "";
    place.append(box, runs, this.list);
    for (const id of first) { const channel = this.channels.find(each => each.id === id); if (channel) this.add(channel); }
    if (!this.figures.length) for (const channel of this.channels.filter(each => this.#any(each)).slice(0, 3)) this.add(channel);
  }
  #any(channel) { return this.tracks.some(track => channel.members.some(member => { const s = member.series(track); return s && s.count && Number.isFinite(s.at(s.count >> 1)); })); }

  add(channel) {
    const here = this.figures.find(figure => figure.channel === channel);
    if (here) { here.box.scrollIntoView({ block: "nearest" }); here.plot.focus({ preventScroll: true }); return; }
    const figure = new Figure(channel, this.tracks, this.clock, {
      zoom: (t, factor) => this.zoom(t, factor), draws: () => { this.redraw = true; },
      remove: () => { figure.box.remove(); this.figures = this.figures.filter(each => each !== figure); },
    });
    this.figures.push(figure); this.list.append(figure.box); this.redraw = true;
  }

  zoom(t, factor) { // about t; null: all of it
    const { start, end } = this.clock;
    if (t === null) this.window = null;
    else {
      const [from, to] = this.span(), size = clamp((to - from) * factor, 0.05, end - start);
      const low = clamp(t - (t - from) / (to - from || 1) * size, start, Math.max(start, end - size));
      this.window = size >= end - start ? null : [low, low + size];
    }
    this.redraw = true;
  }

  span() {
    const { start, end, live, following } = this.clock;
    if (live && following) { const size = this.window ? this.window[1] - this.window[0] : LIVE_STRETCH; return [Math.max(start, end - size), Math.max(end, start + size)]; }
    if (this.window) return this.window;
    return live ? [Math.max(start, this.clock.time - LIVE_STRETCH), Math.max(this.clock.time, Math.min(end, start + LIVE_STRETCH))] : [start, end > start ? end : start + 1];
  }

  show(now) { // now [ms]: a growing run is redrawn some times a second only
    if (!this.list.offsetParent) return;
    if (this.redraw || now - this.last > (this.clock.live ? 120 : 0)) {
      const span = this.span();
      for (const figure of this.figures) figure.draw(span);
      this.redraw = false; this.last = now;
    }
    for (const figure of this.figures) figure.cursor(this.clock.time);
  }
}
