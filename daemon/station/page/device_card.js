/** One drive, encoder, brake or brick as a card. */

import { badge, setBadge } from "./badge.js";
import { allow, attribute, h, number, text } from "./dom.js";
import { Jog } from "./jog.js";
import { Bar, Facts } from "./rows.js";

const DRIVE_STATES = {
  disabled: ["muted", "disabled: power stage off"],
  enabling: ["warn", "enabling"],
  enabled: ["good", "enabled: power stage on"],
  quick_stop: ["warn", "quick stop"],
  fault: ["bad", "fault"],
  unknown: ["warn", "unknown"],
};
const NODE_STATES = {
  ready: ["good", "ready"],
  configuring: ["warn", "being configured"],
  refused: ["bad", "refused: differs from the profile"],
  absent: ["bad", "lost: not heard"],
};
const BRAKE_STATES = {
  engaged: ["good", "engaged: locked"],
  released: ["muted", "released: free"],
  engaging: ["warn", "engaging"],
  releasing: ["warn", "releasing"],
  unknown: ["warn", "unknown"],
};
const LAST = "the last before it was lost";
const CURRENT_LIMIT = "continuous_current_limit";

/** Kind of badge and words of a node's state in its boot-up; whatever else it is called stays as it is. */
export function nodeState(state) {
  return NODE_STATES[state] ?? ["warn", state];
}

/** Its node id, or the brick that it hangs on. */
export function place(node) {
  return node.node == null ? `at brick ${node.brick}` : `node ${node.node}`;
}

/** Head of a card: name, place, state. */
function head(name, where) {
  const state = badge();
  return { state, element: h("header", {}, h("h4", {}, name), h("span", { class: "aside" }, where), state) };
}

function card(label, ...parts) {
  return h("article", { class: "card", "aria-label": label }, parts);
}

/** What is wrong with a device, and what to do. */
function trouble() {
  const what = h("strong");
  const remedy = h("span");
  const element = h("p", { class: "trouble", hidden: true }, "Fault: ", what, " ", remedy);
  const show = (node) => {
    const fault = typeof node.fault === "string" ? { message: node.fault } : node.fault;
    const absent = node.node_state !== "ready" ? { message: node.status } : null;
    const told = fault ?? absent;
    element.hidden = !told;
    text(what, told?.message);
    text(remedy, told?.remedy ? `What to do: ${told.remedy}` : "");
  };
  return { element, show };
}

export class DriveCard {
  #station;
  #name;
  #facts = new Facts();
  #trouble = trouble();
  #current = h("span");
  #bar;
  #limit_a = null;
  #asked = false;
  #statusword;
  #why = h("p", { class: "reason" });

  /**
   * @param {object} station see station.js
   * @param {object} node of `status.nodes`
   */
  constructor(station, node) {
    this.#station = station;
    this.#name = node.name;
    this.head = head(node.name, place(node));
    this.#bar = new Bar(`Current of ${node.name}`);
    this.#current.append(h("span"), h("span", { class: "limit" }), this.#bar.element);
    this.#statusword = new Statusword(station, node.name);
    this.enable = this.#button("Enable", "motor.enable");
    this.disable = this.#button("Disable", "motor.disable");
    this.reset = this.#button("Reset fault", "motor.reset");
    this.jog = new Jog(station, node.name);
    const commands = h("div", { class: "row" }, this.enable, this.disable, this.reset);
    const parts = [this.head.element, this.#trouble.element, this.#facts.element, this.#statusword.element];
    this.element = card(`Drive ${node.name}`, ...parts, commands, this.jog.element, this.#why);
  }

  show(node) {
    const ready = node.node_state === "ready";
    const powered = DRIVE_STATES[node.state] ?? ["warn", node.state];
    setBadge(this.head.state, ...(ready ? powered : nodeState(node.node_state)));
    this.#trouble.show(node);
    this.#facts.show({
      Values: ready ? null : LAST,
      Mode: node.mode,
      Velocity: `${number(node.velocity_rpm, 0)} rpm`,
      Speed: `${number(node.speed_m_s, 3)} m/s`,
      Target: `${number(node.target_speed_m_s, 3)} m/s`,
      Position: `${number(node.position_m, 3)} m`,
      Tacho: node.tacho_deg == null ? null : `${number(node.tacho_deg, 0)}°`,
      Current: this.#currentOf(node),
    });
    this.#statusword.show(node.statusword);
    this.#allow(node, ready ? null : `${node.name} is ${nodeState(node.node_state)[1]}`);
  }

  #currentOf(node) {
    if (node.current_a == null) return null;
    if (!this.#asked && node.node_state === "ready") this.#askLimit();
    const told = `${number(node.current_a, 2)} A`;
    const limit = `of ${number(this.#limit_a, 2)} A continuous`;
    text(this.#current.children[0], told);
    text(this.#current.children[1], limit);
    if (this.#limit_a != null) this.#bar.show(node.current_a, this.#limit_a, `${told} ${limit}`);
    attribute(this.#bar.element, "data-unknown", this.#limit_a == null);
    return this.#current;
  }

  /** The limit is asked of the drive itself, once: there it holds. */
  async #askLimit() {
    this.#asked = true;
    const read = this.#station.call("sdo.read", { node: this.#name, object: CURRENT_LIMIT });
    const found = await read.catch(() => null);
    this.#limit_a = found?.value ? found.value / 1000 : null;
  }

  #allow(node, absent) {
    const reason = (method) => absent ?? this.#station.cannot(method);
    const moving = reason("motor.velocity");
    allow(this.enable, reason("motor.enable"));
    allow(this.disable, reason("motor.disable"));
    allow(this.reset, reason("motor.reset"));
    this.reset.hidden = node.state !== "fault" && !node.fault;
    this.jog.allow(moving);
    text(this.#why, moving ? `Not now: ${moving}` : "");
  }

  #button(words, method) {
    const ask = () => this.#station.attempt(this.#station.call(method, { node: this.#name }), `${words} ${this.#name}`);
    return h("button", { type: "button", onclick: ask, "aria-label": `${words}: ${this.#name}` }, words);
  }
}

/** The statusword of a drive, in words where somebody wants to know. */
class Statusword {
  #station;
  #told = null;
  #title = h("summary");
  #words = h("div");

  constructor(station, drive) {
    this.#station = station;
    this.element = h("details", { hidden: true, "aria-label": `Statusword of ${drive}` }, this.#title, this.#words);
    this.element.addEventListener("toggle", () => this.#explain());
  }

  show(word) {
    this.element.hidden = !word;
    text(this.#title, `Statusword ${word}`);
    this.word = word;
    this.#explain();
  }

  async #explain() {
    if (!this.element.open || this.#told === this.word) return;
    const word = (this.#told = this.word);
    const asked = { code: word, kind: "statusword" };
    const found = await this.#station.attempt(this.#station.call("station.explain", asked), `statusword ${word}`);
    if (word !== this.#told || !found) return;
    const { title, meaning, details, cure } = found.readings[0];
    const bits = Object.entries(details).map(([bit, words]) => h("li", {}, `${bit}: ${words}`));
    this.#words.replaceChildren(h("p", {}, `${title}. ${meaning} ${cure}`), h("ul", {}, bits));
  }
}

/** A card of an encoder. */
export function encoderCard(node) {
  const top = head(node.name, place(node));
  const facts = new Facts();
  const wrong = trouble();
  const show = (now) => {
    setBadge(top.state, ...nodeState(now.node_state));
    wrong.show(now);
    facts.show({
      Values: now.node_state === "ready" ? null : LAST,
      Heading: `${number(now.heading_deg, 2)}°`,
      Sensed: now.sensed_deg == null ? null : `${number(now.sensed_deg, 2)}°`,
      Position: now.position_counts == null ? null : `${now.position_counts} counts`,
    });
  };
  return { element: card(`Encoder ${node.name}`, top.element, wrong.element, facts.element), show };
}

/** A card of an NXT brick. */
export function brickCard(brick) {
  const top = head(brick.name, "NXT brick");
  const facts = new Facts();
  const show = (now) => {
    const told = now.state === "ready" ? ["good", "connected"] : ["bad", now.sentence || now.state];
    setBadge(top.state, ...(now.battery_low ? ["warn", "battery low"] : told));
    facts.show({
      Battery: now.battery_v == null ? null : `${number(now.battery_v, 2)} V${now.battery_low ? " (low)" : ""}`,
      Told: now.sentence,
      Connections: `${now.connections}, lost ${now.losses}`,
      Brick: now.brick,
      Firmware: now.firmware,
      Telegrams: now.line ? `${now.line.sent} sent, ${now.line.replies} answered, ${now.line.bad_replies} bad` : null,
    });
  };
  return { element: card(`Brick ${brick.name}`, top.element, facts.element), show };
}

/** A card of a brake. */
export function brakeCard(brake) {
  const holds = brake.kind === "steering" ? `locks the direction of the ${brake.name} wheels` : `holds ${brake.name}`;
  const top = head(brake.name, holds);
  const facts = new Facts();
  const show = (now) => {
    setBadge(top.state, ...(BRAKE_STATES[now.state] ?? ["warn", now.state]));
    const times = `${number(now.open_time_s, 2)} s to release, ${number(now.close_time_s, 2)} s to engage`;
    facts.show({ "Switched by": now.drive, Takes: times });
  };
  return { element: card(`Brake ${brake.name}`, top.element, facts.element), show };
}
