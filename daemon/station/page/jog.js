/** Turning one motor by hand: as long as a button is held, and no longer. */

import { allow, attribute, h } from "./dom.js";

/** Time after which a motor stops, however long its button is held. */
const LONGEST_S = 10;
const FIRST_RPM = 100;
const LET_GO = ["pointerup", "pointercancel", "lostpointercapture", "blur"];

export class Jog {
  #station;
  #drive;
  #direction = 0;
  #input;
  #buttons;
  #letGo = () => this.#release();

  /**
   * @param {object} station see station.js
   * @param {string} drive name of the motor's drive
   */
  constructor(station, drive) {
    this.#station = station;
    this.#drive = drive;
    this.#input = h("input", { type: "number", min: 1, max: 100000, step: 1, value: FIRST_RPM, inputmode: "numeric" });
    this.#buttons = [this.#button("◀ Back", -1), this.#button("Forward ▶", 1)];
    const speed = h("label", {}, "Jog at ", this.#input, " rpm");
    this.element = h("div", { class: "jog", role: "group", "aria-label": `Jog ${drive}` }, speed,
      h("div", { class: "row" }, this.#buttons));
  }

  /** Let it be used, or not, with the reason. */
  allow(reason) {
    if (reason && this.#direction) this.#release();
    for (const control of [this.#input, ...this.#buttons]) allow(control, reason);
  }

  #button(words, direction) {
    const hint = `${words}: hold to turn ${this.#drive}, let go to stop; with the keyboard hold Enter`;
    const button = h("button", { type: "button", class: "hold", "aria-label": hint, "aria-pressed": "false" }, words);
    button.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      button.setPointerCapture(event.pointerId);
      this.#press(direction);
    });
    button.addEventListener("keydown", (event) => {
      if (event.key !== "Enter") return;
      event.preventDefault();
      if (!event.repeat) this.#press(direction);
    });
    button.addEventListener("keyup", (event) => event.key === "Enter" && this.#release());
    button.addEventListener("contextmenu", (event) => event.preventDefault());
    for (const kind of LET_GO) button.addEventListener(kind, this.#letGo);
    return button;
  }

  async #press(direction) {
    const speed_rpm = Number(this.#input.value);
    if (this.#direction || !this.#input.reportValidity() || !speed_rpm) return;
    this.#hold(direction);
    const asked = { node: this.#drive, velocity_rpm: direction * speed_rpm, duration_s: LONGEST_S };
    try {
      await this.#station.call("motor.velocity", asked, { timeout_ms: 0 });
      if (this.#direction) this.#station.say(`${this.#drive} stopped after ${LONGEST_S} s: hold the button again`);
    } catch (error) {
      if (this.#direction) this.#station.say(`jog of ${this.#drive}: ${error.message}`, "error", error.remedy);
    } finally {
      this.#hold(0);
    }
  }

  #release() {
    if (!this.#direction) return;
    this.#hold(0);
    this.#station.attempt(this.#station.call("motor.stop", { node: this.#drive }), `stop of ${this.#drive}`);
  }

  #hold(direction) {
    this.#direction = direction;
    if (direction) this.#station.lease.hold(this);
    else this.#station.lease.release(this);
    document[direction ? "addEventListener" : "removeEventListener"]("visibilitychange", this.#letGo);
    this.#buttons.forEach((button, at) => attribute(button, "aria-pressed", direction === 2 * at - 1 ? "true" : "false"));
  }
}
