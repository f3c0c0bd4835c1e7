// A field that completes what is typed from a list: a combobox with its listbox, by mouse and by keys.
import { element } from "./util.js";

let picked = 0;

export function picker({ label, placeholder, find, chosen }) { // find(text) -> [{label, hint, value}]
  const id = `picker-${picked++}`;
  const input = element("input", { type: "search", placeholder, role: "combobox", "aria-label": label, "aria-expanded": "false", "aria-controls": id, "aria-autocomplete": "list", autocomplete: "off", spellcheck: "false" });
  const list = element("ul", { role: "listbox", id, hidden: true });
  const box = element("div", { class: "picker" }, input, list);
  let options = [], at = -1;

  function open() {
    options = find(input.value); at = input.value && options.length ? 0 : -1;
    list.replaceChildren(...options.map((option, k) => element("li", {
      role: "option", id: `${id}-${k}`, "aria-selected": String(k === at),
      on: { pointerdown: event => { event.preventDefault(); choose(k); } },
    }, element("span", { text: option.label }), element("small", { text: option.hint ?? "" }))));
    if (!options.length) list.append(element("li", { class: "none", text: "nothing of that name" }));
    list.hidden = false; input.setAttribute("aria-expanded", "true"); mark();
  }
  function close() { list.hidden = true; input.setAttribute("aria-expanded", "false"); input.removeAttribute("aria-activedescendant"); }
  function mark() {
    [...list.children].forEach((item, k) => item.setAttribute("aria-selected", String(k === at)));
    if (at >= 0) { input.setAttribute("aria-activedescendant", `${id}-${at}`); list.children[at].scrollIntoView({ block: "nearest" }); }
  }
  function choose(k) {
    const option = options[k];
    if (!option) return;
    input.value = "";
    close(); chosen(option.value);
  }
  input.addEventListener("input", open);
  input.addEventListener("focus", open);
  input.addEventListener("blur", close);
  input.addEventListener("keydown", event => {
    if (event.key === "ArrowDown" || event.key === "ArrowUp") {
      event.preventDefault();
      if (list.hidden) open();
      if (options.length) at = (at + (event.key === "ArrowDown" ? 1 : -1) + options.length) % options.length;
      mark();
    } else if (event.key === "Enter") { event.preventDefault(); if (at >= 0) choose(at); } else if (event.key === "Escape") { close(); input.blur(); }
  });
  return { box, input, refresh: () => { if (!list.hidden) open(); } }; // refresh: the list to choose from has come
}
