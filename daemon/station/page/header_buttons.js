/** The buttons of the header that are pressed on purpose alone: taking over, giving back, and the reset. */

import { allow, text } from "./dom.js";
import { onPress } from "./press.js";
import { inPageWords, whoHas } from "./words.js";

const SURE_MS = 6000;
const FIRST = "Reset…";

/** Takes the robot over; it stays so until it is given back, or the page is hidden or gone. */
export class Takeover {
  #station;
  #button = document.getElementById("takeover");
  #holder = document.getElementById("holder");

  constructor(station) {
    this.#station = station;
    onPress(this.#button, () => (station.lease.holds(this) ? this.#giveBack() : this.#take()));
    document.addEventListener("visibilitychange", () => document.hidden && station.lease.release(this));
  }

  /** Who has the robot, as far as anybody knows, and what may be done about it. */
  show() {
    const { connected, status, holds, lease } = this.#station;
    const holder = connected ? status?.holder : null;
    const kept = holder && holds && lease.holds(this);
    text(this.#holder, !holder ? "" : holds ? "you have the robot" : `${whoHas(holder)} has the robot`);
    text(this.#button, kept ? "Give back" : "Take over");
    this.#button.hidden = !kept && (!holder || holds);
    const reason = this.#station.cannot("lease.take");
    allow(this.#button, reason);
    if (reason && !this.#button.hidden) text(this.#holder, `${whoHas(holder)} has the robot; taking over ${reason}`);
  }

  async #take() {
    const station = this.#station;
    station.lease.hold(this);
    const answer = await station.attempt(station.call("lease.take", {}, { timeout_ms: 10_000 }), "taking over");
    if (!answer) station.lease.release(this);
    else station.say(answer.taken_from ? `you have the robot; ${answer.taken_from} had it` : "you have the robot");
  }

  async #giveBack() {
    this.#station.lease.release(this);
    await this.#station.attempt(this.#station.call("lease.close"), "giving back");
  }
}

/** The first press asks, the second one resets; a question in a window of its own would keep the stop waiting. */
export class Reset {
  #station;
  #button = document.getElementById("reset");
  #asked = 0;

  constructor(station) {
    this.#station = station;
    onPress(this.#button, () => (this.#asked ? this.#reset() : this.#ask()));
  }

  /** Whether there is something to reset, and why it cannot be. */
  show(latched) {
    if (!latched) this.#calm();
    allow(this.#button, this.#station.cannot("reset"));
  }

  #ask() {
    text(this.#button, "It is safe: reset");
    this.#asked = setTimeout(() => this.#calm(), SURE_MS);
  }

  #calm() {
    clearTimeout(this.#asked);
    this.#asked = 0;
    text(this.#button, FIRST);
  }

  async #reset() {
    this.#calm();
    const station = this.#station;
    const answer = await station.attempt(station.call("reset", {}, { timeout_ms: 10_000 }), "reset");
    if (answer) station.say(`reset: ${inPageWords(answer.message) || `the robot is ${answer.state}`}`);
  }
}
