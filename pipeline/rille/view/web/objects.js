// Everything that the server can read and set: found by name, watched, changed.
import { element, short, spoken } from "./util.js";
import { asked } from "./source.js";
import { picker } from "./picker.js";

const READ_EVERY = 500; // [ms]

export class Objects {
  constructor(place, live) {
    Object.assign(this, { place, live, index: [], watched: [] });
    const { box, input, refresh } = picker({
      label: "find a quantity of an object", placeholder: "Find: e.g. chassis position",
      find: text => this.#find(text), chosen: entry => this.watch(entry),
    });
    this.hint = element("p", { class: "hint", text: "Values are read twice a second; those with a field can be set while you command." });
    this.list = element("div", { class: "watched" });
    place.append(box, this.hint, this.list);
    input.addEventListener("focus", () => this.load().then(refresh), { once: true });
    setInterval(() => this.#read(), READ_EVERY);
  }
  async load() {
    try { this.index = await asked("api/objects"); } catch (error) { this.hint.textContent = `The list of objects cannot be read: ${error.message}`; }
  }
  #find(text) {
    const words = text.toLowerCase().split(/\s+/).filter(Boolean);
    return this.index.filter(entry => { const own = `${entry.target} ${entry.quantity} ${spoken(entry.target)}`.toLowerCase(); return words.every(word => own.includes(word)); })
      .slice(0, 80).map(entry => ({ label: `${entry.target} · ${spoken(entry.quantity)}`, hint: `${entry.unit}${entry.writable ? "  ✎" : ""}`, value: entry }));
  }
  watch(entry) {
    if (this.watched.some(each => each.entry === entry)) return;
    const names = entry.components?.length ? entry.components : [""];
    const values = names.map(() => element("output", { text: "–" }));
    const inputs = entry.writable ? names.map(name => element("input", { type: "number", step: "any", "aria-label": `new ${entry.quantity} of ${entry.target} ${name}` })) : [];
    const form = element("form", { class: "object", on: { submit: event => { event.preventDefault(); this.#set(watched); } } },
      element("header", {}, element("b", { text: `${entry.target} · ${spoken(entry.quantity)}` }), element("span", { class: "unit", text: entry.unit ? `[${entry.unit}]` : "" }),
        element("button", { type: "button", class: "quiet", "aria-label": `stop watching ${entry.target} ${entry.quantity}`, text: "×", on: { click: () => { form.remove(); this.watched = this.watched.filter(each => each !== watched); } } })),
      ...names.map((name, k) => element("label", { class: "row" }, element("span", { text: name }), values[k], inputs[k] ?? "")),
      entry.writable ? element("button", { type: "submit", text: "Set" }) : "");
    const watched = { entry, values, inputs, now: [] };
    this.watched.push(watched); this.list.prepend(form); this.#read();
  }
  async #set(watched) { // fields left empty keep their value
    const given = watched.inputs.map(input => input.value);
    try {
      if (given.includes("")) await this.#look(watched); // what was read before may be half a second old
    } catch (error) { this.live.say(`The present values cannot be read: ${error.message} Fill every field.`, "bad"); return; }
    const values = given.map((text, k) => text === "" ? watched.now[k] : Number(text));
    if (!values.every(Number.isFinite)) { this.live.say("Not all present values are known; fill every field.", "bad"); return; }
    const answer = await this.live.ask("set", { quantity: watched.entry.quantity, target: watched.entry.target, values });
    if (answer.accepted) { for (const input of watched.inputs) input.value = ""; this.#read(); }
  }
  async #read() {
    if (!this.watched.length || !this.place.offsetParent || this.reading) return;
    this.reading = true;
    for (const watched of this.watched) {
      try { await this.#look(watched); } catch { for (const output of watched.values) output.textContent = "–"; } // why, the line's own sentence tells
    }
    this.reading = false;
  }
  async #look(watched) {
    const { values } = await asked(`api/objects/${encodeURIComponent(watched.entry.quantity)}/${encodeURIComponent(watched.entry.target)}`);
    watched.now = values;
    watched.values.forEach((output, k) => { output.textContent = short(values[k], 5); });
  }
}
