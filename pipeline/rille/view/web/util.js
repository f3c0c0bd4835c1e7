// Small helpers: elements, numbers, listeners. Texts become text nodes only, never HTML.
export const byId = id => document.getElementById(id);
export const clamp = (value, low, high) => Math.min(high, Math.max(low, value));
export const smooth = (low, high, value) => { const u = clamp((value - low) / (high - low), 0, 1); return u * u * (3 - 2 * u); };
export const calm = matchMedia("(prefers-reduced-motion: reduce)");

export function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined || value === null) continue;
    if (name === "on") for (const [event, listener] of Object.entries(value)) made.addEventListener(event, listener);
    else if (name === "text") made.textContent = value;
    else if (name === "class") made.className = value;
    else if (name === "style") for (const [key, entry] of Object.entries(value)) made.style.setProperty(key, entry);
    else if (name === "data") Object.assign(made.dataset, value);
    else if (typeof value === "boolean") made.toggleAttribute(name, value);
    else made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

export function short(value, digits = 3) { // a number for a reader
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e-3 && size < 1e5) {
    const places = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
    return value.toFixed(Math.min(places, 6)).replace("-", "−");
  }
  return value.toExponential(digits - 1).replace("-", "−");
}

export function seconds(value) { // 83.25 -> 1:23.25
  if (!Number.isFinite(value)) return "–";
  const sign = value < -0.004 ? "−" : "", size = Math.round(Math.abs(value) * 100) / 100;
  const hours = Math.floor(size / 3600), minutes = Math.floor(size / 60) % 60, rest = (size % 60).toFixed(2).padStart(5, "0");
  return sign + (hours ? `${hours}:${String(minutes).padStart(2, "0")}:${rest}` : `${minutes}:${rest}`);
}

export const spoken = name => String(name).replaceAll("_", " ");

export class Listeners {
  #of = new Map();
  on(event, listener) { this.#of.set(event, [...(this.#of.get(event) ?? []), listener]); return this; }
  emit(event, ...values) { for (const listener of this.#of.get(event) ?? []) listener(...values); }
}

export function niceStep(span, count) { // 1, 2 or 5 times a power of ten
  const raw = span / Math.max(1, count), power = 10 ** Math.floor(Math.log10(raw)), lead = raw / power;
  return (lead < 1.5 ? 1 : lead < 3.5 ? 2 : lead < 7.5 ? 5 : 10) * power;
}

export function typing(event) { // is the key meant for a field?
  const at = event.target;
  return at instanceof HTMLElement && (at.isContentEditable || at.matches("input:not([type=range]):not([type=checkbox]), select, textarea"));
}

export function toggle(button, value) { button.setAttribute("aria-pressed", String(value)); }
