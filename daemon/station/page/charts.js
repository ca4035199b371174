/** The charts beside a path: errors with the limits at which the drive ends, and the speed of one drive. */

import { Chart } from "./chart.js";
import { h } from "./dom.js";

const ERRORS = [
  { key: "error_m", scale: 100, title: "Position error", unit: "cm", digits: 1, least: 2 },
  { key: "heading_error_deg", scale: 1, title: "Heading error", unit: "°", digits: 1, least: 2 },
  { key: "bending_error_deg", scale: 1, title: "Bending error", unit: "°", digits: 1, least: 2 },
];
const SPEED = { title: "Speed", unit: "m/s", digits: 3, names: ["actual", "target"], least: 0.1 };

/** The errors of following a path over the last minute, left positive; they stay to be seen when it is over. */
export class ErrorCharts {
  constructor(station) {
    this.charts = ERRORS.map((error) => ({ ...error, chart: new Chart(station, { ...error, names: [""] }) }));
    this.empty = h("p", { class: "muted" }, "Charts appear while a path is driven.");
    this.element = h("div", { class: "charts" }, this.empty, ...this.charts.map(({ chart }) => chart.element));
    station.on("status", ({ time_s, vehicle }) => this.#took(time_s, vehicle?.following ?? null));
    station.on("robot", () => this.#forget());
    this.#forget();
  }

  #took(time_s, following) {
    if (!following) return;
    this.empty.hidden = true;
    for (const { key, scale, chart } of this.charts) {
      const [value, limit] = [following[key], following.limits?.[key]];
      if (value != null) chart.element.hidden = false;
      chart.add(time_s, [value == null ? null : value * scale], limit == null ? null : limit * scale);
    }
  }

  /** A chart is shown once it has a value: a vehicle without a trailer has no bending angle. */
  #forget() {
    this.empty.hidden = false;
    for (const { chart } of this.charts) {
      chart.clear();
      chart.element.hidden = true;
    }
  }
}

/** Speed of a drive that is chosen, as it is and as it shall be. */
export class SpeedChart {
  #names = "";

  constructor(station) {
    this.chart = new Chart(station, SPEED);
    this.select = h("select", { onchange: () => this.chart.clear() });
    this.element = h("div", {}, h("label", { class: "field" }, "Drive", this.select), this.chart.element);
    station.on("status", (status) => this.#took(status));
    station.on("robot", () => this.chart.clear());
  }

  #took({ time_s, nodes = [] }) {
    const drives = nodes.filter((node) => node.speed_m_s != null);
    this.element.hidden = !drives.length;
    this.#offer(drives.map(({ name }) => name));
    const drive = drives.find(({ name }) => name === this.select.value);
    if (drive) this.chart.add(time_s, [drive.speed_m_s, drive.target_speed_m_s]);
  }

  #offer(names) {
    const told = names.join("\n");
    if (told === this.#names) return;
    this.#names = told;
    this.select.replaceChildren(...names.map((name) => h("option", { value: name }, name)));
  }
}
