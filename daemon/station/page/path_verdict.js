/** What the daemon says of the path in the editor, in words. */

import { attribute, h, number, text } from "./dom.js";

/** A line that says whether the path can be driven; `duration` tells how long a way lasts. */
export class VerdictText {
  constructor(check, duration) {
    [this.check, this.duration] = [check, duration];
    this.head = h("strong");
    this.rest = h("span");
    this.element = h("p", { class: "path-verdict", role: "status" }, this.head, " ", this.rest);
  }

  show() {
    const { verdict } = this.check;
    attribute(this.element, "data-verdict", verdict.kind);
    const [head, rest] = this.#words(verdict);
    text(this.head, head);
    text(this.rest, rest);
  }

  #words({ kind, summary, message, remedy }) {
    if (kind === "none") return ["No path yet.", "Add a line or an arc here or on the map, or load a path."];
    if (kind === "asking") return ["Checking …", ""];
    if (kind === "unknown") return ["Not checked:", message];
    if (kind === "bad") return ["✖ Cannot be driven:", remedy ? `${message} – ${remedy}` : message];
    return ["✔ Can be driven:", [...sizes(summary), this.duration(summary.length_m)].filter(Boolean).join(", ")];
  }
}

/** Sizes of a path from the answer to a dry run, in words. */
function sizes({ length_m, sections, stops, least_radius_m, deviation_m }) {
  return [
    `${number(length_m)} m`,
    sections != null && `${sections} ${sections === 1 ? "section" : "sections"}`,
    stops != null && `${stops} ${stops === 1 ? "stop" : "stops"} on the way`,
    least_radius_m != null && `least radius ${number(least_radius_m)} m`,
    deviation_m != null && `driven at most ${number(deviation_m * 100, 1)} cm beside it`,
  ].filter(Boolean);
}
