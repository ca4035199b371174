/** Faults of the simulated network: those that were set, and a form for another one. */

import { badge, setBadge } from "./badge.js";
import { allow, h, text } from "./dom.js";
import { field, numberIn, settleWriting, wrongIn } from "./fields.js";
import { Rows, table } from "./rows.js";

const STATES = { waiting: "muted", acting: "bad", over: "good" };
/** Fields that are written in hexadecimal, too. */
const CODES = ["cob_id", "code", "value"];
/** Fields that say which frames and when, more finely than most people ask. */
const FINE = ["at_s", "at_frame", "nth", "times", "probability", "cob_id", "object"];
const NUMBERS = ["number", "integer"];
const TOLD_APART = ["fault", "kind", "part", "state", "struck"];

/** The faults that were set, each with a button that takes it away. */
export class FaultList {
  #station;
  #changed;
  #rows;
  #none = h("p", { class: "aside" }, "No fault is set.");
  #scroll;
  #clearAll;

  /**
   * @param {object} station see station.js
   * @param {function(): void} changed is called when a fault was taken away
   */
  constructor(station, changed) {
    this.#station = station;
    this.#changed = changed;
    const { table: element, body } = table("Faults that were set", ["Fault", "Part", "State", "Struck", "Clear"]);
    this.#rows = new Rows(body, (item) => this.#row(item), (item) => item.fault);
    this.#clearAll = h("button", { type: "button", onclick: () => this.#clear() }, "Clear all faults");
    this.#scroll = h("div", { class: "scroll" }, element);
    this.element = h("div", {}, this.#none, this.#scroll, this.#clearAll);
  }

  /** @param {object[]} faults as `simulation.faults` tells them */
  show(faults) {
    this.#none.hidden = faults.length > 0;
    this.#scroll.hidden = this.#clearAll.hidden = !faults.length;
    this.#rows.show(faults);
    allow(this.#clearAll, this.#station.cannot("simulation.clear_faults"));
  }

  #row({ fault, ...told }) {
    const state = badge();
    const struck = h("td");
    const more = Object.entries(told).filter(([key]) => !TOLD_APART.includes(key));
    const details = more.map(([key, value]) => `${key} ${CODES.includes(key) ? hexadecimal(value) : value}`).join(", ");
    const clear = h("button", { type: "button", onclick: () => this.#clear(fault) }, "Clear");
    clear.setAttribute("aria-label", `Clear fault ${fault}: ${told.kind}`);
    const aside = details && h("span", { class: "aside" }, ` ${details}`);
    const what = h("th", { scope: "row" }, `${fault}: ${told.kind}`, aside);
    const cells = [h("td", {}, told.part ?? "–"), h("td", {}, state), struck, h("td", {}, clear)];
    const show = (now) => {
      setBadge(state, STATES[now.state] ?? "warn", now.state);
      text(struck, now.struck);
      allow(clear, this.#station.cannot("simulation.clear_faults"));
    };
    return { element: h("tr", {}, what, cells), show };
  }

  async #clear(fault = null) {
    const asked = this.#station.call("simulation.clear_faults", fault === null ? {} : { fault });
    await this.#station.attempt(asked, fault === null ? "clearing all faults" : `clearing fault ${fault}`);
    this.#changed();
  }
}

function hexadecimal(value) {
  return `0x${value.toString(16).toUpperCase()}`;
}

/** The form for a new fault: of a kind it shows the parameters that this kind takes, and no others. */
export class FaultForm {
  #station;
  #changed;
  #kinds = [];
  #fields = {};
  #names = {};
  #inputs = new Map();
  #kind = h("select", { onchange: () => this.#showFields() });
  #shown = h("div", { class: "fields" });
  #fine = h("div", { class: "fields" });
  #details = h("details", {}, h("summary", {}, "When, and which frames"), this.#fine);
  #set = h("button", { type: "submit" }, "Set this fault");
  #why = h("p", { class: "reason" });

  constructor(station, changed) {
    this.#station = station;
    this.#changed = changed;
    const kind = h("label", {}, "Kind of fault ", this.#kind);
    this.element = h("form", { class: "fault-form", "aria-label": "New fault" }, kind, this.#shown, this.#details,
      this.#set, this.#why);
    this.element.addEventListener("submit", (event) => {
      event.preventDefault();
      this.#ask();
    });
  }

  /**
   * Offer the kinds that this robot may have.
   *
   * @param {{kinds: object[], fields: object}} told by `station.fault_kinds`
   * @param {Object<string, string[]>} names of its parts by section of the profile
   */
  offer({ kinds, fields }, names) {
    const chosen = this.#kind.value;
    [this.#fields, this.#names] = [fields, names];
    this.#kinds = kinds.filter(({ parts }) => !parts.length || this.#partsOf(parts).length);
    const options = this.#kinds.map(({ kind, summary }) => h("option", { value: kind }, `${kind}: ${summary}`));
    this.#kind.replaceChildren(...options);
    if (this.#kinds.some(({ kind }) => kind === chosen)) this.#kind.value = chosen;
    this.#showFields();
  }

  /** See what may be done now. */
  look() {
    const reason = this.#station.cannot("simulation.fault");
    allow(this.#set, reason);
    text(this.#why, reason ? `Not now: ${reason}` : "");
  }

  #partsOf(sections) {
    return sections.flatMap((section) => this.#names[section] ?? []);
  }

  #showFields() {
    const kind = this.#kinds.find(({ kind: name }) => name === this.#kind.value);
    if (!kind) return;
    this.#inputs.clear();
    const isFine = (name) => FINE.includes(name) && !kind.needs.includes(name);
    const make = (names) => names.map((name) => this.#field(name, kind));
    const names = [...kind.needs, ...kind.takes];
    this.#shown.replaceChildren(...make(names.filter((name) => !isFine(name))));
    this.#fine.replaceChildren(...make(names.filter(isFine)));
    this.#details.hidden = !this.#fine.childElementCount;
  }

  #field(name, { parts, needs }) {
    const { doc, unit } = this.#fields[name];
    const needed = needs.includes(name);
    const hint = h("small", { id: `fault-${name}` }, doc);
    const told = `${name.replace(/_(s|deg)$/, "").replaceAll("_", " ")}${unit ? ` (${unit})` : ""}`;
    const label = needed ? `${told} (needed)` : told;
    const attributes = { required: needed, "aria-describedby": hint.id };
    const input = name === "part" ? partInput(this.#partsOf(parts), attributes) : this.#input(name, label, attributes);
    this.#inputs.set(name, input);
    return h("div", { class: "field" }, h("label", {}, `${label} `, input), hint);
  }

  #input(name, label, attributes) {
    const { type, minimum, maximum } = this.#fields[name];
    if (this.#isNumber(name)) {
      return field(label, { min: minimum, max: maximum, whole: type === "integer", ...attributes }, () => {});
    }
    const pattern = CODES.includes(name) ? "0x[0-9A-Fa-f]+|[0-9]+" : null;
    return h("input", { type: "text", pattern, autocomplete: "off", spellcheck: "false", ...attributes });
  }

  #isNumber(name) {
    return NUMBERS.includes(this.#fields[name].type) && !CODES.includes(name);
  }

  async #ask() {
    settleWriting();
    if (wrongIn(this.#fine)) this.#details.open = true;
    if (wrongIn(this.element)) return;
    const asked = { kind: this.#kind.value };
    for (const [name, input] of this.#inputs) if (input.value) asked[name] = this.#valueOf(name, input);
    const set = await this.#station.attempt(this.#station.call("simulation.fault", asked), `fault ${asked.kind}`);
    if (set) this.#station.say(`fault ${set.fault} (${set.kind}) is ${set.state}`);
    this.#changed();
  }

  #valueOf(name, input) {
    if (this.#isNumber(name)) return numberIn(input);
    const written = input.value.trim();
    return NUMBERS.includes(this.#fields[name].type) ? Number(written) : written;
  }
}

function partInput(names, { required, ...attributes }) {
  const any = required ? [] : [h("option", { value: "" }, "any")];
  return h("select", attributes, any, names.map((name) => h("option", { value: name }, name)));
}
