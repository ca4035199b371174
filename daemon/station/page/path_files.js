/** Paths that are kept: load, save, delete, import, export, and recording the way that is driven. */

import { allow, h, text } from "./dom.js";
import { settleWriting } from "./fields.js";
import { Question } from "./question.js";

const NAME = "[A-Za-z0-9][A-Za-z0-9_\\-]{0,59}";

/** The controls above the editor. */
export class PathFiles {
  #recording = false;

  constructor(station, editor, check) {
    [this.station, this.editor, this.check] = [station, editor, check];
    this.select = h("select", { id: "path-kept", onchange: () => this.show() });
    this.name = h("input", { type: "text", pattern: NAME, maxlength: 60, oninput: () => this.show() });
    this.file = h("input", { type: "file", accept: ".json", hidden: true, onchange: () => this.#import() });
    this.question = new Question("Confirm");
    this.buttons = {
      load: this.#button("Load", () => this.#load()),
      remove: this.#button("Delete", () => this.#delete()),
      save: this.#button("Save", () => this.#save()),
      importing: this.#button("Import…", () => this.file.click()),
      exporting: this.#button("Export", () => this.#export()),
      record: this.#button("Record a drive", () => this.#record()),
    };
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
      this.question.element,
      row(record),
      this.told,
    );
  }

  show() {
    const { station, buttons, select, editor, name } = this;
    const chosen = select.value ? null : "no path is kept yet";
    const empty = this.#unwritable();
    const named = name.value && name.checkValidity() ? null : "give it a name: letters, digits, - and _";
    allow(buttons.load, chosen ?? station.cannot("station.path.read"));
    allow(buttons.remove, chosen ?? station.cannot("station.path.delete"));
    allow(buttons.save, empty ?? named ?? station.cannot("station.path.write"));
    allow(buttons.exporting, empty);
    allow(buttons.record, station.cannot("station.record.start"));
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
    const answer = await this.station.attempt(this.station.call("station.path.read", { name }), `Path ${name}`);
    if (!answer) return;
    this.name.value = name;
    this.#take(answer.path, `${name} is in the editor.`);
  }

  #take(path, told) {
    const lost = this.editor.load(path);
    if (lost) this.station.say(`Path: ${lost}`, "warning", "look at it on the map before it is driven");
    text(this.told, told);
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
    const params = { name, path: this.editor.spec(), replace };
    if (!(await this.station.attempt(this.station.call("station.path.write", params), `Path ${name}`))) return;
    text(this.told, `${name} is saved.`);
    this.#list(name);
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
    if (!file) return;
    try {
      this.#take(JSON.parse(await file.text()), `${file.name} is in the editor.`);
      this.name.value = file.name.replace(/\.\w+$/, "").replace(/[^A-Za-z0-9_-]/g, "-");
    } catch {
      const remedy = "give a path as JSON, such as Export writes it; YAML files go into the robot's folder of paths";
      this.station.say(`${file.name} is no path`, "error", remedy);
    }
  }

  /** JSON is YAML, too: `canhelm drive path` reads it. */
  #export() {
    settleWriting();
    if (this.#unwritable()) return;
    const content = `${JSON.stringify(this.editor.spec(), null, 1)}\n`;
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
    const { path, length_m, pieces } = answer;
    return this.#take(path, `The recorded way is in the editor: ${length_m.toFixed(2)} m, ${pieces} pieces.`);
  }
}

function titled(name, length_m) {
  return length_m == null ? name : `${name} (${length_m.toFixed(1)} m)`;
}
