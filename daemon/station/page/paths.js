/** The panel of paths: draw, check, keep and drive them, and see the errors meanwhile. */

import { ErrorCharts, SpeedChart } from "./charts.js";
import { h, redraw } from "./dom.js";
import { putBack, wrongIn } from "./fields.js";
import { Following } from "./following.js";
import { PathCheck } from "./path_check.js";
import { editorOf, SNAP_DEG, SNAP_M } from "./path_editor.js";
import { PathFiles } from "./path_files.js";
import { StartFields } from "./path_start.js";
import { PathTable } from "./path_table.js";
import { VerdictText } from "./path_verdict.js";
import { openNewestRun } from "./runs.js";

const WRITING = "input, textarea, select";
const HINT =
  "On the map drag the square where the path begins, its knob, and the dots where pieces end; add lines and arcs by "
  + "clicks. Alt switches the snap off, Ctrl-Z and Ctrl-Y undo and redo.";

/** The panel. */
export function create(station) {
  return new PathsPanel(station).element;
}

class PathsPanel {
  constructor(station) {
    this.station = station;
    this.editor = editorOf(station);
    this.following = new Following(station, this.editor, () => this.check);
    this.check = new PathCheck(station, this.editor, this.#boxes());
    this.verdict = new VerdictText(this.check, (length_m) => this.following.lasts(length_m));
    this.files = new PathFiles(station, this.editor, this.check);
    this.table = new PathTable(this.editor);
    this.start = new StartFields(this.editor);
    this.errors = new ErrorCharts(station);
    this.speeds = new SpeedChart(station);
    this.#make();
    this.#listen();
    this.#show();
  }

  /** What the check asks the boxes of this panel. */
  #boxes() {
    return { speed_m_s: () => this.following.speed_m_s, wrong: () => wrongIn(this.element) };
  }

  #make() {
    this.lacking = h("p", { class: "reason", hidden: true }, "This vehicle follows no paths.");
    const { verdict, following, files, speeds } = this;
    const parts = [verdict.element, following.element, this.#errorsPart(), ...this.#editorPart(), files.element];
    this.body = h("div", { class: "path-body" }, ...parts);
    const unfold = { ontoggle: () => speeds.chart.changed() };
    const fold = h("details", unfold, h("summary", {}, "Speed of a drive"), speeds.element);
    const title = h("h2", { id: "paths-title" }, "Paths");
    this.element = h("section", { "aria-labelledby": "paths-title" }, title, this.lacking, this.body, fold);
  }

  #errorsPart() {
    const title = h("h3", { id: "errors-title" }, "Errors beside the path, left positive");
    const open = h("a", { class: "button", href: "#runs", onclick: openNewestRun }, "Open the newest run");
    return h("section", { class: "path-errors", "aria-labelledby": "errors-title" }, title, this.errors.element, open);
  }

  #editorPart() {
    const button = (title, act) => h("button", { type: "button", onclick: act }, title);
    const { editor } = this;
    this.undo = button("Undo", () => editor.undo());
    this.redo = button("Redo", () => editor.redo());
    this.clear = button("Clear", () => this.#begin());
    this.snap = h("input", { type: "checkbox", onchange: () => editor.set("snaps", this.snap.checked) });
    const line = button("Insert a line", () => editor.insert("line"));
    const arc = button("Insert an arc", () => editor.insert("arc"));
    const pieces = h(
      "fieldset",
      {},
      h("legend", {}, "Pieces"),
      this.table.element,
      h("div", { class: "row" }, line, arc, this.undo, this.redo, this.clear),
      h("label", { class: "tick" }, this.snap, `Snap to ${SNAP_M} m and ${SNAP_DEG}°`),
      h("p", { class: "muted" }, HINT),
    );
    return [this.start.element, pieces];
  }

  /** Begin a new path; what was asked about the one before it is withdrawn. */
  #begin() {
    this.files.question.close();
    this.editor.clear();
  }

  #listen() {
    const { station } = this;
    const show = redraw(this.element, () => this.#show());
    this.editor.addEventListener("change", show);
    this.check.addEventListener("change", show);
    this.element.addEventListener("judged", () => this.check.look());
    this.editor.addEventListener("undo", (event) => putBack(this.element) && event.preventDefault());
    for (const kind of ["status", "connected", "shape", "stale"]) station.on(kind, show);
    station.on("robot", () => this.following.forget());
    document.addEventListener("keydown", (event) => this.#onKey(event));
    new ResizeObserver(show).observe(this.element);
  }

  /** Undo and redo, where no text is being written. */
  #onKey(event) {
    if (!(event.ctrlKey || event.metaKey) || event.target.matches?.(WRITING)) return;
    const key = event.key.toLowerCase();
    if (key === "y" || (key === "z" && event.shiftKey)) this.editor.redo();
    else if (key === "z") this.editor.undo();
    else return;
    event.preventDefault();
  }

  #show() {
    const { editor, station } = this;
    const lacks = Boolean(station.shape && !station.shape.path);
    this.lacking.hidden = !lacks;
    this.body.hidden = lacks;
    [this.undo.disabled, this.redo.disabled] = [!editor.undoable && !this.check.wrong(), !editor.redoable];
    this.clear.disabled = !editor.entries.length;
    this.snap.checked = editor.snaps;
    for (const part of [this.table, this.start]) part.show();
    this.check.look();
    for (const part of [this.verdict, this.following, this.files]) part.show();
  }
}
