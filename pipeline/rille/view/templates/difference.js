"use strict";
// The difference report: one choice of recording, channel, window and regime, shown in every figure.
(() => {
  const { channels, recordings, names, regimes, whiteness, map, runs, mode } = rille.data;
  const byId = id => document.getElementById(id);
  const points = mode === "points";
  const timeTitle = points ? "point" : "time [s]";
  const stretch = points ? "curve" : "window";
  const chosen = { recording: String(rille.data.start.recording), channel: rille.data.start.channel, window: null, regime: null, score: "all" };
  const log = Math.log10;
  const heatTop = log(Math.min(rille.data.highest, 1e4));
  const heatLow = log(0.5);
  const heatTicks = (heatTop < 1 ? [0.5, 0.7, 1, 1.5, 2, 3, 5, 7, 10] : [0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000])
    .filter(tick => log(tick) <= heatTop);
  const noiseAt = (0 - heatLow) / (heatTop - heatLow); // the noise floor's place on the scale
  const heatScale = [
    [0, "var(--heat0)"], [noiseAt, "var(--heat1)"], [noiseAt + 0.3 * (1 - noiseAt), "var(--heat2)"],
    [noiseAt + 0.65 * (1 - noiseAt), "var(--heat3)"], [1, "var(--heat4)"],
  ];
  const heatBar = {
    title: { text: "residual / noise", side: "right" }, tickvals: heatTicks.map(log), ticktext: heatTicks.map(String), thickness: 12, outlinewidth: 0,
  };
  const lifted = value => value === null || Number.isNaN(value) ? null : log(Math.max(value, 1e-3));
  const short = value => value === null || !Number.isFinite(value) ? "-" : Number(value.toPrecision(3)).toString();

  const unpackedSeries = new Map();
  function series(recording, channel) {
    const key = `${recording}:${channel}`;
    if (!unpackedSeries.has(key)) {
      const given = recordings[recording]?.series[channel];
      unpackedSeries.set(key, given ? {
        time: rille.unpacked(given.time), measured: rille.unpacked(given.measured), residual: rille.unpacked(given.residual),
        window: rille.unpacked(given.window), noise: given.noise, of: given.of,
      } : null);
    }
    return unpackedSeries.get(key);
  }
  const windowOf = (recording, number) => recordings[recording]?.windows.find(window => window.number === number);
  const rowNames = channels.map(channel => channel.leftOut ? `${channel.name} (left out)` : channel.name);

  // ---- measured, simulated and residual over time
  const LEAST_IN_WINDOW = 5; // thinned to fewer points, a line is drawn through all windows
  function broken(values, window) { // a gap wherever a window ends
    let ends = 0;
    for (let i = 1; i < window.length; i++) ends += window[i] !== window[i - 1];
    const gaps = values.length >= LEAST_IN_WINDOW * (ends + 1);
    const result = [];
    for (let i = 0; i < values.length; i++) {
      if (gaps && i > 0 && window[i] !== window[i - 1]) result.push(null);
      result.push(Number.isNaN(values[i]) ? null : values[i]);
    }
    return result;
  }
  function range(values, from, to, time, least) {
    let low = Infinity, high = -Infinity;
    for (let i = 0; i < values.length; i++) {
      if (time[i] < from || time[i] > to || !Number.isFinite(values[i])) continue;
      low = Math.min(low, values[i]); high = Math.max(high, values[i]);
    }
    if (low > high) return null;
    low = Math.min(low, -least); high = Math.max(high, least);
    const margin = 0.06 * (high - low) || 1;
    return [low - margin, high + margin];
  }
  const RANKED = 9; // so many of the worst windows carry their rank
  const SHADED = 120; // so many windows are told apart by shading; more would be a grey block
  function shapes(from, to) {
    const inside = recordings[chosen.recording].windows.filter(window => window.stop >= from && window.start <= to);
    const result = [];
    for (const window of inside) {
      const worst = window.differs && window.rank <= RANKED;
      const fill = worst ? "var(--worst)" : window.number % 2 && inside.length <= SHADED ? "var(--shade)" : null;
      const picked = window.number === chosen.window;
      if (inside.length > 1 && (fill || picked)) {
        result.push({
          type: "rect", xref: "x", yref: "paper", x0: window.start, x1: window.stop, y0: 0, y1: 1, layer: "below",
          fillcolor: fill ?? "rgba(0,0,0,0)", line: { width: picked ? 2 : 0, color: "var(--accent)" },
        });
      }
    }
    return result;
  }
  function drawSeries() {
    const found = series(chosen.recording, chosen.channel);
    const name = names[chosen.recording] ?? "";
    if (!found) {
      byId("shown").textContent = `${name} has no channel ${channels[chosen.channel].name}.`;
      rille.show("series", [], { annotations: [{ text: "no such channel in this recording", showarrow: false, xref: "paper", yref: "paper", x: 0.5, y: 0.5 }] });
      return;
    }
    const { time, measured, residual, window, noise } = found;
    const simulated = measured.map((value, i) => value - residual[i]);
    const picked = chosen.window === null ? null : windowOf(chosen.recording, chosen.window);
    const margin = picked ? Math.max(0.5 * (picked.stop - picked.start), 1e-9) : 0;
    const from = picked ? picked.start - margin : time[0];
    const to = picked ? picked.stop + margin : time[time.length - 1];
    let visible = 0;
    for (const t of time) if (t >= from && t <= to) visible++;
    const style = points ? "markers" : visible < 250 ? "lines+markers" : "lines";
    const brokenTime = broken(time, window);
    const line = (values, label, color, axis, width) => ({
      type: "scatter", mode: style, name: label, x: brokenTime, y: broken(values, window), yaxis: axis, connectgaps: false,
      line: { color, width }, marker: { color, size: points ? 6 : 4 }, hovertemplate: "%{y:.6g}",
    });
    const top = both => both.reduce((a, b) => !a ? b : !b ? a : [Math.min(a[0], b[0]), Math.max(a[1], b[1])], null);
    const upper = top([range(measured, from, to, time, -Infinity), range(simulated, from, to, time, -Infinity)]);
    const lower = range(residual, from, to, time, Number.isFinite(noise) ? 2.2 * noise : 0);
    const band = Number.isFinite(noise) && noise > 0
      ? [{ type: "rect", xref: "paper", yref: "y2", x0: 0, x1: 1, y0: -2 * noise, y1: 2 * noise, fillcolor: "var(--band)", line: { width: 0 }, layer: "below" }] : [];
    const ranked = recordings[chosen.recording].windows.filter(w => w.differs && w.rank <= RANKED && w.start + w.stop >= 2 * from && w.start + w.stop <= 2 * to);
    rille.show("series", [
      line(measured, "measured", "var(--measured)", "y", 1),
      line(simulated, "simulated", "var(--simulated)", "y", 1.8),
      line(residual, "residual", "var(--residual)", "y2", 1.1),
    ], {
      xaxis: { range: [from, to], title: { text: timeTitle }, anchor: "y2" }, hovermode: "x unified",
      yaxis: { domain: [0.46, 1], title: { text: `${channels[chosen.channel].of}<br>[${channels[chosen.channel].unit}]` }, range: upper ?? undefined, autorange: !upper },
      yaxis2: { domain: [0, 0.4], title: { text: `residual [${channels[chosen.channel].unit}]` }, range: lower ?? undefined, autorange: !lower, zeroline: true },
      shapes: [...band, ...shapes(from, to)],
      annotations: mode === "windows" ? ranked.map(w => ({
        text: `${w.rank}`, x: (w.start + w.stop) / 2, y: 1, yref: "paper", yanchor: "bottom", showarrow: false, font: { size: 10, color: "var(--bad)" },
      })) : [],
      margin: { l: 80, r: 16, t: 40, b: 46 },
    });
    const where = picked ? `, ${stretch} ${picked.number} (${points ? "points " : ""}${short(picked.start)} to ${short(picked.stop)}${points ? "" : " s"}${picked.rank ? `, rank ${picked.rank}` : ""}, ${short(picked.normalised)} × noise)` : "";
    const less = time.length < found.of ? ` Drawn: ${time.length} of ${found.of} samples, extremes kept, the worst windows whole.` : "";
    byId("shown").textContent = `${name}, ${channels[chosen.channel].name}${where}. Noise ${short(noise)} ${channels[chosen.channel].unit}.${less}`;
  }

  // ---- all windows of all channels
  let stripEdges = null;
  function drawStrip() {
    const { edges, cells, window, joined } = recordings[chosen.recording].strip;
    stripEdges = rille.unpacked(edges);
    if (!window.length) return;
    const z = cells.map(row => Array.from(rille.unpacked(row), lifted));
    const text = cells.map((row, channel) => Array.from(rille.unpacked(row), (value, k) =>
      window[k] < 0 ? "" : `${channels[channel].name}<br>${stretch} ${window[k]}${joined > 1 ? ` (largest of ${joined})` : ""}<br>${short(value)} × noise`));
    const outlined = [{
      type: "rect", xref: "paper", yref: "y", x0: 0, x1: 1, y0: chosen.channel - 0.5, y1: chosen.channel + 0.5, line: { color: "var(--accent)", width: 1.5 },
    }];
    const picked = chosen.window === null ? null : windowOf(chosen.recording, chosen.window);
    if (picked) {
      outlined.push({ type: "rect", xref: "x", yref: "paper", x0: picked.start, x1: picked.stop, y0: 0, y1: 1, line: { color: "var(--accent)", width: 1.5 } });
    }
    rille.show("strip", [{
      type: "heatmap", x: Array.from(stripEdges), y: channels.map((_, k) => k), z, text, hovertemplate: "%{text}<extra></extra>",
      zmin: heatLow, zmax: heatTop, colorscale: heatScale, colorbar: heatBar, hoverongaps: false, ygap: 1,
    }], {
      xaxis: { title: { text: timeTitle }, range: [stripEdges[0], stripEdges[stripEdges.length - 1]] },
      yaxis: { tickvals: channels.map((_, k) => k), ticktext: rowNames, autorange: "reversed", ticklabelposition: "outside" },
      shapes: outlined, margin: { l: 80, r: 16, t: 10, b: 46 },
    }).then(canvas => listen(canvas, "plotly_click", event => {
      const at = event.points[0];
      const column = at.pointIndex ? at.pointIndex[1] : at.pointNumber[1];
      const number = recordings[chosen.recording].strip.window[column];
      if (number >= 0) choose({ channel: at.y, window: number });
    }));
  }
  const listening = new Set();
  function listen(canvas, event, what) {
    if (listening.has(canvas)) return;
    listening.add(canvas);
    canvas.on(event, what);
  }

  // ---- per recording
  function drawRuns() {
    const z = runs.map(row => row.map(lifted));
    const text = runs.map((row, channel) => row.map((value, k) => `${names[k]}<br>${channels[channel].name}<br>${short(value)} × noise${k in recordings ? "" : "<br>(series not in this page)"}`));
    rille.show("runs", [{
      type: "heatmap", z, y: channels.map((_, k) => k), text, hovertemplate: "%{text}<extra></extra>", zmin: heatLow, zmax: heatTop,
      colorscale: heatScale, colorbar: heatBar, hoverongaps: false, ygap: 1,
    }], {
      xaxis: names.length <= 40 ? { tickvals: names.map((_, k) => k), ticktext: names } : { title: { text: "recording, in their order" } },
      yaxis: { tickvals: channels.map((_, k) => k), ticktext: rowNames, autorange: "reversed" }, margin: { l: 80, r: 16, t: 10, b: 46 },
    }).then(canvas => listen(canvas, "plotly_click", event => {
      const at = event.points[0];
      const recording = String(at.pointIndex ? at.pointIndex[1] : at.pointNumber[1]);
      if (recording in recordings) { choose({ recording, channel: at.y, window: null }); byId("time").scrollIntoView(); }
    }));
  }

  // ---- against regimes
  const binsOf = (channel, regime) => regimes.bins.find(bin => bin.channel === channel && bin.regime === regime);
  const regimesOf = channel => {
    const strongest = regimes.bins.filter(bin => bin.channel === channel).map(bin => bin.regime); // strongest first
    return [...strongest, ...regimes.names.filter(name => !strongest.includes(name) && regimes.scatter[channel]?.values[name])];
  };
  function fillRegimes() {
    const offered = regimesOf(chosen.channel);
    if (!offered.includes(chosen.regime)) chosen.regime = offered[0] ?? null;
    byId("pick-regime").replaceChildren(...offered.map(name => {
      const bin = binsOf(chosen.channel, name);
      return new Option(`${name}${bin?.differs ? " – depends" : ""}`, name, false, name === chosen.regime);
    }));
  }
  function drawRegime() {
    const found = regimes.scatter[chosen.channel];
    const bin = binsOf(chosen.channel, chosen.regime);
    const x = found && found.values[chosen.regime];
    const traces = [];
    if (x) {
      traces.push({
        type: "scatter", mode: "markers", name: "residuals", x: rille.unpacked(x), y: rille.unpacked(found.residual), marker: { size: 4, color: "var(--muted)", opacity: 0.35 },
        hovertemplate: "%{x:.4g}: %{y:.3g} σ<extra></extra>",
      });
    }
    if (bin) {
      traces.push({
        type: "scatter", mode: "lines+markers", name: "RMS", x: bin.centre, y: bin.rms, line: { color: "var(--simulated)", width: 2, dash: "dot" }, marker: { size: 7, symbol: "diamond" },
        error_y: { type: "data", array: bin.rmsError, thickness: 1.2, width: 3 },
      }, {
        type: "scatter", mode: "lines+markers", name: "mean", x: bin.centre, y: bin.bias, line: { color: "var(--residual)", width: 2 }, marker: { size: 8 },
        error_y: { type: "data", array: bin.biasError, thickness: 1.4, width: 4 },
      });
    }
    const unit = regimes.units[chosen.regime];
    rille.show("regime", traces, {
      xaxis: { title: { text: chosen.regime ? `${chosen.regime}${unit ? ` [${unit}]` : ""}` : "" } },
      yaxis: { title: { text: `residual of ${channels[chosen.channel].name} / noise` }, zeroline: true },
      shapes: [{ type: "rect", xref: "paper", yref: "y", x0: 0, x1: 1, y0: -2, y1: 2, fillcolor: "var(--band)", line: { width: 0 }, layer: "below" }],
    });
  }

  // ---- map
  function extent(values) {
    let low = Infinity, high = -Infinity;
    for (const value of values) if (Number.isFinite(value)) { low = Math.min(low, value); high = Math.max(high, value); }
    return [low, high];
  }
  function drawMap() {
    const x = rille.unpacked(map.x), y = rille.unpacked(map.y), scores = rille.unpacked(map.scores[chosen.score]);
    const known = Array.from(scores.keys()).filter(k => Number.isFinite(scores[k])); // places where something was measured
    const label = known.map(k => `${names[map.recording[k]]}, window ${map.window[k]}<br>${short(scores[k])} × noise`);
    const worst = [];
    for (const [recording, given] of Object.entries(recordings)) {
      for (const window of given.windows.filter(w => w.differs && w.rank <= 5)) {
        const at = map.window.findIndex((number, k) => number === window.number && map.recording[k] === Number(recording));
        if (at >= 0 && mode === "windows") worst.push({ x: x[at], y: y[at], text: String(window.rank), showarrow: true, ax: 16, ay: -18, arrowcolor: "var(--bad)", arrowwidth: 1.2, arrowhead: 0, font: { color: "#fff", size: 11 }, bgcolor: "var(--bad)", borderpad: 2 });
      }
    }
    const image = map.image;
    const wide = extent(x), high = extent(y);
    const size = Math.max(wide[1] - wide[0], high[1] - high[0]); // the shorter side shows at least a third of the longer one
    const [across, up] = [wide, high].map(([low, top]) => {
      const half = Math.max(top - low, 0.33 * size) / 2 + 0.06 * size;
      return [(low + top) / 2 - half, (low + top) / 2 + half];
    });
    const canvasWidth = byId("map").clientWidth - 170;
    const height = Math.min(820, Math.max(300, canvasWidth * (up[1] - up[0]) / (across[1] - across[0]) + 90));
    rille.show("map", [{
      type: "scatter", mode: "markers", x: known.map(k => x[k]), y: known.map(k => y[k]), customdata: known, text: label, hovertemplate: "%{text}<extra></extra>",
      marker: { size: 7, color: known.map(k => lifted(scores[k])), cmin: heatLow, cmax: heatTop, colorscale: heatScale, colorbar: heatBar, line: { width: 0.6, color: "rgba(20,20,20,.55)" } },
    }], {
      height, xaxis: { title: { text: "x [m]" }, zeroline: false, constrain: "domain", range: across, showgrid: !image },
      yaxis: { title: { text: "y [m]" }, scaleanchor: "x", zeroline: false, constrain: "domain", range: up, showgrid: !image },
      annotations: worst, showlegend: false,
      images: image ? [{
        source: image.source, xref: "x", yref: "y", x: image.west, y: image.north, sizex: image.east - image.west, sizey: image.north - image.south,
        sizing: "stretch", layer: "below",
      }] : [],
    }).then(canvas => listen(canvas, "plotly_click", event => {
      const k = event.points[0].customdata;
      const recording = String(map.recording[k]);
      if (recording in recordings) { choose({ recording, window: map.window[k] }); byId("time").scrollIntoView(); }
    }));
  }

  // ---- whiteness
  function drawWhiteness() {
    const found = whiteness[chosen.channel] ?? {};
    const correlation = rille.unpacked(found.autocorrelation), band = rille.unpacked(found.band);
    const lags = correlation ? Array.from(correlation, (_, k) => k + 1) : [];
    rille.show("correlation", correlation ? [
      { type: "scatter", mode: "lines", x: lags, y: band, line: { width: 0 }, hoverinfo: "skip", showlegend: false },
      { type: "scatter", mode: "lines", x: lags, y: Array.from(band, value => -value), fill: "tonexty", fillcolor: "var(--band)", line: { width: 0 }, name: "95 % if white", hoverinfo: "skip" },
      { type: "bar", x: lags, y: correlation, marker: { color: "var(--residual)" }, name: "autocorrelation", hovertemplate: "lag %{x}: %{y:.3f}<extra></extra>" },
    ] : [], { xaxis: { title: { text: "lag [samples]" } }, yaxis: { title: { text: "autocorrelation" }, rangemode: "tozero" }, bargap: 0.3 });
    const quantile = rille.unpacked(found.quantile), normal = rille.unpacked(found.normal);
    const ends = normal ? [normal[0], normal[normal.length - 1]] : [];
    rille.show("quantiles", quantile ? [
      { type: "scatter", mode: "lines", x: ends, y: ends, line: { color: "var(--muted)", dash: "dash", width: 1.2 }, name: "normal, stated noise", hoverinfo: "skip" },
      { type: "scatter", mode: "markers", x: normal, y: quantile, marker: { size: 4.5, color: "var(--residual)" }, name: "residual / noise", hovertemplate: "%{x:.2f}: %{y:.2f}<extra></extra>" },
    ] : [], { xaxis: { title: { text: "quantile of a normal distribution" } }, yaxis: { title: { text: "quantile of residual / noise" } } });
    const words = found.p === undefined ? "too few samples to judge" : `Ljung-Box over ${found.lags} lags: p ${found.p < 1e-12 ? "< 1e-12" : `= ${short(found.p)}`}`;
    byId("white-words").textContent = `${channels[chosen.channel].name}: ${words}.`;
  }

  // ---- choosing
  const waitingFor = { strip: drawStrip, series: drawSeries, runs: drawRuns, regime: drawRegime, map: drawMap, correlation: drawWhiteness };
  const seen = new Set();
  function draw(...figures) { for (const figure of figures) if (seen.has(figure)) waitingFor[figure](); }
  function choose(change) {
    Object.assign(chosen, change);
    const others = "channel" in change || "recording" in change;
    byId("pick-recording").value = chosen.recording;
    for (const pick of document.querySelectorAll(".pick-channel")) pick.value = String(chosen.channel);
    if (regimes && "channel" in change) fillRegimes();
    if (regimes && "regime" in change) byId("pick-regime").value = chosen.regime;
    draw("strip", "series");
    if (others) draw("correlation");
    if (others || "regime" in change) draw("regime");
    mark("channel-table", `channel:${chosen.channel}`);
    mark("window-table", chosen.window === null ? "" : `window:${chosen.recording}:${chosen.window}`);
  }
  function mark(table, key) {
    for (const row of byId(table)?.querySelectorAll("tr[data-key]") ?? []) {
      if (row.dataset.key === key) row.setAttribute("aria-current", "true"); else row.removeAttribute("aria-current");
    }
  }
  function step(by) {
    const order = recordings[chosen.recording].windows;
    const at = order.findIndex(window => window.number === chosen.window);
    const next = at < 0 ? (by > 0 ? 0 : order.length - 1) : Math.min(order.length - 1, Math.max(0, at + by));
    if (order.length) choose({ window: order[next].number });
  }
  rille.onChoose((table, key) => {
    const [kind, first, ...rest] = key.split(":");
    if (kind === "channel") choose({ channel: Number(first) });
    if (kind === "window") choose({ recording: first, window: Number(rest[0]), ...worstChannel(first, Number(rest[0])) });
    if (kind === "run") choose({ recording: first, channel: Number(rest[0]), window: null });
    if (kind === "regime") { choose({ channel: Number(first), regime: rest.join(":") }); byId("regimes").scrollIntoView(); return; }
    byId("time").scrollIntoView();
  });
  function worstChannel(recording, number) { // the channel that misses most in a window
    const { cells, window } = recordings[recording].strip;
    const column = window.indexOf(number);
    if (column < 0) return {};
    const values = cells.map((row, k) => channels[k].leftOut ? NaN : rille.unpacked(row)[column]);
    const highest = Math.max(...values.filter(Number.isFinite));
    return Number.isFinite(highest) ? { channel: values.indexOf(highest) } : {};
  }

  byId("pick-recording").replaceChildren(...Object.keys(recordings).map(key => new Option(names[key], key)));
  byId("pick-recording").addEventListener("change", event => choose({ recording: event.target.value, window: null }));
  for (const pick of document.querySelectorAll(".pick-channel")) {
    pick.replaceChildren(...channels.map((channel, k) => new Option(`${channel.name} (${channel.verdict})`, String(k))));
    pick.addEventListener("change", event => choose({ channel: Number(event.target.value) }));
  }
  byId("previous").addEventListener("click", () => step(-1));
  byId("next").addEventListener("click", () => step(1));
  byId("whole").addEventListener("click", () => choose({ window: null }));
  if (regimes) {
    fillRegimes();
    byId("pick-regime").addEventListener("change", event => choose({ regime: event.target.value }));
  }
  if (map) {
    byId("pick-score").replaceChildren(...["all", ...Object.keys(map.scores).filter(key => key !== "all")].map(key => new Option(key === "all" ? "all channels" : channels[key].name, key)));
    byId("pick-score").addEventListener("change", event => { chosen.score = event.target.value; draw("map"); });
  }
  for (const [figure, drawing] of Object.entries(waitingFor)) {
    if (byId(figure)) rille.whenSeen(figure, () => { seen.add(figure); drawing(); });
  }
  choose({});
})();
