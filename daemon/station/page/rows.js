/** Lists and tables whose rows stay as long as what they show. */

import { attribute, h, text } from "./dom.js";

/** One element for each of several items, kept by key. */
export class Rows {
  #shown = new Map();

  /**
   * @param {HTMLElement} parent holds the elements, and nothing else
   * @param {function(object): {element: HTMLElement, show: function(object): void}} make an element for an item
   * @param {function(object): any} keyOf tells items apart
   */
  constructor(parent, make, keyOf = (item) => item.name) {
    this.parent = parent;
    this.make = make;
    this.keyOf = keyOf;
  }

  /** Show these items, in this order. */
  show(items) {
    const before = this.#shown;
    this.#shown = new Map(items.map((item) => [this.keyOf(item), before.get(this.keyOf(item)) ?? this.make(item)]));
    const elements = [...this.#shown.values()].map((row) => row.element);
    const same = elements.length === this.parent.childElementCount;
    if (!same || elements.some((element, at) => element !== this.parent.children[at])) {
      this.parent.replaceChildren(...elements);
    }
    for (const item of items) this.#shown.get(this.keyOf(item)).show(item);
  }
}

/**
 * A table that screen readers can name.
 *
 * @param {string} caption what it is
 * @param {string[]} heads of its columns
 * @returns {{table: HTMLElement, body: HTMLElement}} the rows go into the body
 */
export function table(caption, heads) {
  const body = h("tbody");
  const row = h("tr", {}, heads.map((head) => h("th", { scope: "col" }, head)));
  return { table: h("table", {}, h("caption", {}, caption), h("thead", {}, row), body), body };
}

/** A list of facts: `show` takes the values by their labels, those without a value are left out. */
export class Facts {
  #rows;

  constructor(attributes = {}) {
    this.element = h("dl", { class: "facts", ...attributes });
    this.#rows = new Rows(this.element, makeFact, (item) => item.label);
  }

  /** @param {Object<string, string|HTMLElement|null>} values by label */
  show(values) {
    const items = Object.entries(values).map(([label, value]) => ({ label, value }));
    this.#rows.show(items.filter((item) => item.value != null && item.value !== ""));
  }
}

function makeFact({ label }) {
  const told = h("dd");
  const show = ({ value }) => {
    if (!(value instanceof Node)) text(told, value);
    else if (told.firstChild !== value) told.replaceChildren(value);
  };
  return { element: h("div", {}, h("dt", {}, label), told), show };
}

/** A bar from nothing to a limit, told in words, too. */
export class Bar {
  #filled = h("span");

  /** @param {string} label of what it shows */
  constructor(label) {
    this.element = h("span", { class: "bar-of", role: "meter", "aria-label": label, "aria-valuemin": 0 }, this.#filled);
  }

  /**
   * @param {number} value of it
   * @param {number} limit where the bar ends
   * @param {string} words the same for people
   */
  show(value, limit, words) {
    const share = Math.min(1, Math.abs(value) / limit);
    attribute(this.element, "aria-valuemax", limit);
    attribute(this.element, "aria-valuenow", Math.min(limit, Math.abs(value)));
    attribute(this.element, "aria-valuetext", words);
    attribute(this.element, "data-full", share > 0.9);
    this.#filled.style.width = `${Math.round(share * 100)}%`;
  }
}
