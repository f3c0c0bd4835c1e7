// Begins: reads what the page is to show and shows it. `rille` on the window is for tests and for whoever is curious.
import { replayOf, sourceOfPage } from "./source.js";
import { Clock } from "./clock.js";
import { Shape } from "./shape.js";
import { Track } from "./track.js";
import { Viewer, parsedScene } from "./viewer.js";
import { startLive } from "./live.js";
import { banner } from "./toast.js";
import { byId } from "./util.js";

async function startReplay(source) {
  banner("Reading …");
  const { layout, scene, runs, mode } = await replayOf(source), shape = new Shape(layout);
  const tracks = runs.slice(0, 2).map(run => new Track(shape, run.label, run));
  const times = tracks.filter(track => track.count).flatMap(track => [track.start, track.end]);
  const clock = times.length ? new Clock(Math.min(...times), Math.max(...times)) : new Clock(0, 0);
  const parsed = await parsedScene(scene);
  banner("");
  const names = runs.map(run => run.label).join(" · ");
  byId("runs").textContent = names;
  document.title = `${layout.title ?? "rille"} – rille`;
  return { viewer: new Viewer(shape, parsed, tracks, clock, tracks.length > 1 ? mode : "single"), clock };
}

async function begin() {
  const source = sourceOfPage();
  let shown;
  if (source.kind === "live") { shown = await startLive(); await shown.first; } else shown = await startReplay(source);
  globalThis.rille.shown = shown;
  byId("title").textContent = shown.viewer.shape.layout.title ?? "";
  await new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
  document.documentElement.dataset.ready = "yes";
}

const shownOf = name => globalThis.rille.shown?.[name];
globalThis.rille = {
  shown: null,
  time: () => shownOf("clock")?.time ?? NaN,
  seek: t => shownOf("clock").seek(t),
  play: () => shownOf("clock").play(),
  pause: () => shownOf("clock").pause(),
  pose: name => shownOf("viewer")?.pose(name) ?? null,
  frames: () => shownOf("viewer")?.frameCount ?? 0,
  onScreen: name => shownOf("viewer").onScreen(name),
  ready: begin().catch(error => {
    banner(error.message || String(error), "bad");
    if (!error.final) console.error(error);
    throw error;
  }),
};
globalThis.rille.ready.catch(() => {}); // it stands in the banner
