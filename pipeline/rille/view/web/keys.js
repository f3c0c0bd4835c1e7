// Keys, and the dialog that tells them.
import { byId, element, typing } from "./util.js";

export class Keys {
  constructor() {
    this.of = new Map(); this.rows = []; this.dialog = byId("help");
    byId("help-button").addEventListener("click", () => this.help());
    byId("help-close").addEventListener("click", () => this.dialog.close());
    addEventListener("keydown", event => this.#pressed(event));
    addEventListener("click", event => { if (event.detail) event.target.closest?.("button")?.blur(); }); // clicked by mouse: space is not its key then
  }
  on(keys, text, act) { // keys: event.key values
    for (const key of keys) this.of.set(key, act);
    this.rows.push([keys, text]);
  }
  tell(shown, text) { this.rows.push([shown, text]); }
  #pressed(event) {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || typing(event) || this.dialog.open) return;
    if (event.key === " " && event.target instanceof HTMLElement && event.target.matches("button, summary, input[type=checkbox]")) return; // that button's own key
    const act = this.of.get(event.key.length === 1 ? event.key.toLowerCase() : event.key);
    if (act) { event.preventDefault(); act(event); }
  }
  help() {
    byId("help-list").replaceChildren(...this.rows.flatMap(([keys, text]) => [element("dt", {}, ...keys.map(key => element("kbd", { text: NAMES[key] ?? key }))), element("dd", { text })]));
    this.dialog.showModal();
  }
}
const NAMES = { " ": "space", ArrowLeft: "←", ArrowRight: "→", ArrowUp: "↑", ArrowDown: "↓" };
