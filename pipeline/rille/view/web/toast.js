// Short sentences that come and go: answers, refusals, events.
import { byId, element } from "./util.js";

const shownAt = new Map();

export function toast(text, tone = "") {
  const now = performance.now(), key = tone + text;
  if (now - (shownAt.get(key) ?? -Infinity) < 4000) return; // the same sentence again and again is told once
  shownAt.set(key, now);
  if (shownAt.size > 200) shownAt.delete(shownAt.keys().next().value);
  const made = element("div", { class: `toast ${tone}` }, element("span", { text }), element("button", { class: "quiet", type: "button", "aria-label": "close", text: "×", on: { click: () => made.remove() } }));
  const place = byId("toasts");
  place.append(made);
  while (place.children.length > 3) place.firstChild.remove();
  setTimeout(() => made.remove(), tone === "bad" ? 9000 : 5000);
}

export function banner(text, tone = "") { // stays until it is told otherwise
  const place = byId("banner");
  place.hidden = !text; place.className = tone;
  place.textContent = text ?? "";
}
