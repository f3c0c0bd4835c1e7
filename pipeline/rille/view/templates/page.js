"use strict";
// What every report shares: figures drawn when they come into view, in the page's colours; tables that sort and whose rows can be chosen.
const rille = (() => {
  const root = document.documentElement;
  const drawn = new Map(); // element -> {data, layout} as given, so that another theme can draw it again
  const waiting = new Map();
  const listeners = [];
  const config = { // no button that would send data away
    displaylogo: false, showSendToCloud: false, plotlyServerURL: "", responsive: true, showTips: false, 
    modeBarButtonsToRemove: ["sendChartToCloud", "select2d", "lasso2d", "autoScale2d"],
  };
  const bare = { ...config, displayModeBar: false };
  const configOf = data => data[0]?.type === "heatmap" ? bare : config; // cells are clicked, not zoomed
  const printing = { now: false };
  const PRINTED = 1000; // width of figures on paper [px]: A4 across

  const css = name => getComputedStyle(root).getPropertyValue(name).trim();

  // "var(--name)" anywhere in a figure becomes the colour that it has now
  function coloured(value) {
    if (typeof value === "string") return value.startsWith("var(") ? css(value.slice(4, -1)) : value;
    if (Array.isArray(value)) return value.map(coloured);
    if (value === null || typeof value !== "object" || ArrayBuffer.isView(value) || "bdata" in value) return value;
    return Object.fromEntries(Object.entries(value).map(([key, entry]) => [key, coloured(entry)]));
  }

  function template() {
    const axis = {
      gridcolor: css("--grid"), linecolor: css("--line"), zerolinecolor: css("--line"), tickcolor: css("--line"), automargin: true,
      title: { standoff: 8 }, exponentformat: "power",
    };
    return {
      layout: {
        paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", colorway: ["--residual", "--simulated", "--good", "--notice", "--muted"].map(css),
        font: { color: css("--ink"), family: "system-ui, sans-serif", size: 12 }, margin: { l: 60, r: 16, t: 30, b: 46 },
        xaxis: axis, yaxis: axis, hoverlabel: { bgcolor: css("--card"), font: { color: css("--ink") } }, hovermode: "closest",
        modebar: { bgcolor: "rgba(0,0,0,0)", color: css("--muted"), activecolor: css("--accent") },
        legend: { orientation: "h", y: 1.02, yanchor: "bottom", x: 0, bgcolor: "rgba(0,0,0,0)" },
      },
    };
  }

  const dressed = layout => ({ ...coloured(layout), template: template(), width: printing.now ? PRINTED : undefined, autosize: !printing.now });

  function show(place, data, layout) {
    const canvas = (typeof place === "string" ? document.getElementById(place) : place).querySelector(".canvas");
    drawn.set(canvas, { data, layout });
    if (layout.height) canvas.style.height = `${layout.height}px`;
    waiting.delete(canvas);
    return Plotly.react(canvas, coloured(data), dressed(layout), configOf(data)).then(() => canvas);
  }

  function drawWaiting(canvas) {
    const draw = waiting.get(canvas);
    if (!draw) return;
    waiting.delete(canvas);
    draw();
  }

  // draw is called once, when the figure comes into view (or the page is printed)
  const observer = new IntersectionObserver(
    entries => entries.filter(entry => entry.isIntersecting).forEach(entry => drawWaiting(entry.target)), { rootMargin: "400px" });
  function whenSeen(place, draw) {
    const canvas = document.getElementById(place).querySelector(".canvas");
    waiting.set(canvas, draw);
    observer.observe(canvas);
  }

  function redrawAll() {
    for (const canvas of [...waiting.keys()]) if (printing.now) drawWaiting(canvas);
    for (const [canvas, { data, layout }] of drawn) {
      Plotly.react(canvas, coloured(data), dressed(layout), configOf(data));
    }
  }

  // theme: as the system has it, until the button is pressed; printed pages are light
  const dark = matchMedia("(prefers-color-scheme: dark)");
  let wish = "";
  function applyTheme() {
    root.dataset.theme = printing.now ? "light" : wish || (dark.matches ? "dark" : "light");
    redrawAll();
  }
  document.getElementById("theme").addEventListener("click", () => {
    wish = root.dataset.theme === "dark" ? "light" : "dark";
    applyTheme();
  });
  dark.addEventListener("change", applyTheme);
  addEventListener("beforeprint", () => { printing.now = true; applyTheme(); });
  addEventListener("afterprint", () => { printing.now = false; applyTheme(); });
  root.dataset.theme = dark.matches ? "dark" : "light";

  // tables
  const sortKey = cell => cell.dataset.value !== undefined ? Number(cell.dataset.value) : cell.textContent.trim().toLowerCase();
  function sortBy(head) {
    const table = head.closest("table");
    const column = [...head.parentNode.children].indexOf(head);
    const before = head.getAttribute("aria-sort");
    const downFirst = head.classList.contains("number");
    const down = before ? before === "ascending" : downFirst;
    for (const other of head.parentNode.children) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    const rows = [...table.tBodies[0].rows].map(row => [sortKey(row.cells[column]), row]);
    rows.sort(([a], [b]) => {
      if (typeof a !== typeof b) return typeof a === "number" ? -1 : 1; // what has no number comes last, whichever way
      const order = typeof a === "number" ? a - b : a.localeCompare(b, undefined, { numeric: true });
      return down ? -order : order;
    });
    table.tBodies[0].append(...rows.map(([, row]) => row));
  }
  function choose(row) {
    for (const other of row.parentNode.querySelectorAll("[aria-current]")) other.removeAttribute("aria-current");
    row.setAttribute("aria-current", "true");
    listeners.forEach(listener => listener(row.closest("table").id, row.dataset.key, row));
  }
  document.addEventListener("click", event => {
    const more = event.target.closest(".more");
    if (more) { document.getElementById(more.dataset.for).classList.add("all"); more.remove(); return; }
    const head = event.target.closest("th");
    if (head) { sortBy(head); return; }
    const row = event.target.closest("tr[data-key]");
    if (row) choose(row);
  });
  document.addEventListener("keydown", event => {
    if ((event.key === "Enter" || event.key === " ") && event.target.matches("tr[data-key]")) { event.preventDefault(); choose(event.target); }
  });

  for (const place of document.querySelectorAll("figure.plot")) {
    const given = place.querySelector("script");
    if (given) whenSeen(place.id, () => { const { data, layout } = JSON.parse(given.textContent); show(place, data, layout); });
  }
  // numbers of a packed array
  function unpacked(value) {
    if (!value || !value.bdata) return value;
    const bytes = Uint8Array.from(atob(value.bdata), letter => letter.charCodeAt(0));
    return value.dtype === "f8" ? new Float64Array(bytes.buffer) : new Float32Array(bytes.buffer);
  }
  const data = JSON.parse(document.getElementById("rille-data").textContent);
  return { show, whenSeen, choose, css, unpacked, data, onChoose: listener => listeners.push(listener) };
})();
