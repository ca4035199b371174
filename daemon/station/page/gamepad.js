/** Driving by a gamepad, with the sticks and buttons that the robot's profile names. */

import { h, number, redraw, text } from "./dom.js";
import { rests, stickValue } from "./mapping.js";
import { Stopper } from "./stopper.js";

const PERIOD_MS = 50;
/** The kernel's names, as profiles have them, by their places in the browser's standard gamepad. */
const AXES = { ABS_X: 0, ABS_Y: 1, ABS_RX: 2, ABS_RY: 3 };
const BUTTONS = {
  BTN_SOUTH: 0, BTN_EAST: 1, BTN_WEST: 2, BTN_NORTH: 3, BTN_TL: 4, BTN_TR: 5, BTN_TL2: 6, BTN_TR2: 7,
  BTN_SELECT: 8, BTN_START: 9, BTN_THUMBL: 10, BTN_THUMBR: 11, BTN_MODE: 16,
};
const NO_PAD = "No gamepad is seen. Plug one in, and press one of its buttons.";

/**
 * When a pad may drive: from the moment at which its button is held with all sticks in their middle, if the button was
 * let go of since the lock, and as long as it is held.
 */
export class DeadMan {
  #released = false;

  constructor() {
    this.driving = false;
    /** Whether it would drive but for a stick that is not in its middle. */
    this.centring = false;
  }

  /** Drive no more before the button was let go of and pressed again. */
  lock() {
    this.driving = this.centring = this.#released = false;
  }

  /** What the pad says now: its button, and whether all sticks are in their middle. */
  step(held, neutral) {
    this.#released ||= !held;
    this.driving = held && this.#released && (this.driving || neutral);
    this.centring = held && this.#released && !this.driving;
  }
}

export class GamepadDriver {
  #station;
  #deadMan = new DeadMan();
  #stopper;
  #told = null;
  #pad = null;
  #pressed = new Set();
  #words = h("p", { class: "reason" }, NO_PAD);
  #axes = h("dl", { class: "axes" });
  #draw;
  #onHold;
  #onLetGo;

  /**
   * @param {object} station see station.js
   * @param {{onHold: function(): boolean, onLetGo: function(): void}} listener hears when the pad begins and ends to
   *   drive; false: it may not
   */
  constructor(station, { onHold, onLetGo }) {
    this.#station = station;
    this.#stopper = new Stopper(station);
    this.#onHold = onHold;
    this.#onLetGo = onLetGo;
    this.element = h("div", {}, this.#words, this.#axes);
    this.#draw = redraw(this.element, () => this.#show());
    setInterval(() => this.#look(), PERIOD_MS);
  }

  /** The mapping of another robot: the result of `drive.gamepad`, or null. */
  use(told) {
    this.#told = told;
    this.drop();
  }

  /** What the sticks command now, by command. */
  get commands() {
    const sticks = Object.entries(this.#told?.sticks ?? {});
    return Object.fromEntries(sticks.map(([command, stick]) => [command, stickValue(stick, this.#at(stick.axis))]));
  }

  /** Drive no more before the dead-man button was let go of and held again. */
  drop() {
    this.#deadMan.lock();
  }

  #look() {
    const before = this.#pad;
    this.#pad = document.hidden ? null : (navigator.getGamepads?.().find((pad) => pad?.connected) ?? null);
    if (!this.#pad && !before) return;
    const was = this.#deadMan.driving;
    if (this.#why) this.drop();
    else this.#step();
    if (this.#deadMan.driving && !was && !this.#onHold()) this.drop();
    if (!this.#deadMan.driving && was) this.#onLetGo();
    this.#draw();
  }

  /** Why it cannot drive; empty where it can. */
  get #why() {
    const { buttons, sticks } = this.#told ?? {};
    if (!this.#pad) return NO_PAD;
    if (this.#pad.mapping !== "standard") return `this browser does not know ${this.#pad.id}: \`canhelm drive joystick\``;
    if (!sticks) return this.#station.cannot("drive.set") ?? "no gamepad drives this vehicle";
    const axes = Object.values(sticks).map((stick) => stick.axis);
    const strange = axes.find((axis) => !(axis in AXES)) ?? (buttons.dead_man in BUTTONS ? null : buttons.dead_man);
    if (strange) return `the profile names ${strange}, which browsers do not know`;
    if (this.element.closest("[hidden]")) return "show this panel to drive";
    return "";
  }

  #step() {
    const { buttons, sticks, silence_s } = this.#told;
    this.#lookAtStops(buttons);
    const neutral = Object.values(sticks).every((stick) => rests(stick, this.#at(stick.axis)));
    this.#deadMan.step(this.#isDown(buttons.dead_man), neutral);
    const silent = silence_s && performance.now() - this.#pad.timestamp > silence_s * 1000;
    if (this.#deadMan.driving && !neutral && silent) {
      this.#station.say(`no word from the gamepad for ${silence_s} s: is it asleep, or out of reach?`, "warning");
      this.drop();
    }
  }

  #lookAtStops({ stop, emergency_stop }) {
    for (const [button, method] of [[stop, "stop"], [emergency_stop, "estop"]]) {
      const down = this.#isDown(button);
      if (down && !this.#pressed.has(button)) {
        this.#stopper.send(method, "pressed by gamepad");
        this.drop();
      }
      if (down) this.#pressed.add(button);
      else this.#pressed.delete(button);
    }
  }

  #isDown(button) {
    return Boolean(this.#pad?.buttons[BUTTONS[button]]?.pressed);
  }

  #at(axis) {
    return this.#pad?.axes[AXES[axis]] ?? 0;
  }

  #show() {
    const sticks = Object.entries(this.#told?.sticks ?? {});
    text(this.#words, this.#sentence());
    if (this.#axes.children.length !== 2 * sticks.length) {
      this.#axes.replaceChildren(...sticks.flatMap(([command]) => [h("dt", {}, command.replace("_", " ")), h("dd")]));
    }
    sticks.forEach(([, stick], i) => {
      text(this.#axes.children[2 * i + 1], `${stick.axis} ${number(this.#at(stick.axis), 2)}`);
    });
  }

  #sentence() {
    if (this.#why) return this.#why;
    const { dead_man, stop, emergency_stop } = this.#told.buttons;
    if (this.#deadMan.centring) return "Let the sticks go back to their middle, then it drives.";
    if (this.#deadMan.driving) return "Driving by gamepad.";
    return `Hold ${dead_man} to drive; ${stop} stops, ${emergency_stop} is the emergency stop.`;
  }
}
