/** Driving by keys: W A S D or the arrows, held down. */

import { attribute, h, text } from "./dom.js";

const FORWARD = { ArrowUp: 1, ArrowDown: -1, KeyW: 1, KeyS: -1 };
const LEFT = { ArrowLeft: 1, ArrowRight: -1, KeyA: 1, KeyD: -1 };
/** Where arrows and letters have a meaning of their own. */
const OWN_KEYS = "input, select, textarea, [contenteditable]";
const HINTS = {
  on: "W A S D and the arrow keys drive as long as they are held, while this panel is shown.",
  off: "No key drives, but the arrows where Tab has led to the stick or to the speed.",
};

/** Driving keys. */
export const ARROWS = ["ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight"];
const ALL = [...ARROWS, "KeyW", "KeyA", "KeyS", "KeyD"];

/** Which of the driving keys are held down. */
export class HeldKeys {
  #down = new Set();
  #codes;
  #changed;

  /**
   * @param {string[]} codes of the keys that count
   * @param {function(number, number, boolean): void} changed given left and forward, -1 to 1, and whether one is held
   */
  constructor(codes, changed) {
    [this.#codes, this.#changed] = [codes, changed];
  }

  /** A key went down; one that is still down since it was dropped does not count again. */
  down(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || !this.#codes.includes(event.code)) return;
    event.preventDefault();
    event.stopPropagation();
    if (!event.repeat) this.#change(() => this.#down.add(event.code));
  }

  /** A key came up. */
  up(event) {
    if (this.#down.has(event.code)) this.#change(() => this.#down.delete(event.code));
  }

  /** All are let go of. */
  drop() {
    if (this.#down.size) this.#change(() => this.#down.clear());
  }

  #change(act) {
    act();
    this.#changed(this.#sum(LEFT), this.#sum(FORWARD), this.#down.size > 0);
  }

  #sum(keys) {
    const sum = [...this.#down].reduce((total, code) => total + (keys[code] ?? 0), 0);
    return Math.max(-1, Math.min(1, sum));
  }
}

/** The switch for driving by keys, and the keys themselves. */
export class Keyboard {
  #keys;
  #held = false;
  #onHold;
  #onLetGo;

  /** @param {{onHold: function(): void, onLetGo: function(): void}} listener hears when keys are taken and let go of */
  constructor({ onHold, onLetGo }) {
    this.#onHold = onHold;
    this.#onLetGo = onLetGo;
    /** To the left and forward, -1, 0 or 1. */
    this.left = this.forward = 0;
    this.on = false;
    this.#keys = new HeldKeys(ALL, (left, forward, held) => this.#change(left, forward, held));
    this.button = h("button", { type: "button", "aria-pressed": "false", onclick: () => this.#switch(!this.on) });
    this.hint = h("span", { class: "reason" });
    this.#switch(false);
    document.addEventListener("keydown", (event) => this.#onKey(event));
    document.addEventListener("keyup", (event) => this.#keys.up(event));
  }

  /** Let go of all keys. */
  drop() {
    this.#keys.drop();
  }

  #switch(on) {
    this.on = on;
    this.drop();
    attribute(this.button, "aria-pressed", String(on));
    text(this.button, on ? "Keyboard is on" : "Keyboard is off");
    text(this.hint, on ? HINTS.on : HINTS.off);
  }

  #onKey(event) {
    const shown = this.on && !this.button.closest("[hidden]") && !this.button.disabled;
    if (shown && !event.target.matches?.(OWN_KEYS)) this.#keys.down(event);
  }

  #change(left, forward, held) {
    [this.left, this.forward] = [left, forward];
    const before = this.#held;
    this.#held = held;
    if (held && !before) this.#onHold();
    if (!held && before) this.#onLetGo();
  }
}
