/** What is said instead of the panels where there is no robot: none runs, or none of the name that was asked for. */

import { h, text } from "./dom.js";

const START = [
  ["a simulated one", "canhelm run --simulate --profile max2d"],
  ["one of your own", "canhelm run --profile FILE"],
  ["one that is a service", "systemctl start canhelm@NAME"],
];

export class Absent {
  #station;
  #choose;
  #element = document.getElementById("absent");
  #title = h("h2", { id: "absent-title" });
  #why = h("p");
  #remedy = h("p");
  #ways = h("dl", {}, START.flatMap(([what, command]) => [h("dt", {}, what), h("dd", {}, h("code", {}, command))]));
  #others = h("div", { class: "row" });

  /**
   * @param {object} station see station.js
   * @param {function(string): void} choose chooses a robot
   */
  constructor(station, choose) {
    this.#station = station;
    this.#choose = choose;
    this.#element.append(this.#title, this.#why, this.#remedy, this.#ways, this.#others);
  }

  /** See whether there is a robot to show. */
  show({ robots, answers = true }) {
    const { robot, status, connected, reason, remedy } = this.#station;
    this.#element.hidden = robot ? Boolean(status) || connected || !reason : false;
    if (this.#element.hidden) return;
    const nothing = answers ? "No robot runs on this machine" : "The control station does not answer";
    text(this.#title, robot ? `No word from ${robot}` : nothing);
    text(this.#why, robot ? `${reason}.` : this.#whyNone(answers));
    text(this.#remedy, remedy ? `What to do: ${remedy}.` : "");
    this.#ways.hidden = Boolean(robot) || !answers;
    this.#offer(robots.filter(({ name, alive }) => alive && name !== robot));
  }

  #whyNone(answers) {
    if (!answers) return "Is it still running? `canhelm station` starts it; this page goes on by itself.";
    return "Start one on the machine of the station; this page shows it as soon as it answers:";
  }

  #offer(robots) {
    const names = robots.map(({ name }) => name);
    if (this.#others.dataset.told === names.join()) return;
    this.#others.dataset.told = names.join();
    const buttons = names.map((name) => h("button", { type: "button", onclick: () => this.#choose(name) }, name));
    this.#others.replaceChildren(...(names.length ? [h("span", {}, "Robots that run: "), ...buttons] : []));
  }
}
