/** The panel of events: what happened, why, and what to do; the newest first. */

import { badge } from "./badge.js";
import { attribute, h, text } from "./dom.js";
import { clockTime, inPageWords } from "./words.js";

const MOST = 500;
/** Kind of badge by severity; the word is the severity itself. */
const KINDS = { info: "muted", warning: "warn", error: "bad" };
/** Severities that a choice of the filter shows. */
const SHOWN = { all: ["info", "warning", "error"], warning: ["warning", "error"], error: ["error"] };

/** What has happened since the page was opened, in all its connections; bounded, each event once. */
export class EventLog {
  #known = new Set();

  constructor() {
    /** The newest first. */
    this.events = [];
  }

  /** Whether this event of a robot was added. */
  knows(event, robot) {
    return this.#known.has(keyOf(event, robot));
  }

  /**
   * @param {object} event as the daemon tells it
   * @param {string} robot whose daemon
   * @param {number} at_ms when it was, since 1970
   * @returns {object|null} what was added; null where it is known
   */
  add(event, robot, at_ms) {
    const key = keyOf(event, robot);
    if (this.#known.has(key)) return null;
    this.#known.add(key);
    const added = { ...event, robot, at_ms, key };
    const place = this.events.findIndex((other) => other.at_ms <= at_ms);
    this.events.splice(place < 0 ? this.events.length : place, 0, added);
    while (this.events.length > MOST) this.#known.delete(this.events.pop().key);
    return added;
  }
}

function keyOf({ time_s, source, message }, robot) {
  return [robot, time_s, source, message].join("\n");
}

/** An event in one line, for a letter to somebody. */
export function lineOf({ robot, at_ms, severity, source, message, remedy }) {
  const told = remedy ? `${message} (${remedy})` : message;
  return `${new Date(at_ms).toISOString()} ${robot} ${severity} ${source}: ${told}`;
}

function rowOf({ robot, at_ms, severity, source, message, remedy }) {
  const when = h("time", { datetime: new Date(at_ms).toISOString() }, clockTime(at_ms));
  const top = h("p", { class: "aside" }, when, " ", badge(KINDS[severity] ?? "warn", severity), ` ${robot}: ${source}`);
  return h("li", { class: "event", "data-severity": severity }, top, h("p", {}, inPageWords(message)),
    remedy && h("p", { class: "remedy" }, `What to do: ${inPageWords(remedy)}`));
}

class EventsPanel {
  #station;
  #log = new EventLog();
  #unread = 0;
  #list = h("ol", { class: "events", "aria-label": "Events, the newest first" });
  #told = h("p", { class: "aside", role: "status" });
  #severity;
  #search;

  constructor(station) {
    this.#station = station;
    const choices = [["all", "all"], ["warning", "warnings and errors"], ["error", "errors"]];
    const options = choices.map(([value, words]) => h("option", { value }, words));
    this.#severity = h("select", { onchange: () => this.#filter() }, options);
    this.#search = h("input", { type: "search", oninput: () => this.#filter() });
    const copy = h("button", { type: "button", onclick: () => this.#copy() }, "Copy as text");
    const tools = h("div", { class: "row" }, h("label", {}, "Show ", this.#severity),
      h("label", {}, "that hold ", this.#search), copy);
    this.element = h("section", { class: "events-panel" }, h("h2", {}, "Events"), tools, this.#told, this.#list);
    station.on("event", (event) => this.#take([event]));
    station.on("status", (status) => this.#takeAll(status));
    station.on("robot", () => this.#read());
    addEventListener("hashchange", () => this.#read());
    this.#filter();
  }

  /** A status tells the last events, too: those that came while there was no connection. */
  #takeAll({ events }) {
    this.#read();
    const latest = events?.at(-1);
    if (!latest || this.#log.knows(latest, this.#station.robot)) return;
    this.#take(events);
  }

  /** The daemon dates an event as it dates the lines of its log; one that is older than this page does not. */
  #take(events) {
    const added = events.map((event) => this.#add(event, 1000 * event.unix_s || Date.now())).filter(Boolean);
    if (!added.length) return;
    if (!this.#isVisible()) this.#unread += added.filter((event) => event.severity !== "info").length;
    this.#tellUnread();
    this.#tellCount();
  }

  /** The rows stand as their events do. */
  #add(event, at_ms) {
    const added = this.#log.add(event, this.#station.robot, at_ms);
    const place = this.#log.events.indexOf(added);
    if (place < 0) return null;
    const row = rowOf(added);
    row.hidden = !this.#isWanted(added);
    this.#list.insertBefore(row, this.#list.children[place] ?? null);
    if (this.#list.childElementCount > this.#log.events.length) this.#list.lastElementChild.remove();
    return added;
  }

  #isWanted({ severity, source, message, remedy }) {
    const wanted = this.#search.value.trim().toLowerCase();
    const words = `${source} ${message} ${remedy}`.toLowerCase();
    return SHOWN[this.#severity.value].includes(severity) && words.includes(wanted);
  }

  #filter() {
    this.#log.events.forEach((event, at) => (this.#list.children[at].hidden = !this.#isWanted(event)));
    this.#tellCount();
  }

  #isVisible() {
    return !this.element.hidden && !document.hidden;
  }

  #read() {
    if (!this.#unread || !this.#isVisible()) return;
    this.#unread = 0;
    this.#tellUnread();
  }

  /** The number stands on the tab, which style.css shows and `aria-label` tells. */
  #tellUnread() {
    const tab = document.querySelector('[data-tab="events"]');
    if (!tab) return;
    attribute(tab, "data-unread", this.#unread || null);
    attribute(tab, "aria-label", this.#unread ? `Events: ${this.#unread} new warnings or errors` : null);
  }

  #tellCount() {
    const all = this.#log.events.length;
    const shown = this.#wanted().length;
    text(this.#told, all ? `${shown} of ${all} events` : "Nothing has happened yet.");
  }

  #wanted() {
    return this.#log.events.filter((event) => this.#isWanted(event));
  }

  async #copy() {
    const wanted = this.#wanted();
    await copyText(wanted.map(lineOf).join("\n"));
    this.#station.say(`${wanted.length} events copied`);
  }
}

/** Browsers keep the clipboard from pages of other machines that come without TLS; a selection may be copied there. */
async function copyText(words) {
  if (navigator.clipboard) return navigator.clipboard.writeText(words);
  const area = h("textarea", { class: "unseen", "aria-hidden": "true" });
  area.value = words;
  document.body.append(area);
  area.select();
  document.execCommand("copy");
  area.remove();
  return undefined;
}

/** The panel. */
export function create(station) {
  return new EventsPanel(station).element;
}
