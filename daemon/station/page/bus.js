/** The bus, the control cycle, the recording and the socket: numbers, and what is counted of trouble. */

import { badge, setBadge } from "./badge.js";
import { h, number, text } from "./dom.js";
import { Bar, Rows, table } from "./rows.js";

/** Fields that are no counters of trouble, by section: label and digits, or how to tell them; null: not shown. */
const PLAIN = {
  bus: {
    name: ["Interface"],
    bit_rate: ["Bit rate", (rate) => (rate >= 1e6 ? `${rate / 1e6} Mbit/s` : `${rate / 1e3} kbit/s`)],
    baud: ["Serial line", (baud) => `${baud} baud`],
    load: null,
    received: ["Frames received"],
    sent: ["Frames sent"],
    exchanges: ["Exchanges"],
    line_utilisation: ["Line in use", percent],
    own_idle_share: ["Line idle on our side", percent],
    controller: ["Controller"],
    last_error: ["Last error"],
    remedy: ["What to do"],
    receive_buffer_frames: ["Receive buffer", (count) => `${count} frames`],
  },
  cycle: {
    hz: ["Wanted", (rate) => `${number(rate, 1)} Hz`],
    achieved_hz: ["Achieved", (rate) => `${number(rate, 1)} Hz`],
    cycles: ["Cycles"],
    max_lateness_ms: ["Greatest lateness", (late) => `${number(late, 2)} ms`],
    stood_still_s: ["Daemon stood still", (time) => `${number(time, 2)} s`],
  },
  recording: { path: ["Log"], frames: ["Frames recorded"], failing: null },
  api: { pid: ["Process of the daemon"], clients: ["Clients"], requests: ["Requests"] },
};
const FACT = /^(planned_|speed_limit_|silent_line_)/;
/** Name of the interface of a robot without a CAN bus. */
const NO_BUS = "none";
/** Time for which a counter that has grown is said to be growing. */
const GROWING_MS = 3000;

function percent(share) {
  return `${number(100 * share, 1)} %`;
}

/** The name of a field in words: `late_answers` is `Late answers`. */
function labelOf(key) {
  const words = key.replaceAll("_", " ");
  return words[0].toUpperCase() + words.slice(1);
}

/** A table of one section of the status. */
class Section {
  #rows;

  constructor(name, caption) {
    this.name = name;
    const { table: element, body } = table(caption, ["What", "Value"]);
    this.element = h("div", { class: "scroll counters", hidden: true }, element);
    this.#rows = new Rows(body, makeRow, (item) => item.key);
  }

  show(values) {
    this.element.hidden = !values;
    const known = PLAIN[this.name];
    const entries = Object.entries(values ?? {}).filter(([key, value]) => known[key] !== null && !isEmpty(value));
    this.#rows.show(entries.map(([key, value]) => itemOf(key, value, known[key])));
  }
}

function isEmpty(value) {
  return value === null || value === "" || (Array.isArray(value) && !value.length);
}

function itemOf(key, value, plain) {
  const [label, tell] = plain ?? [labelOf(key)];
  const counts = !plain && !FACT.test(key);
  return { key, label, counts, value, words: tell ? tell(value) : String(value) };
}

function makeRow({ label }) {
  const value = h("span");
  const how = badge();
  const cell = h("td", {}, value, how);
  let before = null;
  let grown_ms = -Infinity;
  const show = (item) => {
    text(value, item.words);
    cell.classList.toggle("words", item.words.length > 20);
    how.hidden = !item.counts;
    if (before !== null && item.value > before) grown_ms = performance.now();
    before = item.value;
    setBadge(how, ...judged(item.value, performance.now() - grown_ms < GROWING_MS));
  };
  return { element: h("tr", {}, h("th", { scope: "row" }, label), cell), show };
}

/** How a counter of trouble is: kind of badge and word. */
function judged(value, growing) {
  if (value === 0 || value === false) return ["good", "none"];
  if (growing || typeof value !== "number") return ["bad", growing ? "growing" : "trouble"];
  return ["warn", "counted earlier"];
}

/** Bus, cycle, recording and API in one element; `show` takes the status. */
export class BusTables {
  #bar = new Bar("Bus load");
  #words = h("span");
  #load = h("p", {}, "Bus load ", this.#words, this.#bar.element);
  #alarm = h("p", { class: "trouble", hidden: true });
  #sections = [
    new Section("bus", "Bus"),
    new Section("cycle", "Control cycle"),
    new Section("recording", "Recording"),
    new Section("api", "Clients of the daemon"),
  ];

  constructor() {
    const tables = h("div", { class: "cards" }, this.#sections.map((section) => section.element));
    this.element = h("div", { class: "network" }, this.#load, this.#alarm, tables);
  }

  show(status) {
    const bus = status.bus?.name === NO_BUS ? null : status.bus;
    this.#showLoad(bus);
    const { failing, path, lost } = status.recording ?? {};
    this.#alarm.hidden = !failing;
    const remedy = "make room on its disk: recording goes on by itself";
    text(this.#alarm, failing ? `The log ${path} cannot be written, ${lost} frames are lost: ${remedy}` : "");
    for (const section of this.#sections) section.show(section.name === "bus" ? bus : status[section.name]);
  }

  #showLoad(bus) {
    this.#load.hidden = !bus;
    if (!bus) return;
    text(this.#words, percent(bus.load));
    this.#bar.show(bus.load, 1, percent(bus.load));
  }
}
