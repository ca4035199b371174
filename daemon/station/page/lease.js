/** The lease of this page: renewed while somebody holds a control, so that a robot nobody looks after comes to rest. */

const DEFAULT_TIMEOUT_S = 1.5;

export class Lease {
  #station;
  #held = new Set();
  #timer = 0;
  #asked = false;

  /** @param {object} station see station.js */
  constructor(station) {
    this.#station = station;
    station.on("connected", () => station.connected || this.#dropAll());
  }

  /** Renew from now on, for the sake of something that is held. */
  hold(what) {
    this.#held.add(what);
    if (this.#timer) return;
    const timeout_s = this.#station.hello?.lease_timeout_s ?? DEFAULT_TIMEOUT_S;
    this.#timer = setInterval(() => this.#renew(), (timeout_s * 1000) / 3);
  }

  /** Something was let go of; without anything held nothing is renewed. */
  release(what) {
    this.#held.delete(what);
    if (!this.#held.size) this.#dropAll();
  }

  /** Whether this is held. */
  holds(what) {
    return this.#held.has(what);
  }

  #dropAll() {
    this.#held.clear();
    clearInterval(this.#timer);
    this.#timer = 0;
  }

  /** No more than one renewal is on its way, and none from a page that nobody sees. */
  async #renew() {
    if (this.#asked || document.hidden) return;
    this.#asked = true;
    try {
      await this.#station.call("lease.renew");
    } catch {
      // it has run out: the motion that it held tells so
    } finally {
      this.#asked = false;
    }
  }
}
