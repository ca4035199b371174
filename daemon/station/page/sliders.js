/** Sliders for driving: speed only while it is held, everything else stays where it is put. */

import { allow, h, quantity, text } from "./dom.js";

const LABELS = { speed: "Speed", direction: "Direction", yaw_rate: "Yaw rate", steering: "Steering" };
/** Digits and unit for people, by the unit of the range. */
const SHOWN = { "m/s": [2, "m/s"], deg: [1, "°"], "deg/s": [1, "°/s"] };
const STEPS = { "m/s": 0.005, deg: 0.5, "deg/s": 0.5 };
/** Share of the vehicle's own limit that a person begins with. */
const FIRST_SHARE = 0.5;

class Slider {
  #range = null;

  constructor(name, label) {
    this.shown = h("output", { for: `slider-${name}` });
    this.input = h("input", { type: "range", id: `slider-${name}`, min: -1, max: 1, step: "any", value: 0 });
    const named = h("label", { for: this.input.id }, label);
    this.element = h("div", { class: "slider" }, named, this.input, this.shown);
    this.input.addEventListener("input", () => this.show());
  }

  /** The ends of this vehicle; null where it has no such command, which is left out. */
  use(range, value = 0) {
    this.#range = range;
    this.element.hidden = !range;
    if (range) {
      Object.assign(this.input, { min: range.least, max: range.full });
      this.input.value = value;
    }
    this.show();
  }

  /** In whole steps, so that the middle is nothing and not nearly nothing. */
  get value() {
    const step = STEPS[this.#range?.unit] ?? 1;
    return Math.round(this.input.valueAsNumber / step) * step;
  }

  put(value) {
    this.input.value = value;
    this.show();
  }

  show() {
    const { unit } = this.#range ?? {};
    const told = unit ? quantity(this.value, ...SHOWN[unit]) : "–";
    text(this.shown, told);
    this.input.setAttribute("aria-valuetext", told);
  }

  allow(reason) {
    allow(this.input, reason);
  }
}

export class Sliders {
  #sliders = Object.fromEntries(Object.keys(LABELS).map((name) => [name, new Slider(name, LABELS[name])]));
  #fastest = new Slider("fastest", "Top speed");
  #slowerBack = h("span", { class: "reason" });
  #ranges = {};
  #held = false;
  #onHold;
  #onLetGo;

  /** @param {{onHold: function(): void, onLetGo: function(): void}} listener hears of the speed slider */
  constructor({ onHold, onLetGo }) {
    this.#onHold = onHold;
    this.#onLetGo = onLetGo;
    const { speed, ...others } = this.#sliders;
    const hint = h("p", { class: "reason" }, "Speed counts while its slider is held, and springs back.");
    const middle = h("button", { type: "button", onclick: () => this.#toMiddle() }, "All to the middle");
    const elements = [this.#fastest, speed, ...Object.values(others)].map((slider) => slider.element);
    this.element = h("div", { class: "sliders" }, elements, h("div", { class: "row" }, middle, hint));
    this.#fastest.element.append(this.#slowerBack);
    this.#listen(speed.input);
  }

  /** Commands of this vehicle, with their ends. */
  use(ranges) {
    this.#ranges = ranges;
    for (const [name, slider] of Object.entries(this.#sliders)) slider.use(ranges[name] ?? null);
    const { speed } = ranges;
    this.#fastest.use(speed ? { ...speed, least: 0 } : null, FIRST_SHARE * (speed?.full ?? 0));
    const slower = speed && -speed.least < speed.full;
    text(this.#slowerBack, slower ? `backwards ${quantity(-speed.least, ...SHOWN[speed.unit])} at most` : "");
  }

  /** What the sliders command, by command; those that the vehicle has not are left out. */
  get commands() {
    const known = Object.entries(this.#sliders).filter(([name]) => this.#ranges[name]);
    return Object.fromEntries(known.map(([name, slider]) => [name, slider.value]));
  }

  /** A person's own highest speed [m/s]. */
  get fastest() {
    return this.#fastest.value;
  }

  /** Commands of a stick, whose way ends at a person's own highest speed, or at the vehicle's where that is less. */
  slowed(commands) {
    const speeds = ["speed", "sideways"].filter((name) => name in commands && this.#ranges[name]);
    return { ...commands, ...Object.fromEntries(speeds.map((name) => [name, this.#slowed(name, commands[name])])) };
  }

  #slowed(name, value) {
    const { least, full } = this.#ranges[name];
    const end = Math.abs(value < 0 ? least : full);
    return end && value * Math.min(1, this.fastest / end);
  }

  /** Why they cannot be used; null where they can. */
  allow(reason) {
    for (const slider of Object.values(this.#sliders)) slider.allow(reason);
    this.#fastest.allow(null);
  }

  /** Let go of the speed. */
  drop() {
    this.#held = false;
    this.#sliders.speed.put(0);
  }

  #toMiddle() {
    for (const slider of Object.values(this.#sliders)) slider.put(0);
  }

  #listen(speed) {
    const hold = () => {
      this.#held = true;
      this.#onHold();
    };
    const letGo = () => {
      if (!this.#held) return;
      this.drop();
      this.#onLetGo();
    };
    speed.addEventListener("pointerdown", hold);
    speed.addEventListener("keydown", (event) => this.#byKey(event, hold));
    for (const end of ["pointerup", "pointercancel", "keyup", "blur"]) speed.addEventListener(end, letGo);
    // arrow keys drive by a slider that somebody has chosen with Tab alone: one that a pointer has held gives up the focus
    for (const end of ["pointerup", "click"]) speed.addEventListener(end, () => speed.blur());
    // a value that comes without a hold (a wheel, an aid) does not stay
    speed.addEventListener("change", () => this.#held || this.drop());
    speed.addEventListener("input", () => this.#held || this.drop());
  }

  /** An arrow that is held moves the slider on and on; one that is still down since it was dropped does nothing. */
  #byKey(event, hold) {
    if (!/^(Arrow|Page|Home|End)/.test(event.code)) return;
    if (event.repeat && !this.#held) event.preventDefault();
    else if (!event.repeat) hold();
  }
}
