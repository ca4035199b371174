/** The panel of runs: what motions and faults have left, with pictures and downloads. */

import { allow, attribute, h, number, redraw, text } from "./dom.js";
import { Rows, table } from "./rows.js";

const HEADS = ["Run", "When", "What", "How it ended", "Duration", "Files"];
const CLOCK = { dateStyle: "medium", timeStyle: "medium", hourCycle: "h23" };
const WORDLESS = "ended without a word: its daemon was killed, or could not write";
const WANTED = "run-wanted";

/** Open the newest run as soon as the panel is shown and has read which one that is. */
export function openNewestRun() {
  document.dispatchEvent(new Event(WANTED));
}

/** The panel. */
export function create(station) {
  return new RunsPanel(station).element;
}

/** A cell that tells its own head where a phone shows the rows as cards; the roles stay when it is no table there. */
function cell(head) {
  return h("td", { role: "cell", "data-head": head, class: head === "Duration" ? "number" : null });
}

class RunsPanel {
  #rows;
  #chosen = null;
  #asked = 0;
  #wanted = false;
  #count = null;

  constructor(station) {
    this.station = station;
    this.#make();
    station.on("connected", () => station.connected && this.#seen() && this.reload());
    station.on("robot", () => this.#forget());
    const show = redraw(this.element, () => this.#show());
    for (const kind of ["connected", "status", "stale"]) station.on(kind, show);
    document.addEventListener(WANTED, () => {
      this.#wanted = true;
    });
    addEventListener("hashchange", () => location.hash === "#runs" && this.reload());
  }

  #make() {
    this.button = h("button", { type: "button", onclick: () => this.reload() }, "Reload");
    const { table: element, body } = table("Runs, the newest first", HEADS);
    this.#rows = new Rows(body, (run) => this.#row(run), ({ run }) => run);
    attribute(element, "role", "table");
    attribute(body, "role", "rowgroup");
    this.told = h("p", { class: "reason", role: "status" });
    this.trouble = h("p", { class: "reason", role: "status" });
    this.title = h("h3");
    this.picture = h("img", { class: "run-picture", hidden: true, alt: "" });
    this.picture.addEventListener("load", () => this.#drawn());
    this.picture.addEventListener("error", () => this.#notDrawn());
    this.drawing = h("p", { class: "reason", role: "status" });
    const title = h("h2", { id: "runs-title" }, "Runs");
    this.why = h("span", { class: "reason" });
    const row = h("div", { class: "row" }, this.button, this.why);
    this.opened = h("section", { "aria-label": "Opened run", hidden: true }, this.title, this.drawing, this.picture);
    this.list = h("div", { class: "scroll", hidden: true }, element);
    const parts = [title, row, this.trouble, this.told, this.opened, this.list];
    this.element = h("section", { class: "runs", "aria-labelledby": "runs-title" }, ...parts);
  }

  #seen() {
    return !this.element.closest("[hidden]");
  }

  #show() {
    const reason = this.station.cannot("station.runs");
    allow(this.button, reason);
    text(this.why, reason ? `Not now: ${reason}` : "");
    const { message = "", remedy = "" } = this.station.status?.runs ?? {};
    text(this.trouble, [message, remedy].filter(Boolean).join(" – "));
    text(this.told, counted(this.#count, message));
  }

  #forget() {
    this.#asked += 1;
    this.#count = null;
    this.#showList([]);
    this.#close();
  }

  /** An empty table is left out. */
  #showList(runs) {
    this.#rows.show(runs);
    this.list.hidden = !runs.length;
    this.#show();
  }

  /** Read the list of runs anew; open the newest, if that is wanted. */
  async reload() {
    const asked = ++this.#asked;
    const answer = await this.station.attempt(this.station.call("station.runs", {}, { timeout_ms: 15_000 }), "Runs");
    if (!answer || asked !== this.#asked) return;
    const runs = answer.runs.toReversed();
    this.#count = runs.length;
    this.#showList(runs);
    if (this.#wanted && runs.length) this.#open(runs[0]);
    this.#wanted = false;
  }

  // --- one run --------------------------------------------------------------------------------------------------

  #row(run) {
    const act = { type: "button", "aria-label": `Open run ${run.run}`, onclick: () => this.#open(run) };
    const open = h("button", act, run.run);
    const [when, method, ended, duration, files] = HEADS.slice(1).map(cell);
    const cells = { when, method, ended, duration, files };
    const element = h("tr", { role: "row" }, h("th", { scope: "row", role: "rowheader" }, open), Object.values(cells));
    return { element, show: (now) => this.#fill(element, cells, now) };
  }

  #fill(element, cells, told) {
    const { run, method, ended, message, duration_s, files } = told;
    attribute(element, "data-chosen", run === this.#chosen);
    text(cells.when, when(told));
    text(cells.method, method);
    text(cells.ended, [ended ?? (told.under_way ? "under way" : WORDLESS), message].filter(Boolean).join(": "));
    text(cells.duration, duration_s == null ? "–" : `${number(duration_s, 1)} s`);
    if (cells.files.childElementCount !== files.length) cells.files.replaceChildren(this.#links(run, files));
  }

  /** Downloads behind a name that can be opened: a run has half a dozen files. */
  #links(run, files) {
    const link = (file) => h("a", { href: this.#address(run, file), download: `${run}-${file}` }, file);
    const links = files.map((file) => h("li", {}, link(file)));
    return h("details", {}, h("summary", {}, `${files.length} files`), h("ul", { class: "run-files" }, ...links));
  }

  #address(run, file) {
    return `runs/${[this.station.robot, run, file].map(encodeURIComponent).join("/")}`;
  }

  #open({ run, method }) {
    this.#chosen = run;
    this.opened.hidden = false;
    text(this.title, `Run ${run}: ${method}`);
    text(this.drawing, "Drawing its picture …");
    this.picture.hidden = true;
    attribute(this.picture, "alt", `Picture of run ${run}: way, speeds, errors and currents over time`);
    attribute(this.picture, "src", this.#address(run, "plot"));
  }

  #drawn() {
    this.picture.hidden = false;
    text(this.drawing, "");
  }

  /** Ask for the reason, which an image does not tell. */
  async #notDrawn() {
    if (!this.#chosen) return;
    const answer = await fetch(this.picture.src).then((response) => response.json()).catch(() => null);
    const remedy = answer?.remedy ? ` – ${answer.remedy}` : "";
    text(this.drawing, `No picture: ${answer?.message ?? "the station does not answer"}${remedy}`);
  }

  #close() {
    this.#chosen = null;
    this.opened.hidden = true;
    attribute(this.picture, "src", null);
  }
}

/** What a run's time is: a motion's begin, or the moment of a fault, which is the end of what is in its run. */
function when({ begun, struck }) {
  const time = struck ?? begun;
  if (!time) return "–";
  return `${struck ? "fault struck" : "begun"} ${new Date(time).toLocaleString(undefined, CLOCK)}`;
}

/** How many runs there are; of none nothing is said before they have been read, and where they cannot be written. */
function counted(count, trouble) {
  if (!count) return count === null || trouble ? "" : "No runs yet: every motion leaves one.";
  return `${count} ${count === 1 ? "run" : "runs"}`;
}
