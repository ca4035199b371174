/** The panel of drives, encoders, brakes, bricks, guarding, bus and control cycle. */

import { badge, setBadge } from "./badge.js";
import { BusTables } from "./bus.js";
import { DriveCard, brakeCard, brickCard, encoderCard, nodeState } from "./device_card.js";
import { h, redraw, seldom, text } from "./dom.js";
import { Rows, table } from "./rows.js";

function section(title, ...parts) {
  return h("section", { "aria-label": title }, h("h3", {}, title), parts);
}

/** A part of the panel that is hidden where this robot has nothing for it. */
class Part {
  #rows;
  #parent = h("div", { class: "cards" });

  constructor(title, make, choose) {
    this.choose = choose;
    this.element = section(title, this.#parent);
    this.#rows = new Rows(this.#parent, make);
  }

  show(status) {
    const items = this.choose(status) ?? [];
    this.element.hidden = !items.length;
    this.#rows.show(items);
  }

  /** Make everything anew for the next robot. */
  clear() {
    this.#rows.show([]);
  }
}

/** Every node with its guarding. */
class Nodes {
  #rows;

  constructor() {
    const { table: element, body } = table("Nodes and their guarding", ["Node", "Name", "Device", "Guarding"]);
    this.element = section("Nodes", h("div", { class: "scroll" }, element));
    this.#rows = new Rows(body, makeNode);
  }

  show({ nodes }) {
    const shown = (nodes ?? []).filter((node) => node.node != null);
    this.element.hidden = !shown.length;
    this.#rows.show(shown);
  }
}

function makeNode(node) {
  const state = badge();
  const cells = [h("td", {}, node.name), h("td", {}, node.device), h("td", {}, state)];
  const element = h("tr", {}, h("th", { scope: "row" }, node.node), cells);
  const guarding = ({ node_state }) => (node_state === "ready" ? ["good", "guarded"] : nodeState(node_state));
  const show = (now) => setBadge(state, ...guarding(now));
  return { element, show };
}

/** What a first look at a bus without a profile has found. */
class Found {
  #list = h("ul");
  element = section("Found on the bus", this.#list);
  #rows = new Rows(this.#list, makeFound, (row) => row.node);

  show({ found }) {
    this.element.hidden = !found?.length;
    this.#rows.show(found ?? []);
  }
}

function makeFound() {
  const element = h("li");
  const show = ({ node, device, firmware, state, remark }) => {
    text(element, `node ${node}: ${[device, firmware, state, remark].filter(Boolean).join("; ")}`);
  };
  return { element, show };
}

/** The panel. */
export function create(station) {
  const bus = new BusTables();
  const parts = [
    new Part("Drives", (node) => new DriveCard(station, node), (status) => status.nodes?.filter(isDrive)),
    new Part("Encoders", encoderCard, (status) => status.nodes?.filter((node) => node.heading_deg !== undefined)),
    new Part("Bricks", brickCard, (status) => status.bricks),
    new Part("Brakes", brakeCard, (status) => status.brakes),
  ];
  const sections = [...parts, new Nodes(), new Found()];
  const network = section("Bus and control cycle", bus.element);
  const none = h("p", {}, "No word from a robot yet.");
  const element = h("section", { class: "devices" }, h("h2", {}, "Devices"), none, sections.map((part) => part.element),
    network);
  const draw = redraw(element, () => {
    none.hidden = Boolean(station.status);
    network.hidden = !station.status;
    for (const each of sections) each.show(station.status ?? {});
    bus.show(station.status ?? {});
  });
  station.on("robot", () => parts.forEach((part) => part.clear()));
  station.on("status", seldom(draw));
  for (const kind of ["stale", "robot", "connected"]) station.on(kind, draw);
  return element;
}

function isDrive(node) {
  return node.velocity_rpm !== undefined;
}
