/** Having a path driven: forwards or backwards, how fast, how far it is, and what came of it. */

import { allow, h, number, text } from "./dom.js";
import { field, put, putBack, settleWriting } from "./fields.js";

const METHOD = "drive.path";
const ANEW = "The path in the editor begins anew where the vehicle is now; the one it drove stays on the map as a thin line.";
const HINT =
  "Backwards exchanges forward and backward in the whole path. The page holds the drive: hide or close it, and the "
  + "vehicle comes to rest.";

/** The controls under the editor. Attribute `speed_m_s`: what is asked for; null for as fast as the vehicle may. */
export class Following {
  #driving = false;
  #moved = false;

  constructor(station, editor, check) {
    [this.station, this.editor, this.check, this.speed_m_s] = [station, editor, check, null];
    const limits = { min: 0.001, placeholder: "largest" };
    this.speed = field("Speed in metres a second", limits, (speed_m_s) => this.#ask(speed_m_s));
    this.ways = ["forwards", "backwards"].map((way) => this.#way(way));
    const drive = { type: "button", class: "main", id: "path-drive", onclick: () => this.#drive() };
    this.driveButton = h("button", drive, "Drive the path");
    this.stopButton = h("button", { type: "button", id: "path-stop", onclick: () => this.#stop() }, "Stop the drive");
    this.reason = h("p", { class: "reason" });
    this.bar = h("progress", { max: 1, value: 0, "aria-label": "Way driven" });
    this.told = h("p", { class: "value" });
    this.result = h("p", { role: "status" });
    this.progress = h("div", { class: "path-progress", hidden: true }, this.bar, this.told);
    this.element = this.#fieldset();
    document.addEventListener("visibilitychange", () => this.#watchTab());
  }

  #way(way) {
    const backward = way === "backwards";
    const change = () => this.editor.exchange(backward);
    const input = h("input", { type: "radio", name: "path-way", value: way, onchange: change });
    input.checked = !backward;
    return input;
  }

  #fieldset() {
    const ways = this.ways.map((input) => h("label", { class: "tick" }, input, input.value));
    return h(
      "fieldset",
      { class: "path-drive" },
      h("legend", {}, "Drive it"),
      h("div", { class: "row bottom" }, ...ways, h("label", { class: "field" }, "Speed [m/s]", this.speed)),
      h("div", { class: "row" }, this.driveButton, this.stopButton),
      this.reason,
      h("p", { class: "muted" }, HINT),
      this.progress,
      this.result,
    );
  }

  #ask(speed_m_s) {
    this.speed_m_s = speed_m_s;
    this.check().look();
  }

  /** How long a way lasts at least, in words. */
  lasts(length_m) {
    const { limits } = this.station.shape ?? {};
    const fastest = this.editor.exchanged && limits?.backward_m_s ? limits.backward_m_s : limits?.speed_m_s;
    const speed_m_s = Math.min(this.speed_m_s ?? Infinity, fastest ?? Infinity);
    const least_s = length_m / speed_m_s;
    return least_s > 0 ? `at least ${number(least_s, least_s < 10 ? 1 : 0)} s` : "";
  }

  // --- driving --------------------------------------------------------------------------------------------------

  /** A click may come before what was typed is drawn: it drives what stands in the boxes, or nothing. */
  async #drive() {
    settleWriting();
    if (this.#against()) return;
    const { robot } = this.station;
    [this.#driving, this.#moved] = [true, false];
    text(this.result, "");
    this.show();
    const told = await this.station.move(METHOD, this.check().params()).then(inWords, (error) => this.#tellEnd(error));
    this.#driving = false;
    const parts = [told, this.#moved && !this.editor.start ? ANEW : ""];
    text(this.result, robot === this.station.robot ? parts.join(" ").trim() : "");
    this.show();
  }

  /** Why it has ended early; that somebody stopped it is no error. */
  #tellEnd({ message, remedy = "", data }) {
    const told = `The path was not driven to its end: ${message}`;
    this.station.say(told, data?.type === "Refused" ? "warning" : "error", remedy);
    return told.endsWith(".") ? told : `${told}.`;
  }

  async #stop() {
    await this.station.attempt(this.station.call("stop", {}, { timeout_ms: 15_000 }), "Stop");
  }

  /** Nobody looks after a robot from a page that is hidden: let go of it, without waiting for the lease to run out. */
  #watchTab() {
    if (!document.hidden || !this.#driving) return;
    this.station.attempt(this.station.call("lease.close", {}, { timeout_ms: 15_000 }), "Letting go");
    const remedy = "keep the page in sight while it drives";
    this.station.say("The page was hidden: the vehicle comes to rest", "warning", remedy);
  }

  // --- showing --------------------------------------------------------------------------------------------------

  show() {
    const { exchanged } = this.editor;
    for (const input of this.ways) input.checked = (input.value === "backwards") === exchanged;
    const noReverse = this.station.shape?.path?.smallest_radius_backward_m === null;
    allow(this.ways[1], noReverse ? "this vehicle cannot drive backwards" : null);
    const against = this.#against();
    allow(this.driveButton, against);
    this.stopButton.disabled = !this.station.connected;
    text(this.reason, this.#driving ? "" : against ?? "");
    this.#showProgress(this.station.status?.vehicle?.following ?? null);
  }

  #against() {
    if (this.#driving) return "it is driving";
    if (!this.editor.entries.length) return "there is no path yet";
    const { kind, message } = this.check().verdict;
    return this.station.cannot(METHOD) ?? (kind === "bad" ? message : null);
  }

  #showProgress(following) {
    this.progress.hidden = !following;
    if (!following) return;
    this.#moved = true;
    const { progress_m, length_m, error_m, backward } = following;
    const share = length_m > 0 ? Math.min(1, Math.max(0, progress_m / length_m)) : 0;
    if (Math.abs(this.bar.value - share) > 0.002) this.bar.value = share;
    const way = `${number(progress_m)} of ${number(length_m)} m ${backward ? "backward" : "forward"}`;
    text(this.told, `${way}, ${number(Math.abs(error_m) * 100, 1)} cm beside the path`);
  }

  /** The next robot has other limits. */
  forget() {
    putBack(this.element);
    put(this.speed, "");
    this.speed_m_s = null;
    text(this.result, "");
  }
}

/** The result of a drive for people; vehicles that stop on the way tell other numbers. */
function inWords({ duration_s, end_error_m, error_m, largest_error_m, driven_deviation_m }) {
  const cm = (value_m) => `${number(value_m * 100, 1)} cm`;
  const end_m = end_error_m ?? error_m;
  const most_m = largest_error_m ?? driven_deviation_m;
  const parts = [
    `Arrived after ${number(duration_s, 1)} s`,
    end_m != null && `${cm(end_m)} beside the end`,
    most_m != null && `at most ${cm(most_m)} beside the path`,
  ];
  return `${parts.filter(Boolean).join(", ")}.`;
}
