/** Single motions and the brakes: each a row of inputs and a button, disabled with the reason where there is none. */

import { allow, h, number, text } from "./dom.js";
import { field, numberIn, put, settleWriting, wrongIn } from "./fields.js";

const key = (name) => name.replaceAll(/[^a-z]/g, "-");

/** A box for a number, with its label. */
function box(name, label, value, limits = { required: true }) {
  const input = field(label, { id: `motion-${name}`, ...limits }, () => {});
  put(input, value);
  return { input, element: h("label", { class: "field", for: input.id }, label, input) };
}

/** A row that calls one method with what stands in its inputs. */
class Row {
  #station;
  #method;
  #button;
  #reason = h("p", { class: "reason" });

  constructor(station, method, { title, verb, fields, parameters }) {
    this.#station = station;
    this.#method = method;
    this.#button = h("button", { type: "submit" }, verb);
    const inputs = h("div", { class: "row bottom" }, fields.map((each) => each.element), this.#button);
    this.#reason.id = `why-${key(method)}`;
    this.#button.setAttribute("aria-describedby", this.#reason.id);
    this.element = h("form", { "data-motion": method, novalidate: true }, h("h4", {}, title), inputs, this.#reason);
    this.element.addEventListener("submit", (event) => {
      event.preventDefault();
      settleWriting();
      if (!wrongIn(this.element)) this.#begin(parameters());
    });
  }

  show() {
    this.element.hidden = Boolean(this.#station.lacks(this.#method));
    const reason = this.#station.cannot(this.#method);
    allow(this.#button, reason);
    text(this.#reason, reason);
    this.#reason.hidden = !reason;
  }

  async #begin(parameters) {
    const done = await this.#station.attempt(this.#station.move(this.#method, parameters), this.#method);
    if (done) this.#station.say(`${this.#method}: done${done.result ? `, ${done.result}` : ""}`);
  }
}

function rows(station) {
  const pair = h("select", { id: "motion-pair" }, h("option", {}, "front"), h("option", {}, "rear"));
  const angle = box("angle", "heading [°]", 0);
  const rate = box("rate", "yaw rate [°/s]", 20);
  const time = box("time", "time [s]", 3, { min: 0.1, required: true });
  const [x, y] = [box("x", "x [m]", 0.5), box("y", "y [m]", 0)];
  const heading = box("heading", "heading [°]", "", {});
  const speed = box("speed", "speed [m/s]", "", { min: 0.001 });
  return [
    new Row(station, "steer", {
      title: "Steer a pair of wheels",
      verb: "Steer",
      fields: [{ element: h("label", { class: "field", for: pair.id }, "pair", pair) }, angle],
      parameters: () => ({ pair: pair.value, angle_deg: numberIn(angle.input) }),
    }),
    new Row(station, "drive.rotate", {
      title: "Turn about its own centre",
      verb: "Rotate",
      fields: [rate, time],
      parameters: () => ({ rate_deg_s: numberIn(rate.input), duration_s: numberIn(time.input) }),
    }),
    new Row(station, "drive.to", {
      title: "Drive to a place of the frame that began with the daemon",
      verb: "Drive to",
      fields: [x, y, heading, speed],
      parameters: () => ({
        x_m: numberIn(x.input),
        y_m: numberIn(y.input),
        heading_deg: numberIn(heading.input),
        speed_m_s: numberIn(speed.input),
      }),
    }),
  ];
}

/** Buttons that call a method once for each of some names. */
function buttons(station, told) {
  return told.map(([method, verb, parameter, names]) => {
    const button = h("button", { type: "button", "data-method": method }, verb);
    button.addEventListener("click", async () => {
      const calls = names().map((name) => station.call(method, { [parameter]: name }, { timeout_ms: 10_000 }));
      await station.attempt(Promise.all(calls), verb);
    });
    return { method, button };
  });
}

const drives = (station) => (station.status?.nodes ?? []).filter((node) => "target_speed_m_s" in node);

function wordsOfDrives(all) {
  return `${all.filter((node) => node.state === "enabled").length} of ${all.length} enabled`;
}

/** Power of the drives, and brakes, as far as the vehicle has them. */
function powerAndBrakes(station) {
  const names = () => drives(station).map((node) => node.name);
  const power = buttons(station, [
    ["motor.enable", "Enable drives", "node", names],
    ["motor.disable", "Disable drives", "node", names],
  ]);
  const brakes = ["front", "rear"].flatMap((pair) =>
    buttons(station, [
      ["brake.release", `Release ${pair}`, "pair", () => [pair]],
      ["brake.engage", `Engage ${pair}`, "pair", () => [pair]],
    ]).map((each) => ({ ...each, pair })),
  );
  const [powered, braked] = [h("output", { class: "muted" }), h("output", { class: "muted" })];
  const why = h("p", { class: "reason" });
  const title = h("h3");
  const ofPower = h("div", { class: "row" }, power.map((each) => each.button), powered);
  const ofBrakes = h("div", { class: "row" }, brakes.map((each) => each.button), braked);
  const element = h("div", { class: "stack" }, title, ofPower, ofBrakes, why);
  const show = () => {
    const reasons = [...power, ...brakes].map(({ method, button }) => {
      const reason = station.cannot(method);
      allow(button, reason);
      return button.hidden ? null : reason;
    });
    text(why, [...new Set(reasons.filter(Boolean))].map((reason) => `Not now: ${reason}.`).join(" "));
    const [all, has] = [drives(station), station.status?.brakes ?? []];
    ofPower.hidden = !all.length;
    ofBrakes.hidden = !has.length;
    for (const { button, pair } of brakes) button.hidden = !has.some(({ name }) => name === pair);
    element.hidden = !all.length && !has.length;
    text(title, has.length ? "Power and brakes" : "Power");
    text(powered, wordsOfDrives(all));
    text(braked, has.map((brake) => `${brake.name}: ${brake.state}`).join(", "));
  };
  return { element, show };
}

/** The motions that are under way, whoever has begun them, each with a button that ends it by its ramp. */
function running(station) {
  const element = h("ul", { class: "running" });
  const show = () => {
    const motions = station.status?.motions ?? [];
    const told = motions.map((motion) => motion.motion).join();
    if (element.dataset.told !== told) {
      element.dataset.told = told;
      element.replaceChildren(...motions.map((motion) => item(station, motion)));
    }
    motions.forEach((motion, i) => text(element.children[i].querySelector("span"), wordsOfMotion(motion)));
  };
  return { element, show };
}

function item(station, { motion, kind }) {
  const end = h("button", { type: "button", "aria-label": `End ${kind}` }, "End");
  end.addEventListener("click", () =>
    station.attempt(station.call("motion.stop", { motion }, { timeout_ms: 10_000 }), `ending ${kind}`),
  );
  return h("li", { class: "row" }, h("span"), end);
}

function wordsOfMotion({ motion, kind, phase, speed_m_s }) {
  const speed = speed_m_s == null ? "" : `, ${number(speed_m_s, 2)} m/s`;
  return `${kind} (motion ${motion})${phase ? `: ${phase}` : ""}${speed}`;
}

/**
 * @param {object} station see station.js
 * @returns {{element: HTMLElement, show: function(): void}} what is shown, and how it is brought up to date
 */
export function createMotions(station) {
  const all = rows(station);
  const power = powerAndBrakes(station);
  const list = running(station);
  const single = h("details", {}, h("summary", {}, "Single motions"), all.map((row) => row.element));
  const element = h("div", { class: "stack" }, list.element, power.element, single);
  const show = () => {
    for (const each of [...all, power, list]) each.show();
    single.hidden = all.every((row) => row.element.hidden);
  };
  return { element, show };
}
