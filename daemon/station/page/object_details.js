/** One object of a node: what it is, its value, and the way to write it. */

import { allow, h, text } from "./dom.js";
import { Facts } from "./rows.js";

const AGAIN_MS = 1000;
const ACCESS = { ro: "read only", wo: "write only", rw: "read and write", const: "constant, read only" };

export class ObjectDetails {
  #station;
  #node = null;
  #facts = new Facts();
  #title = h("h3");
  #value = h("p", { class: "value" });
  #read = h("button", { type: "button", onclick: () => this.#readNow() }, "Read");
  #again = h("input", { type: "checkbox" });
  #reading = h("div", { class: "row" }, this.#read, h("label", { class: "tick" }, this.#again, "again each second"));
  #writer;
  #under_way = false;

  constructor(station) {
    this.#station = station;
    this.#writer = new ObjectWriter(station, () => this.#readNow());
    this.element = h("section", { class: "card", "aria-label": "Chosen object", hidden: true }, this.#title,
      this.#facts.element, this.#reading, this.#value, this.#writer.element);
    setInterval(() => this.#readAgain(), AGAIN_MS);
  }

  /** Show an object of a node; null: none. */
  choose(node, entry) {
    const same = node === this.#node && entry === this.entry;
    [this.#node, this.entry] = [node, entry];
    this.element.hidden = !entry;
    if (!entry || same) return;
    const range = [entry.low, entry.high].some((limit) => limit != null);
    text(this.#title, `${entry.object} ${entry.name.replaceAll("_", " ")} of ${node}`);
    this.#facts.show({
      Meaning: entry.meaning,
      Type: entry.type,
      Access: ACCESS[entry.access],
      Unit: entry.unit,
      Limits: range ? `${entry.low ?? "–"} to ${entry.high ?? "–"}` : null,
      Firmware: entry.firmware === "later" ? "later firmware only: a drive may lack it" : null,
      Cause: entry.cause,
      "What to do": entry.cure,
    });
    this.#again.checked = false;
    this.#reading.hidden = entry.access === "wo";
    text(this.#value, "");
    this.#writer.choose(node, entry);
    this.look();
    if (entry.access !== "wo") this.#readNow();
    this.element.scrollIntoView({ block: "nearest" });
  }

  /** See what may be done now. */
  look() {
    allow(this.#read, this.#station.cannot("sdo.read"));
    this.#writer.look();
  }

  #readAgain() {
    const visible = this.entry && !this.element.closest("[hidden]") && !document.hidden;
    if (visible && this.#again.checked && this.#station.connected) this.#readNow();
  }

  /** Not twice at once: a node that does not answer is waited for. */
  async #readNow() {
    if (this.#under_way || !this.entry) return;
    const [node, entry] = [this.#node, this.entry];
    this.#under_way = true;
    const words = await this.#station.call("sdo.read", { node, object: entry.object }).then(valueOf, wordsOf);
    this.#under_way = false;
    if (node === this.#node && entry === this.entry) text(this.#value, words);
    else this.#readNow();
  }
}

/** A value in all its readings. */
export function valueOf({ value, unit, hex, words }) {
  const readings = [hex, words].filter(Boolean).join(", ");
  const told = `${value === "" ? "(empty)" : value}${unit ? ` ${unit}` : ""}`;
  return readings ? `${told} (${readings})` : told;
}

/** An error in the daemon's words, with what to do. */
export function wordsOf(error) {
  return error.remedy ? `Failed: ${error.message}. What to do: ${error.remedy}` : `Failed: ${error.message}`;
}

/** Writes an object, once somebody has seen the old and the new value; the stop stays in reach meanwhile. */
class ObjectWriter {
  #station;
  #written;
  #input = h("input", { type: "text", autocomplete: "off", spellcheck: "false" });
  #ask = h("button", { type: "submit" }, "Write…");
  #form = h("form", { class: "row" }, h("label", {}, "New value ", this.#input), this.#ask);
  #why = h("p", { class: "reason" });
  #question = h("p");
  #yes = h("button", { type: "button", onclick: () => this.#write() }, "Write it");
  #no = h("button", { type: "button", onclick: () => this.#calm() }, "Cancel");
  #confirm = h("div", { class: "question", role: "group", "aria-label": "Confirm the write", hidden: true },
    this.#question, this.#yes, " ", this.#no);
  #result = h("p", { class: "value", role: "status" });

  /**
   * @param {object} station see station.js
   * @param {function(): void} written is called after a write
   */
  constructor(station, written) {
    this.#station = station;
    this.#written = written;
    this.#form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.#prepare();
    });
    this.element = h("div", {}, this.#form, this.#why, this.#confirm, this.#result);
  }

  choose(node, entry) {
    [this.node, this.entry] = [node, entry];
    this.element.hidden = !["rw", "wo"].includes(entry.access);
    this.#input.value = "";
    text(this.#result, "");
    this.#calm();
  }

  look() {
    const reason = this.#station.cannot("sdo.write");
    for (const control of [this.#input, this.#ask, this.#yes]) allow(control, reason);
    text(this.#why, reason ? `Writing: ${reason}` : "");
  }

  async #prepare() {
    const { node, entry } = this;
    const wanted = this.#input.value.trim();
    if (!wanted) return;
    text(this.#result, "");
    const old = entry.access === "wo" ? "not readable" : await this.#old();
    if (entry !== this.entry || node !== this.node) return;
    this.wanted = wanted;
    const name = `${entry.object} ${entry.name.replaceAll("_", " ")}`;
    text(this.#question, `${name} of ${node} is ${old}. Write ${wanted}${entry.unit ? ` ${entry.unit}` : ""}?`);
    this.#confirm.hidden = false;
    this.#no.focus();
  }

  #old() {
    const read = this.#station.call("sdo.read", { node: this.node, object: this.entry.object });
    return read.then(valueOf, () => "not known");
  }

  async #write() {
    const asked = { node: this.node, object: this.entry.object, value: this.wanted };
    this.#calm();
    const words = await this.#station.call("sdo.write", asked).then(() => `Written: ${asked.value}`, wordsOf);
    if (asked.node !== this.node || asked.object !== this.entry.object) return;
    text(this.#result, words);
    this.#input.focus();
    if (this.entry.access !== "wo") this.#written();
  }

  #calm() {
    this.#confirm.hidden = true;
  }
}
