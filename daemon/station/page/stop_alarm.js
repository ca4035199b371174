/** The alarm of stops that may not have reached the robot: when, how often, and until the robot is known at rest. */

import { clockTime } from "./words.js";

/** Speed below which a wheel stands. */
const REST_M_S = 0.01;
/** How long it has to stand: the first samples after a silence may be old ones. */
const REST_MS = 500;
const MOVING = ["active", "stopping"];
const KEY = "stop";

export class StopAlarm {
  #station;
  #count = 0;
  #first_ms = 0;
  #standsSince_ms = Infinity;

  /** @param {object} station see station.js */
  constructor(station) {
    this.#station = station;
    station.on("status", () => this.#count && this.#lookForRest());
    station.on("robot", () => this.end());
  }

  /**
   * Tell that a stop has failed, with the failures before it.
   *
   * @param {string} what has become of it
   * @param {string} why so
   * @param {string} remedy what to do
   */
  raise(what, why, remedy) {
    const now_ms = Date.now();
    if (!this.#count) this.#first_ms = now_ms;
    this.#count += 1;
    this.#standsSince_ms = Infinity;
    const since = this.#count > 1 ? ` (${this.#count} times since ${clockTime(this.#first_ms)})` : "";
    this.#station.say(`${what} at ${clockTime(now_ms)}${since}: ${why}`, "error", remedy, KEY);
  }

  /** A stop has got through. */
  end() {
    this.#count = 0;
    this.#station.unsay(KEY);
  }

  #lookForRest() {
    const { stale, status } = this.#station;
    const now_ms = performance.now();
    this.#standsSince_ms = !stale && stands(status) ? Math.min(this.#standsSince_ms, now_ms) : Infinity;
    if (now_ms - this.#standsSince_ms < REST_MS) return;
    this.end();
    this.#station.say("the robot is heard, and stands: no stop is needed any more");
  }
}

function stands({ state, nodes }) {
  const speeds = nodes.map((node) => node.speed_m_s).filter((speed) => speed != null);
  return !MOVING.includes(state) && speeds.every((speed) => Math.abs(speed) < REST_M_S);
}
