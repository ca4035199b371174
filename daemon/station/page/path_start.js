/** Where a path begins: at the vehicle, or at a place given by numbers. */

import { h } from "./dom.js";
import { field, put } from "./fields.js";

const PLACE = { min: -1e5, max: 1e5, required: true };
const TURN = { min: -360, max: 360, required: true };

/** Numbers of a path where it begins; empty fields where it begins at the vehicle. */
export class StartFields {
  constructor(editor) {
    this.editor = editor;
    this.here = h("input", { type: "checkbox", id: "path-here", onchange: () => this.#toggle() });
    this.fields = {
      x_m: field("x of the start in metres", PLACE, (x_m) => this.#change({ x_m })),
      y_m: field("y of the start in metres", PLACE, (y_m) => this.#change({ y_m })),
      heading_deg: field("Heading of the start in degrees", TURN, (heading_deg) => this.#change({ heading_deg })),
    };
    const named = { x_m: "x [m]", y_m: "y [m]", heading_deg: "Heading [°]" };
    const labelled = ([name, input]) => h("label", { class: "field" }, named[name], input);
    const fields = Object.entries(this.fields).map(labelled);
    const tick = h("label", { class: "tick", for: "path-here" }, this.here, "Begin where the vehicle is");
    this.element = h("fieldset", {}, h("legend", {}, "Start"), tick, h("div", { class: "row bottom" }, ...fields));
  }

  #toggle() {
    this.editor.begin(this.here.checked ? null : this.editor.here());
  }

  #change(numbers) {
    this.editor.begin({ ...this.editor.start, ...numbers });
  }

  show() {
    const { start } = this.editor;
    this.here.checked = !start;
    for (const [name, input] of Object.entries(this.fields)) {
      input.disabled = !start;
      put(input, start?.[name] ?? "");
    }
  }
}
