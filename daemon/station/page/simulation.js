/** The panel of the simulated network: faults, floor, power, blocks, and the speed of time. */

import { allow, h, redraw, seldom, text } from "./dom.js";
import { FaultForm, FaultList } from "./faults.js";
import { Ice, Slope } from "./floor.js";
import { Rows, table } from "./rows.js";

const LOOK_MS = 1000;
const FACTORS = [0.1, 0.25, 0.5, 1, 2, 4];
const OTHER = "other";

/** A titled part of the panel. */
function part(title, ...children) {
  return h("section", { "aria-label": title }, h("h3", {}, title), children);
}

/** Switches the supply of the nodes and bricks. */
class Power {
  #station;
  #rows;
  #all;
  #why = h("p", { class: "reason" });

  constructor(station) {
    this.#station = station;
    const { table: element, body } = table("Supply of the nodes", ["Node", "Told", "Supply"]);
    this.#rows = new Rows(body, (node) => this.#row(node));
    this.#all = this.#switches("all", "all nodes");
    const all = h("div", { class: "row" }, h("span", {}, "All nodes "), this.#all);
    this.element = h("div", {}, h("div", { class: "scroll" }, element), all, this.#why);
  }

  show({ nodes, bricks }) {
    const supplied = (nodes ?? []).filter(({ node }) => node != null);
    this.#rows.show([...supplied, ...(bricks ?? [])]);
    const reason = this.#station.cannot("simulation.power");
    for (const button of this.#all) allow(button, reason);
    text(this.#why, reason ? `Power: ${reason}` : "");
  }

  #row({ name, node }) {
    const told = h("td");
    const buttons = this.#switches(node ?? name, name);
    const head = h("th", { scope: "row" }, node == null ? name : `${node} ${name}`);
    const show = (now) => {
      text(told, now.node_state ?? now.state);
      for (const button of buttons) allow(button, this.#station.cannot("simulation.power"));
    };
    return { element: h("tr", {}, head, told, h("td", {}, h("div", { class: "row" }, buttons))), show };
  }

  #switches(node, name) {
    return [["Off", false], ["On", true]].map(([word, on]) => {
      const ask = () => this.#station.attempt(this.#station.call("simulation.power", { node, on }), `power of ${name}`);
      return h("button", { type: "button", onclick: ask, "aria-label": `${word}: power of ${name}` }, word);
    });
  }
}

/** Puts the robot onto blocks, and down again. */
class Blocks {
  #station;
  #changed;
  #told = h("span", { role: "status" });
  #up = h("button", { type: "button", onclick: () => this.#lift(true) }, "Put onto blocks");
  #down = h("button", { type: "button", onclick: () => this.#lift(false) }, "Put down");

  /**
   * @param {object} station see station.js
   * @param {function(): void} changed is called when the robot was lifted or put down
   */
  constructor(station, changed) {
    this.#station = station;
    this.#changed = changed;
    this.element = h("div", { class: "row" }, this.#up, this.#down, this.#told);
  }

  /** @param {object} seen what `simulation.look` tells, or its `error` */
  show({ lifted, error }) {
    const reason = error ?? this.#station.cannot("simulation.lift");
    const stands = lifted ? "It stands on blocks, its wheels in the air." : "It stands on the floor.";
    allow(this.#up, reason ?? (lifted ? stands : null));
    allow(this.#down, reason ?? (lifted ? null : stands));
    text(this.#told, reason ? `Not now: ${reason}` : stands);
  }

  async #lift(lifted) {
    await this.#station.attempt(this.#station.call("simulation.lift", { lifted }), "lifting the robot");
    this.#changed();
  }
}

/** Sets the speed of time. */
class Pace {
  #station;
  #factor;
  #why = h("p", { class: "reason" });

  constructor(station) {
    this.#station = station;
    const options = FACTORS.map((factor) => h("option", { value: factor }, `${factor} ×`));
    this.#factor = h("select", { onchange: () => this.#ask() }, options);
    this.element = h("div", {}, h("label", {}, "Time passes at ", this.#factor, " of real time"), this.#why);
  }

  /** @param {number} pace as `status` tells it */
  show(pace = 1) {
    const reason = this.#station.cannot("simulation.pace");
    allow(this.#factor, reason);
    text(this.#why, reason ? `Speed of time: ${reason}` : "");
    if (document.activeElement === this.#factor) return;
    if (!FACTORS.includes(pace)) text(this.#other(), `${pace} ×`);
    this.#factor.value = FACTORS.includes(pace) ? pace : OTHER;
  }

  /** The choice that stands for a factor which somebody else has set. */
  #other() {
    const other = this.#factor.querySelector(`[value=${OTHER}]`) ?? h("option", { value: OTHER, disabled: true });
    if (!other.parentNode) this.#factor.append(other);
    return other;
  }

  async #ask() {
    const factor = Number(this.#factor.value);
    const set = await this.#station.attempt(this.#station.call("simulation.pace", { factor }), "speed of time");
    if (set) this.#station.say(`time passes at ${set.factor} × real time`);
  }
}

class SimulationPanel {
  #station;
  #kinds = null;
  #offered = "";
  #faults = [];
  #list;
  #form;
  #ice;
  #slope;
  #power;
  #blocks;
  #pace;
  #real = h("p", {}, "This robot is real: its faults come by themselves, and its floor is where it stands.");
  #tools;
  #draw;

  constructor(station) {
    this.#station = station;
    const changed = () => this.#look();
    this.#list = new FaultList(station, changed);
    this.#form = new FaultForm(station, changed);
    this.#ice = new Ice(station, changed);
    [this.#slope, this.#power] = [new Slope(station, changed), new Power(station)];
    [this.#blocks, this.#pace] = [new Blocks(station, changed), new Pace(station)];
    this.#tools = h("div", {}, part("Speed of time", this.#pace.element),
      part("Floor", this.#slope.element, this.#ice.element), part("Blocks", this.#blocks.element),
      part("Faults", this.#list.element, this.#form.element), part("Power", this.#power.element));
    this.element = h("section", { class: "simulation" }, h("h2", {}, "Simulation"), this.#real, this.#tools);
    this.#draw = redraw(this.element, () => this.#show());
    station.on("status", seldom(this.#draw));
    for (const kind of ["shape", "connected", "robot"]) station.on(kind, this.#draw);
    station.on("robot", () => (this.#faults = []));
    addEventListener("hashchange", () => setTimeout(() => this.#look()));
    setInterval(() => this.#look(), LOOK_MS);
  }

  #show() {
    const simulated = Boolean(this.#station.shape?.simulated);
    this.#real.hidden = simulated || !this.#station.shape;
    this.#tools.hidden = !simulated;
    if (!simulated) return;
    const status = this.#station.status ?? {};
    const names = namesOf(status);
    this.#offer(names);
    for (const each of [this.#form, this.#slope]) each.look();
    this.#pace.show(status.pace);
    this.#list.show(this.#faults);
    this.#ice.show(names.drives, this.#faults);
    this.#power.show(status);
  }

  /** Ask for what no status tells; once a second is enough, and only while somebody looks. */
  async #look() {
    const { connected, shape } = this.#station;
    if (this.element.closest("[hidden]") || document.hidden || !connected || !shape?.simulated) return;
    const seen = await this.#station.call("simulation.look").catch(({ message }) => ({ error: message }));
    this.#blocks.show(seen);
    this.#slope.show(seen.floor);
    const told = await this.#station.call("simulation.faults").catch(() => null);
    this.#faults = told?.faults ?? this.#faults;
    this.#kinds ??= await this.#station.call("station.fault_kinds").catch(() => null);
    this.#draw();
  }

  #offer(names) {
    const wanted = this.#kinds && JSON.stringify([this.#station.robot, names]);
    if (!wanted || wanted === this.#offered) return;
    this.#offered = wanted;
    this.#form.offer(this.#kinds, names);
  }
}

/** Names of a robot's parts by section of its profile; the motors of bricks are no drives there. */
function namesOf({ nodes = [], bricks = [], brakes = [] }) {
  const names = (items) => items.map(({ name }) => name);
  const onBus = nodes.filter(({ node }) => node != null);
  return {
    drives: names(onBus.filter((node) => node.velocity_rpm !== undefined)),
    encoders: names(onBus.filter((node) => node.heading_deg !== undefined)),
    brakes: names(brakes),
    bricks: names(bricks),
  };
}

/** The panel. */
export function create(station) {
  return new SimulationPanel(station).element;
}
