/** The floor of the simulation: its slope, and ice under the wheels. */

import { badge, setBadge } from "./badge.js";
import { allow, h, text } from "./dom.js";
import { field, limit, numberIn, put, settleWriting, wrongIn } from "./fields.js";
import { Rows, table } from "./rows.js";

/** Rubber on wet ice. */
const FIRST_FRICTION = 0.02;
/** How the daemon refuses ice under a wheel of which the simulation has no contact with the floor. */
const NO_WHEEL = /drives no wheel on a floor/;

/** Tilts the floor. */
export class Slope {
  #station;
  #slope = field("Slope in degrees", { required: true }, () => {});
  #direction = field("Downhill towards, in degrees", { min: -180, max: 180, required: true }, () => {});
  #tilt = h("button", { type: "submit" }, "Tilt");
  #level = h("button", { type: "button", onclick: () => this.#makeLevel() }, "Make level");
  #now = h("p", { role: "status" });
  #why = h("p", { class: "reason" });
  #changed;

  /**
   * @param {object} station see station.js
   * @param {function(): void} changed is called when the floor was tilted
   */
  constructor(station, changed) {
    this.#station = station;
    this.#changed = changed;
    for (const box of [this.#slope, this.#direction]) put(box, 0);
    const slope = h("label", {}, "Slope ", this.#slope, " °");
    const direction = h("label", {}, "downhill towards ", this.#direction, " °");
    const hint = h("p", { class: "aside" }, "Downhill: 0° along x of the map, 90° along y.");
    this.element = h("form", { "aria-label": "Slope", novalidate: true }, h("div", { class: "row" }, slope, direction, this.#tilt,
      this.#level), this.#now, hint, this.#why);
    this.element.addEventListener("submit", (event) => {
      event.preventDefault();
      this.#ask();
    });
  }

  /** See what may be done now. */
  look() {
    const reason = this.#station.cannot("simulation.slope");
    for (const control of [this.#slope, this.#direction, this.#tilt, this.#level]) allow(control, reason);
    text(this.#why, reason ? `Slope: ${reason}` : "");
    const param = this.#station.methods.get("simulation.slope")?.params.find(({ name }) => name === "slope_deg");
    limit(this.#slope, { min: param?.minimum, max: param?.maximum });
  }

  /** @param {{slope_deg: number, direction_deg: number}|undefined} floor as `simulation.look` tells it */
  show(floor) {
    const { slope_deg, direction_deg } = floor ?? {};
    const slopes = `has a slope of ${slope_deg}°, downhill towards ${direction_deg}°`;
    text(this.#now, floor ? `The floor ${slope_deg ? slopes : "is level"}.` : "");
  }

  #makeLevel() {
    put(this.#slope, 0);
    this.#ask();
  }

  async #ask() {
    settleWriting();
    if (wrongIn(this.element)) return;
    const asked = { slope_deg: numberIn(this.#slope), direction_deg: numberIn(this.#direction) };
    await this.#station.attempt(this.#station.call("simulation.slope", asked), "tilting the floor");
    this.#changed();
  }
}

/** Puts wheels on ice, one or all, and takes the ice away. */
export class Ice {
  #station;
  #changed;
  #wheels = [];
  #friction = field("Coefficient of friction", { min: 0.001, max: 2, required: true }, () => {});
  #all = h("button", { type: "button", onclick: () => this.#layAll() }, "All wheels on ice");
  #none = h("button", { type: "button", onclick: () => this.#takeAway(this.#wheels) }, "Take all ice away");
  #why = h("p", { class: "reason" });
  #rows;

  /**
   * @param {object} station see station.js
   * @param {function(): void} changed is called when ice was laid or taken away
   */
  constructor(station, changed) {
    this.#station = station;
    this.#changed = changed;
    put(this.#friction, FIRST_FRICTION);
    const { table: element, body } = table("Ice under the wheels", ["Wheel", "On", "Change"]);
    this.#rows = new Rows(body, (wheel) => this.#row(wheel));
    const friction = h("label", {}, "Coefficient of friction ", this.#friction);
    const tools = h("div", { class: "row" }, friction, this.#all, this.#none);
    this.element = h("div", {}, tools, h("div", { class: "scroll" }, element), this.#why);
  }

  /**
   * @param {string[]} drives names of the robot's drives
   * @param {object[]} faults as `simulation.faults` tells them
   */
  show(drives, faults) {
    const laid = faults.filter(({ kind, state }) => kind === "ice" && state !== "over");
    const icy = new Map(laid.map((ice) => [ice.part, ice]));
    this.#wheels = wheelsOf(this.#station.shape, drives).map((name) => ({ name, ice: icy.get(name) ?? null }));
    this.element.hidden = !this.#wheels.length;
    this.#rows.show(this.#wheels);
    const reason = this.#station.cannot("simulation.fault");
    for (const control of [this.#friction, this.#all, this.#none]) allow(control, reason);
    text(this.#why, reason ? `Ice: ${reason}` : "");
  }

  #row({ name }) {
    const on = badge();
    let wheel;
    const change = () => (wheel.ice ? this.#takeAway([wheel]) : this.#lay([wheel]));
    const button = h("button", { type: "button", onclick: change });
    const show = (now) => {
      wheel = now;
      const { ice } = now;
      setBadge(on, ice ? "warn" : "good", ice ? `ice, friction ${ice.friction ?? FIRST_FRICTION}` : "dry floor");
      text(button, wheel.ice ? `Take the ice from ${name}` : `Put ${name} on ice`);
      allow(button, this.#station.cannot("simulation.fault"));
    };
    return { element: h("tr", {}, h("th", { scope: "row" }, name), h("td", {}, on), h("td", {}, button)), show };
  }

  #layAll() {
    return this.#lay(this.#wheels.filter(({ ice }) => !ice));
  }

  /** Wheels that the simulation does not know are left out, where others could be laid on ice. */
  async #lay(wheels) {
    settleWriting();
    if (wrongIn(this.element)) return;
    const friction = numberIn(this.#friction);
    const lay = ({ name }) => this.#station.call("simulation.fault", { kind: "ice", part: name, friction });
    const ended = await Promise.allSettled(wheels.map(lay));
    const failed = ended.filter(({ status }) => status === "rejected").map(({ reason }) => reason);
    const told = failed.length < wheels.length ? failed.filter(({ message }) => !NO_WHEEL.test(message)) : failed;
    for (const { message, remedy } of told) this.#station.say(`ice: ${message}`, "error", remedy);
    this.#changed();
  }

  async #takeAway(wheels) {
    for (const { ice } of wheels.filter((wheel) => wheel.ice)) {
      const asked = this.#station.call("simulation.clear_faults", { fault: ice.fault });
      await this.#station.attempt(asked, `taking the ice from ${ice.part}`);
    }
    this.#changed();
  }
}

/** Drives that have a wheel in the vehicle's shape; where the shape names its wheels otherwise, all but the steering's. */
function wheelsOf(shape, drives) {
  const wheels = new Set(shape?.wheels?.map(({ name }) => name));
  const found = drives.filter((name) => wheels.has(name));
  return found.length ? found : drives.filter((name) => name !== shape?.steering);
}
