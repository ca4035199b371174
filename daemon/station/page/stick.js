/** A stick on the screen: held by a finger, a mouse, or the arrow keys once Tab has led to it; it springs back. */

import { h, attribute } from "./dom.js";
import { ARROWS, HeldKeys } from "./keyboard.js";

/** Share of the way around the middle that is nothing. */
const DEAD_ZONE = 0.06;

export class Stick {
  #pad;
  #knob = h("div", { class: "knob" });
  #pointer = null;
  #keys;
  #onHold;
  #onLetGo;

  /**
   * @param {{onHold: function(): void, onLetGo: function(): void}} listener hears when it is taken and let go of
   */
  constructor({ onHold, onLetGo }) {
    this.#onHold = onHold;
    this.#onLetGo = onLetGo;
    /** To the left and forward, each from -1 to 1. */
    this.left = this.forward = 0;
    /** Whether it goes aside; else it only goes forward and backward. */
    this.twoWays = true;
    this.#keys = new HeldKeys(ARROWS, (left, forward, held) => this.#byKeys(left, forward, held));
    this.element = this.#pad = h(
      "div",
      { class: "stick", tabindex: "0", role: "application", "aria-label": "Stick: hold the arrow keys to drive" },
      h("span", { class: "up", "aria-hidden": "true" }, "forward"),
      h("span", { class: "down", "aria-hidden": "true" }, "backward"),
      h("span", { class: "keys", "aria-hidden": "true" }, "the arrow keys drive"),
      this.#knob,
    );
    this.#listen();
  }

  /** Why it cannot be used; null where it can. */
  allow(reason) {
    attribute(this.#pad, "aria-disabled", reason ? "true" : null);
    attribute(this.#pad, "title", reason);
    if (reason) this.drop();
  }

  /** Let go of it, whoever holds it. */
  drop() {
    this.#pointer = null;
    this.#keys.drop();
    this.#move(0, 0);
  }

  #listen() {
    this.#pad.addEventListener("pointerdown", (event) => this.#down(event));
    this.#pad.addEventListener("pointermove", (event) => this.#drag(event));
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
      this.#pad.addEventListener(end, (event) => this.#up(event));
    }
    this.#pad.addEventListener("keydown", (event) => this.#allowed && this.#keys.down(event));
    this.#pad.addEventListener("keyup", (event) => this.#keys.up(event));
    this.#pad.addEventListener("blur", () => this.#keys.drop());
    this.#pad.addEventListener("mousedown", leaveTheFocus);
    this.#pad.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  get #allowed() {
    return !this.#pad.hasAttribute("aria-disabled");
  }

  #down(event) {
    if (!this.#allowed || this.#pointer !== null || event.button !== 0) return;
    this.#pad.setPointerCapture(event.pointerId);
    this.#pointer = event.pointerId;
    this.#drag(event);
    this.#onHold();
  }

  #drag(event) {
    if (event.pointerId !== this.#pointer) return;
    const box = this.#pad.getBoundingClientRect();
    const reach = (box.width - this.#knob.offsetWidth) / 2;
    this.#move((box.x + box.width / 2 - event.clientX) / reach, (box.y + box.height / 2 - event.clientY) / reach);
  }

  #up(event) {
    if (event.pointerId !== this.#pointer) return;
    this.drop();
    this.#onLetGo();
  }

  #byKeys(left, forward, held) {
    if (this.#pointer !== null) return;
    const before = this.left || this.forward;
    this.#move(left, forward);
    if (held && !before) this.#onHold();
    if (!held) this.#onLetGo();
  }

  #move(left, forward) {
    this.left = this.twoWays ? clipped(left) : 0;
    this.forward = clipped(forward);
    const reach = (this.#pad.clientWidth - this.#knob.offsetWidth) / 2;
    this.#knob.style.transform = `translate(${-this.left * reach}px, ${-this.forward * reach}px)`;
  }
}

/** A mouse gives no focus: arrow keys drive by the stick that somebody has chosen with Tab alone. */
function leaveTheFocus(event) {
  event.preventDefault();
  document.activeElement?.blur();
}

function clipped(share) {
  const held = Math.max(-1, Math.min(1, share));
  return Math.abs(held) < DEAD_ZONE ? 0 : held;
}
