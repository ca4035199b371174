/** Turning one motor by hand: as long as a button is held, and no longer. */

import { allow, attribute, h } from "./dom.js";
import { field, numberIn, put, settleWriting, wrongIn } from "./fields.js";

/** Time after which a motor stops, however long its button is held. */
const LONGEST_S = 10;
const FIRST_RPM = 100;
const LIMITS = { min: 1, max: 100000, required: true };
const LET_GO = ["pointerup", "pointercancel", "lostpointercapture", "blur"];

export class Jog {
  #station;
  #drive;
  #held = null;
  #turning = null;
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
    this.#input = field(`Jog ${drive} at, in rpm`, LIMITS, () => {});
    put(this.#input, FIRST_RPM);
    this.#buttons = [this.#button("◀ Back", -1), this.#button("Forward ▶", 1)];
    const speed = h("label", {}, "Jog at ", this.#input, " rpm");
    this.element = h("div", { class: "jog", role: "group", "aria-label": `Jog ${drive}` }, speed,
      h("div", { class: "row" }, this.#buttons));
  }

  /** Let it be used, or not, with the reason. */
  allow(reason) {
    if (reason && this.#held) this.#release();
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

  /** A motor that is still being stopped is waited for. */
  async #press(direction) {
    settleWriting();
    if (this.#held || wrongIn(this.element)) return;
    const speed_rpm = numberIn(this.#input);
    const held = this.#hold({ direction });
    await this.#turning;
    if (held !== this.#held) return;
    const asked = { node: this.#drive, velocity_rpm: direction * speed_rpm, duration_s: LONGEST_S };
    this.#turning = this.#turn(asked, held);
  }

  async #turn(asked, held) {
    try {
      await this.#station.call("motor.velocity", asked, { timeout_ms: 0 });
      if (held === this.#held) this.#station.say(`${this.#drive} stopped after ${LONGEST_S} s: hold the button again`);
    } catch (error) {
      if (held === this.#held) this.#station.say(`jog of ${this.#drive}: ${error.message}`, "error", error.remedy);
    }
    if (held === this.#held) this.#hold(null);
  }

  #release() {
    if (!this.#held) return;
    this.#hold(null);
    this.#station.attempt(this.#station.call("motor.stop", { node: this.#drive }), `stop of ${this.#drive}`);
  }

  /** Renew the lease while a button is held, and see that nothing else can take the hand's place. */
  #hold(held) {
    this.#held = held;
    if (held) this.#station.lease.hold(this);
    else this.#station.lease.release(this);
    const change = held ? "addEventListener" : "removeEventListener";
    document[change]("visibilitychange", this.#letGo);
    window[change]("hashchange", this.#letGo);
    const [back, forward] = this.#buttons;
    attribute(back, "aria-pressed", String(held?.direction === -1));
    attribute(forward, "aria-pressed", String(held?.direction === 1));
    return held;
  }
}
