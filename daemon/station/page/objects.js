/** The object browser: the objects of a node, read, and written by whoever may. */

import { allow, attribute, h, text } from "./dom.js";
import { ObjectDetails } from "./object_details.js";
import { Rows, table } from "./rows.js";

const ACCESS = { ro: "read only", wo: "write only", rw: "read, write", const: "constant" };

class ObjectsPanel {
  #station;
  #objects = [];
  #device = null;
  #details;
  #rows;
  #table;
  #node = h("select", { onchange: () => this.#chooseNode() });
  #search = h("input", { type: "search", placeholder: "name, 0x6041, current …", oninput: () => this.#list() });
  #told = h("p", { class: "aside", role: "status" });
  #nodes = new Rows(this.#node, makeOption, (node) => node.name);
  #wasVisible = false;

  constructor(station) {
    this.#station = station;
    this.#details = new ObjectDetails(station);
    const { table: element, body } = table("Objects of this node", ["Object", "Name", "Access", "Unit"]);
    this.#rows = new Rows(body, (entry) => this.#row(entry), (entry) => entry.object);
    const search = h("label", {}, "Search ", this.#search);
    const tools = h("div", { class: "row" }, h("label", {}, "Node ", this.#node), search);
    this.#table = h("div", { class: "scroll objects-list" }, element);
    this.element = h("section", { class: "objects" }, h("h2", {}, "Objects"), tools, this.#told, this.#table,
      this.#details.element);
    station.on("status", () => this.#look());
    station.on("robot", () => this.#forget());
    station.on("connected", () => this.#onConnection());
  }

  #look() {
    if (this.element.hidden) {
      this.#wasVisible = false;
      return;
    }
    const nodes = (this.#station.status.nodes ?? []).filter((node) => node.node != null);
    this.#nodes.show(nodes);
    allow(this.#node, nodes.length ? null : "this robot has no CANopen nodes");
    if (!this.#wasVisible || this.#deviceOf() !== this.#device) this.#chooseNode();
    this.#wasVisible = true;
    this.#details.look();
  }

  /** What was asked for in vain is asked for again. */
  #onConnection() {
    if (!this.#objects.length) this.#device = null;
    this.#details.look();
  }

  #forget() {
    this.#device = null;
    this.#objects = [];
    this.#nodes.show([]);
    this.#list();
    this.#details.choose(null, null);
  }

  #deviceOf() {
    return this.#station.status?.nodes?.find((node) => node.name === this.#node.value)?.device ?? null;
  }

  async #chooseNode() {
    const device = this.#deviceOf();
    if (device !== this.#device) {
      this.#device = device;
      this.#objects = device ? await this.#objectsOf(device) : [];
    }
    if (!this.#objects.includes(this.#details.entry)) this.#details.choose(this.#node.value, null);
    else this.#details.choose(this.#node.value, this.#details.entry);
    this.#list();
  }

  async #objectsOf(device) {
    const asked = this.#station.call("station.objects", { device });
    const found = await this.#station.attempt(asked, `objects of ${device}`);
    return found?.objects ?? [];
  }

  #list() {
    const wanted = this.#search.value.trim().toLowerCase();
    const found = this.#objects.filter((entry) => textOf(entry).includes(wanted));
    this.#table.hidden = !found.length;
    this.#rows.show(found);
    text(this.#told, this.#objects.length ? `${found.length} of ${this.#objects.length} objects` : this.#whyNone());
  }

  #whyNone() {
    return this.#station.status && !this.#station.status.nodes?.some((node) => node.node != null)
      ? "This robot has no CANopen nodes, and so no objects."
      : "No objects are known.";
  }

  #row(entry) {
    const choose = () => {
      this.#details.choose(this.#node.value, entry);
      this.#list();
    };
    const button = h("button", { type: "button", class: "link", onclick: choose }, entry.object);
    const cells = [entry.name.replaceAll("_", " "), ACCESS[entry.access], entry.unit].map((cell) => h("td", {}, cell));
    const show = () => attribute(button, "aria-current", entry === this.#details.entry ? "true" : null);
    return { element: h("tr", {}, h("th", { scope: "row" }, button), cells), show };
  }
}

function makeOption({ node, name, device }) {
  return { element: h("option", { value: name }, `${node} ${name} (${device})`), show: () => {} };
}

function textOf({ object, name, meaning }) {
  return `${object} ${name} ${name.replaceAll("_", " ")} ${meaning}`.toLowerCase();
}

/** The panel. */
export function create(station) {
  return new ObjectsPanel(station).element;
}
