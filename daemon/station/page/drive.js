/** The panel for driving by hand: by stick, sliders, keys or gamepad, each only while it is held. */

import { allow, h, number, quantity, redraw, text } from "./dom.js";
import { GamepadDriver } from "./gamepad.js";
import { Keyboard } from "./keyboard.js";
import { TakenAtRest, asideOf, parametersOf, rangesOf, shareOf } from "./mapping.js";
import { createMotions } from "./motions.js";
import { SetPoints } from "./setpoints.js";
import { Sliders } from "./sliders.js";
import { Stick } from "./stick.js";

const ASIDE_WORDS = { sideways: "aside: sideways", steering: "aside: steering", yaw_rate: "aside: turning" };

class DrivePanel {
  #station;
  #setPoints;
  #ranges = {};
  #aside = null;
  #takenAtRest = [];
  #taken = new TakenAtRest([]);
  #learning = true;
  #hands;
  #byGamepad;
  #motions;
  #sliders;
  #stick = new Stick(this.#control((stick) => this.#byStick(stick), () => this.#stick));
  #keyboard = new Keyboard(this.#control((keys) => this.#byStick(keys), () => this.#keyboard));
  #gamepad;
  #why = h("p", { class: "reason", id: "why-drive", role: "status" });
  #asideHint = h("p", { class: "reason" });
  #sent = h("output", { id: "commanded" });
  #guarded = h("p", { class: "warn", id: "guarded", role: "status" });

  constructor(station) {
    this.#station = station;
    this.#setPoints = new SetPoints(station);
    this.#setPoints.onSent = (parameters) => text(this.#sent, wordsOf(parameters));
    this.#sliders = new Sliders(this.#control((sliders) => sliders.commands, () => this.#sliders));
    const byPad = this.#control((pad) => this.#sliders.slowed(pad.commands), () => this.#gamepad);
    this.#gamepad = new GamepadDriver(station, byPad);
    this.#motions = createMotions(station);
    this.element = this.#build();
    this.#listen(redraw(this.element, () => this.#show()));
    text(this.#sent, wordsOf(null));
  }

  /** What a control calls when it is taken and let go of; its own values count while it is held. */
  #control(commands, control) {
    const source = {
      values: () => parametersOf(this.#taken.apply(commands(control())), this.#sliders.fastest),
      onLost: () => control().drop(),
    };
    return {
      onHold: () => {
        if (!this.#setPoints.source) this.#taken = new TakenAtRest(this.#takenAtRest);
        const held = this.#setPoints.hold(source);
        if (!held) control().drop();
        return held;
      },
      onLetGo: () => this.#setPoints.release(source),
    };
  }

  /** A stick or keys: forward and aside by themselves, everything else as the sliders stand. */
  #byStick({ forward, left }) {
    const { speed } = this.#ranges;
    const commands = { ...this.#sliders.commands, speed: speed ? shareOf(speed, forward) : 0 };
    if (this.#aside) commands[this.#aside] = shareOf(this.#ranges[this.#aside], left);
    return this.#sliders.slowed(commands);
  }

  #build() {
    const commanded = h("p", { class: "commanded" }, "Commanded: ", this.#sent);
    const byStick = h("div", {}, this.#stick.element, this.#asideHint, commanded, this.#guarded);
    const byKeys = h("div", { class: "row" }, this.#keyboard.button, this.#keyboard.hint);
    this.#hands = h("div", { class: "stack" }, h("div", { class: "hands" }, byStick, this.#sliders.element), byKeys);
    this.#byGamepad = h("div", { class: "stack" }, h("h3", {}, "Gamepad"), this.#gamepad.element);
    return h(
      "section",
      { class: "drive" },
      h("h2", {}, "Drive by hand"),
      this.#why,
      this.#hands,
      this.#byGamepad,
      this.#motions.element,
    );
  }

  #listen(draw) {
    const station = this.#station;
    for (const kind of ["status", "connected", "stale"]) {
      station.on(kind, () => {
        this.#letGoWhereItMust();
        draw();
      });
    }
    station.on("robot", () => (this.#learning = true));
    station.on("shape", () => this.#learn().then(draw));
    const letGo = () => this.#setPoints.releaseAll();
    for (const end of ["blur", "pagehide", "hashchange"]) addEventListener(end, letGo);
    document.addEventListener("visibilitychange", () => document.hidden && letGo());
  }

  /** How this vehicle is driven: its sticks, where it has any. */
  async #learn() {
    const { shape } = this.#station;
    this.#learning = true;
    const told = await this.#station.call("drive.gamepad").catch(() => null);
    if (shape !== this.#station.shape) return;
    this.#learning = false;
    const taken = told?.taken_at_rest ?? [];
    this.#setPoints.releaseAll();
    this.#ranges = rangesOf(told, shape);
    this.#takenAtRest = taken;
    this.#aside = asideOf(this.#ranges, taken);
    this.#stick.twoWays = this.#aside !== null;
    this.#gamepad.use(told);
    this.#sliders.use(this.#ranges);
    const standing = `${taken.join(" and ")} count as they stand when it begins to roll: set them by the sliders first`;
    text(this.#asideHint, ASIDE_WORDS[this.#aside] ?? (taken.length ? standing : ""));
  }

  #letGoWhereItMust() {
    if (!this.#setPoints.source) return;
    const reason = this.#station.cannot("drive.set");
    if (!reason) return;
    this.#setPoints.releaseAll();
    if (this.#station.status?.state !== "estop") this.#station.say(`not driving any more: ${reason}`, "warning");
  }

  #show() {
    const lack = this.#station.lacks("drive.set");
    const reason = this.#station.cannot("drive.set") ?? (this.#learning ? "its limits are being asked for" : null);
    text(this.#why, lack ?? (reason ? `Cannot be driven now: ${reason}` : ""));
    this.#hands.hidden = this.#byGamepad.hidden = Boolean(lack);
    this.#why.hidden = !reason;
    this.#stick.allow(reason);
    this.#sliders.allow(reason);
    allow(this.#keyboard.button, reason);
    this.#guarded.hidden = this.#station.status?.vehicle?.jackknife_margin_deg === undefined;
    text(this.#guarded, wordsOfGuard(this.#station.status));
    this.#motions.show();
  }
}

/** Commanded speed that is told as standing. */
const STANDS_M_S = 0.005;
const UNITS = {
  speed_m_s: ["speed", 2, "m/s"],
  direction_deg: ["direction", 0, "°"],
  yaw_rate_deg_s: ["yaw rate", 0, "°/s"],
  steering_deg: ["steering", 1, "°"],
};

function wordsOf(parameters) {
  if (!parameters) return "nothing";
  const told = Object.entries(UNITS).filter(([name]) => parameters[name] !== undefined);
  return told.map(([name, [word, digits, unit]]) => `${word} ${quantity(parameters[name], digits, unit)}`).join(", ");
}

/** What the guard against jackknifing does to a motion; "" where it does nothing. */
function wordsOfGuard(status) {
  const held = status?.motions.find((motion) => motion.limits_active?.includes("jackknife"));
  if (!held) return "";
  const bent = `the trailer is bent by ${number(Math.abs(status.vehicle.bending_deg), 1)}°`;
  if (Math.abs(held.speed_m_s) > STANDS_M_S) return `Slowed: ${bent}, which is near its largest angle.`;
  return `Stands at its largest bending angle: ${bent}. Drive the other way.`;
}

/** The panel, as main.js shows it. */
export function create(station) {
  return new DrivePanel(station).element;
}
