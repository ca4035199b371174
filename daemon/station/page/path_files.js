/** Paths that are kept: load, save, delete, import, export, and recording the way that is driven. */

import { allow, h, text } from "./dom.js";
import { settleWriting } from "./fields.js";
import { Question } from "./question.js";

/** What fits into one message to the station. */
const MOST_BYTES = 60_000;
const TOO_LONG = "put it into the robot's folder of paths, or drive it by `canhelm drive path`";
const EXCHANGED = "Save and Export write the path as it is driven: backwards.";
const NAME = "[A-Za-z0-9][A-Za-z0-9_\\-]{0,59}";

/** The controls above the editor. */
export class PathFiles {
  #recording = false;

  constructor(station, editor, check) {
    [this.station, this.editor, this.check] = [station, editor, check];
    this.select = h("select", { id: "path-kept", onchange: () => this.show() });
    this.name = h("input", { type: "text", pattern: NAME, maxlength: 60, oninput: () => this.#renamed() });
    this.file = h("input", { type: "file", accept: ".yaml,.yml,.json", hidden: true, onchange: () => this.#import() });
    this.question = new Question("Confirm");
    this.buttons = {
      load: this.#button("Load", () => this.#load()),
      remove: this.#button("Delete", () => this.#delete()),
      save: this.#button("Save", () => this.#save()),
      importing: this.#button("Import…", () => this.file.click()),
      exporting: this.#button("Export", () => this.#export()),
      record: this.#button("Record a drive", () => this.#record()),
    };
    this.writing = h("p", { class: "reason", role: "status" });
    this.why = h("p", { class: "reason" });
    this.told = h("p", { class: "reason", role: "status" });
    this.element = this.#fieldset();
    station.on("connected", () => this.#connected());
    station.on("robot", () => this.#forget());
    addEventListener("hashchange", () => location.hash === "#paths" && station.connected && this.#list());
  }

  #button(title, act) {
    return h("button", { type: "button", onclick: act }, title);
  }

  #fieldset() {
    const { load, remove, save, importing, exporting, record } = this.buttons;
    const row = (...parts) => h("div", { class: "row bottom" }, ...parts);
    return h(
      "fieldset",
      {},
      h("legend", {}, "Kept paths"),
      row(h("label", { class: "field" }, "Path", this.select), load, remove),
      row(h("label", { class: "field" }, "Name", this.name), save, importing, exporting, this.file),
      this.writing,
      this.question.element,
      row(record),
      this.why,
      this.told,
    );
  }

  show() {
    const { station, buttons, select, editor, name } = this;
    const chosen = select.value ? null : "no path is kept yet";
    const empty = this.#unwritable();
    const named = name.value && name.checkValidity() ? null : "give it a name: letters, digits, - and _";
    const load = chosen ?? station.cannot("station.path.read");
    const remove = chosen ?? station.cannot("station.path.delete");
    const save = empty ?? named ?? station.cannot("station.path.write");
    const record = station.cannot("station.record.start");
    allow(buttons.load, load);
    allow(buttons.remove, remove);
    allow(buttons.save, save);
    allow(buttons.exporting, empty);
    const parse = station.cannot("station.path.parse");
    allow(buttons.importing, parse);
    text(this.writing, editor.entries.length ? this.check.wrong() ?? (editor.exchanged ? EXCHANGED : "") : "");
    allow(buttons.record, record);
    const elsewhere = save === this.writing.textContent;
    const reasons = { Load: load, Delete: remove, Save: elsewhere ? null : save, "Import…": parse, Record: record };
    text(this.why, reasonsOf(reasons));
    text(buttons.record, this.#recording ? "End the recording" : "Record a drive");
  }

  /** Why what is on the screen cannot be written into a file; null where it can. */
  #unwritable() {
    return this.editor.entries.length ? this.check.wrong() : "there is no path yet";
  }

  // --- kept paths -----------------------------------------------------------------------------------------------

  #connected() {
    this.#recording = false;
    if (this.station.connected) {
      this.#list();
      this.#askRecording();
    }
    this.show();
  }

  #forget() {
    this.select.replaceChildren();
    this.name.value = "";
    text(this.told, "");
    this.question.close();
    this.#recording = false;
  }

  async #list(chosen = this.select.value) {
    const answer = await this.station.attempt(this.station.call("station.paths"), "Kept paths");
    if (!answer) return;
    const options = answer.paths.map(({ name, length_m }) => h("option", { value: name }, titled(name, length_m)));
    this.select.replaceChildren(...options);
    if (answer.paths.some(({ name }) => name === chosen)) this.select.value = chosen;
    this.show();
  }

  async #load() {
    const name = this.select.value;
    const call = this.station.call("station.path.read", { name, here: this.editor.here() });
    const answer = await this.station.attempt(call, `Path ${name}`);
    if (answer) this.#take(answer.path, name, `${name} is in the editor.`);
  }

  /** Put a path into the editor, whole or not at all; what was asked about the one before it is withdrawn. */
  #take(path, name, told) {
    const turned = this.editor.exchanged ? " It is driven as it is written: forwards is chosen again." : "";
    const { taken, lost } = this.editor.load(path);
    if (!taken) return this.station.say(`Path: ${lost}`, "error", "drive it by `canhelm drive path`, which tells why");
    if (lost) this.station.say(`Path: ${lost}`, "warning", "look at it on the map before it is driven");
    this.name.value = name;
    this.#renamed();
    return text(this.told, `${told}${turned}`);
  }

  #renamed() {
    this.question.close();
    this.show();
  }

  #save() {
    settleWriting();
    if (this.#unwritable()) return;
    const name = this.name.value;
    const exists = [...this.select.options].some(({ value }) => value === name);
    if (exists) this.question.ask(`Replace the path ${name}?`, "Replace", () => this.#write(name, true));
    else this.#write(name, false);
  }

  async #write(name, replace) {
    if (this.#unwritable()) return;
    const how = this.editor.exchanged ? ", as it is driven backwards" : "";
    const params = { name, path: this.editor.drivenSpec(), replace };
    if (!(await this.station.attempt(this.station.call("station.path.write", params), `Path ${name}`))) return;
    text(this.told, `${name} is saved${how}.`);
    this.#list(name);
    this.#warn(`${name} is saved`);
  }

  #delete() {
    const name = this.select.value;
    this.question.ask(`Delete the path ${name}?`, "Delete for good", () => this.#remove(name));
  }

  async #remove(name) {
    if (!(await this.station.attempt(this.station.call("station.path.delete", { name }), `Path ${name}`))) return;
    text(this.told, `${name} is deleted.`);
    this.#list();
  }

  // --- files of this machine ------------------------------------------------------------------------------------

  async #import() {
    const [file] = this.file.files;
    this.file.value = "";
    if (!file) return null;
    const content = await shortText(file);
    if (content === null) return this.station.say(`${file.name} is too long for a page`, "error", TOO_LONG);
    const params = { file: file.name, lines: content.split("\n"), here: this.editor.here() };
    const call = this.station.call("station.path.parse", params);
    const answer = await this.station.attempt(call, "Import");
    if (!answer) return null;
    const name = file.name.replace(/\.\w+$/, "").replace(/[^A-Za-z0-9_-]/g, "-");
    return this.#take(answer.path, name, `${file.name} is in the editor.`);
  }

  /** JSON is YAML, too: `canhelm drive path` reads it. */
  #export() {
    settleWriting();
    if (this.#unwritable()) return;
    const content = `${JSON.stringify(this.editor.drivenSpec(), null, 1)}\n`;
    const href = URL.createObjectURL(new Blob([content], { type: "application/json" }));
    h("a", { href, download: `${this.name.value || "path"}.json` }).click();
    setTimeout(() => URL.revokeObjectURL(href), 1000);
  }

  // --- recording ------------------------------------------------------------------------------------------------

  /** A recording goes on while pages come and go. */
  async #askRecording() {
    const answer = await this.station.call("station.record").catch(() => null);
    this.#recording = Boolean(answer?.recording);
    this.show();
  }

  async #record() {
    if (this.#recording) await this.#endRecording();
    else if (await this.station.attempt(this.station.call("station.record.start"), "Recording")) {
      this.#recording = true;
      text(this.told, "Recording: drive the way, then end the recording.");
    }
    this.show();
  }

  async #endRecording() {
    this.#recording = false;
    const call = this.station.call("station.record.stop", { keep: false }, { timeout_ms: 60_000 });
    const answer = await this.station.attempt(call, "Recording");
    if (!answer) return text(this.told, "Nothing was recorded.");
    const { path, length_m, pieces, trouble } = answer;
    if (trouble) this.station.say(`The recorded way is not whole: ${trouble}`, "warning");
    this.#take(path, this.name.value, `The recorded way is in the editor: ${length_m.toFixed(2)} m, ${pieces} pieces.`);
    return this.#warn("The recorded way is in the editor");
  }

  /** Tell of a piece that this vehicle cannot drive, whatever was done with the path. */
  async #warn(done) {
    const { kind, piece, message, remedy } = await this.check.settled();
    if (kind !== "bad" || piece === null) return;
    this.station.say(`${done}, but it cannot be driven: ${message}`, "warning", remedy);
  }
}

/** Reasons by the buttons that they keep from being used, each reason once. */
function reasonsOf(told) {
  const given = Object.entries(told).filter(([, reason]) => reason);
  const reasons = [...new Set(given.map(([, reason]) => reason))];
  const names = (reason) => given.filter(([, other]) => other === reason).map(([name]) => name);
  return reasons.map((reason) => `${names(reason).join(", ")}: ${reason}.`).join(" ");
}

function titled(name, length_m) {
  return length_m == null ? name : `${name} (${length_m.toFixed(1)} m)`;
}

/** The text of a file; null where it is longer than one message to the station may be. */
async function shortText(file) {
  if (file.size > MOST_BYTES) return null;
  const content = await file.text();
  return new Blob([JSON.stringify(content.split("\n"))]).size > MOST_BYTES ? null : content;
}
