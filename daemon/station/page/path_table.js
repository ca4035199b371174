/** The table of a path's pieces: every number of it, for the keyboard. */

import { attribute, h, text } from "./dom.js";
import { choice, field, put } from "./fields.js";
import { Rows, table } from "./rows.js";

const HEADS = ["No.", "Shape", "Length [m]", "Radius [m]", "Turn left [°]", "Drive", "Remove"];
/** What stands above a box where a phone shows a piece as a card. */
const SHORT = { length_m: "Length [m]", radius_m: "Radius [m]", arc_deg: "Turn left [°]" };
const LENGTH = { min: 0.01, max: 10000, required: true };
const TURN = { min: -3600, max: 3600, required: true };
const NO_TURN = "an arc turns: give degrees, or choose a line";
const SHAPES = { line: "line", arc: "arc" };
const DRIVES = { forward: "forward", backward: "backward" };
const LABELS = {
  kind: (piece) => `Shape of ${piece}`,
  length_m: (piece) => `Length of ${piece} in metres`,
  radius_m: (piece) => `Radius of ${piece} in metres`,
  arc_deg: (piece) => `Turn of ${piece} in degrees, left positive`,
  drive: (piece) => `Driving direction of ${piece}`,
  remove: (piece) => `Remove ${piece}`,
};

/** What a line becomes as an arc, and an arc as a line. */
const AS = {
  line: ({ length_m, radius_m, arc_deg }) => ({ length_m: length_m ?? arcLength(radius_m, arc_deg) }),
  arc: ({ length_m }) => ({ radius_m: Math.max(length_m, 1), arc_deg: 45 }),
};

function arcLength(radius_m, arc_deg) {
  return Number((radius_m * Math.abs(arc_deg) * Math.PI / 180).toFixed(3));
}

/** The table of an editor's pieces, kept as the editor changes. */
export class PathTable {
  #rows;

  constructor(editor) {
    this.editor = editor;
    const { table: element, body } = table("Pieces of the path", HEADS);
    attribute(element, "role", "table");
    attribute(body, "role", "rowgroup");
    this.element = h("div", { class: "scroll path-pieces" }, element);
    this.#rows = new Rows(body, ({ entry }) => this.#make(entry.id), ({ entry }) => entry.id);
  }

  show() {
    this.element.hidden = !this.editor.entries.length;
    this.#rows.show(this.editor.entries.map((entry, index) => ({ index, entry })));
  }

  /** The row of an entry, whatever the number of its piece becomes. */
  #make(id) {
    const index = () => this.editor.entries.findIndex((entry) => entry.id === id);
    const change = (numbers) => index() >= 0 && this.editor.change(index(), numbers);
    const cells = {
      kind: choice("", SHAPES, (kind) => this.#reshape(index(), kind)),
      length_m: field("", LENGTH, (length_m) => change({ length_m })),
      radius_m: field("", LENGTH, (radius_m) => change({ radius_m })),
      arc_deg: field("", TURN, (arc_deg) => change({ arc_deg }), (arc_deg) => (arc_deg ? "" : NO_TURN)),
      drive: choice("", DRIVES, (drive) => change({ backward: drive === "backward" })),
      remove: h("button", { type: "button", onclick: () => this.#remove(index()) }, "✕"),
    };
    const head = h("th", { scope: "row", role: "rowheader" });
    const told = (name) => ({ role: "cell", "data-cell": name, "data-head": SHORT[name] });
    const columns = Object.entries(cells).map(([name, cell]) => h("td", told(name), cell));
    const element = h("tr", { role: "row", onfocusin: () => this.editor.set("chosen", index()) }, head, ...columns);
    return { element, show: ({ index: number, entry }) => this.#show(element, head, cells, number, entry) };
  }

  #show(element, head, cells, index, entry) {
    const { kind, length_m, radius_m, arc_deg, backward } = entry;
    text(head, index);
    for (const [name, cell] of Object.entries(cells)) attribute(cell, "aria-label", LABELS[name](`piece ${index}`));
    const isArc = kind === "arc";
    attribute(element, "data-chosen", this.editor.chosen === index);
    attribute(element, "data-wrong", this.editor.problem?.piece === index);
    [cells.length_m.disabled, cells.radius_m.disabled, cells.arc_deg.disabled] = [isArc, !isArc, !isArc];
    put(cells.kind, kind);
    put(cells.drive, backward ? "backward" : "forward");
    put(cells.length_m, isArc ? arcLength(radius_m, arc_deg) : length_m);
    put(cells.radius_m, isArc ? radius_m : "");
    put(cells.arc_deg, isArc ? arc_deg : "");
  }

  #reshape(index, kind) {
    const { id, backward, ...before } = this.editor.entries[index];
    if (kind === before.kind) return;
    this.editor.edit((state) => {
      state.entries[index] = { kind, ...AS[kind](before), backward, id };
    });
  }

  /** Take a piece away; the focus goes to the one that comes in its place. */
  #remove(index) {
    this.editor.remove(index);
    this.show();
    const buttons = this.element.querySelectorAll("tbody button");
    buttons[Math.min(index, buttons.length - 1)]?.focus();
  }
}
