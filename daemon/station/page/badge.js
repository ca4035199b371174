/** How something is: a word with a shape and a colour, so that none of them has to tell it alone. */

import { attribute, h, text } from "./dom.js";

const SHAPES = { good: "●", warn: "▲", bad: "■", muted: "○" };

/** A badge; `setBadge` fills it. */
export function badge(kind = "muted", word = "") {
  const made = h("span", { class: "badge" }, h("span", { class: "shape", "aria-hidden": "true" }), h("span"));
  setBadge(made, kind, word);
  return made;
}

/**
 * @param {HTMLElement} made by `badge`
 * @param {"good"|"warn"|"bad"|"muted"} kind how good or bad it is
 * @param {string} word what it is
 */
export function setBadge(made, kind, word) {
  attribute(made, "data-kind", kind);
  text(made.firstChild, SHAPES[kind]);
  text(made.lastChild, word);
}
