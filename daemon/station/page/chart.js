/** One chart of numbers over the last minute, on a canvas, with its newest values as text. */

import { font, palette, sharp } from "./canvas.js";
import { attribute, h, number, redraw, text } from "./dom.js";
import { niceStep } from "./map_view.js";

const SPAN_S = 60;
const CAPACITY = 2048;
const GAP_S = 0.5;
const TICK_S = 10;
const LEGEND_PX = 14;
const MARGIN = { left: 46, right: 8, top: 8, bottom: 20 };
const ROWS = 4;
const SPARE = 1.1;
/** Share of a limit from which on the axis reaches to it. */
const NEAR_LIMIT = 0.25;
const DASHES = [[], [6, 4], [2, 3], [8, 3, 2, 3]];

/** Times and values of the last minute, in memory that does not grow. */
class Ring {
  #columns;
  #next = 0;
  #count = 0;

  constructor(series) {
    this.#columns = Array.from({ length: series + 1 }, () => new Float64Array(CAPACITY));
  }

  clear() {
    [this.#next, this.#count] = [0, 0];
  }

  add(row) {
    row.forEach((value, column) => {
      this.#columns[column][this.#next] = value ?? NaN;
    });
    this.#next = (this.#next + 1) % CAPACITY;
    this.#count = Math.min(this.#count + 1, CAPACITY);
  }

  /** Call with time and value of a series, oldest first, from a time on. */
  each(series, from_s, visit) {
    for (let number = 0; number < this.#count; number += 1) {
      const place = (this.#next - this.#count + number + CAPACITY) % CAPACITY;
      const time_s = this.#columns[0][place];
      if (time_s >= from_s) visit(time_s, this.#columns[series + 1][place]);
    }
  }
}

export class Chart {
  #ring;
  #now_s = null;
  #limit = null;
  #surface;

  /**
   * @param station for whether values are stale.
   * @param options title, unit, digits, names (of the series), least (half the height of an empty chart).
   */
  constructor(station, { title, unit, digits, names, least }) {
    Object.assign(this, { station, title, unit, digits, names, least });
    this.#ring = new Ring(names.length);
    this.canvas = h("canvas", { class: "chart-canvas", role: "img", "aria-label": `${title}: no values yet` });
    this.newest = h("output", { "aria-label": `${title}, newest` });
    const caption = h("figcaption", {}, h("span", {}, `${title} [${unit}] `), this.newest);
    this.element = h("figure", { class: "chart" }, caption, this.canvas);
    this.changed = redraw(this.element, () => this.#draw());
    this.#surface = sharp(this.canvas, this.changed);
    station.on("stale", this.changed);
  }

  /** Take the values of a moment; null where there is none. A clock that goes back begins anew. */
  add(time_s, values, limit = null) {
    if (this.#now_s !== null && time_s < this.#now_s) this.clear();
    if (time_s === this.#now_s) return;
    [this.#now_s, this.#limit] = [time_s, limit];
    this.#ring.add([time_s, ...values]);
    this.#tell(values);
    this.changed();
  }

  clear() {
    this.#ring.clear();
    [this.#now_s, this.#limit] = [null, null];
    text(this.newest, "");
    attribute(this.canvas, "aria-label", `${this.title}: no values yet`);
    this.changed();
  }

  #tell(values) {
    const withUnit = (value) => `${number(value, this.digits)} ${this.unit}`;
    const told = this.names.map((name, index) => `${name} ${withUnit(values[index])}`.trim());
    if (this.#limit !== null) told.push(`limit ${withUnit(this.#limit)}${this.#limitIsFar() ? ", outside the chart" : ""}`);
    text(this.newest, told.join(", "));
    attribute(this.canvas, "aria-label", `${this.title} over the last ${SPAN_S} s; its newest values stand above`);
  }

  // --- drawing --------------------------------------------------------------------------------------------------

  #draw() {
    const { context, width, height } = this.#surface();
    if (width < MARGIN.left + MARGIN.right + 20) return;
    const colours = palette();
    context.font = font(11);
    const frame = this.#frame(width, height);
    this.#drawAxes(context, colours, frame);
    if (this.#limit !== null && !this.#limitIsFar()) this.#drawLimits(context, colours, frame);
    const now_s = this.#now_s;
    if (now_s === null) return;
    this.names.forEach((_, series) => this.#drawSeries(context, colours, frame, series, now_s - SPAN_S));
    if (this.names.length > 1) this.#drawLegend(context, colours, frame);
  }

  /** Where times and values are on the canvas; the values' axis has zero in its middle. */
  #frame(width, height) {
    const from_s = (this.#now_s ?? 0) - SPAN_S;
    const most = this.#largest(from_s) * SPARE;
    const [left, right, top, bottom] = [MARGIN.left, width - MARGIN.right, MARGIN.top, height - MARGIN.bottom];
    const x = (time_s) => left + (right - left) * (time_s - from_s) / SPAN_S;
    const y = (value) => (top + bottom) / 2 - (bottom - top) / 2 * value / most;
    return { left, right, top, bottom, most, from_s, x, y };
  }

  /** Whether no value in sight has come near the limit, so that the axis does not reach to it. */
  #limitIsFar() {
    return this.#largest(this.#now_s - SPAN_S) < this.#limit;
  }

  /** The largest value in sight; a limit counts once a value has come near it. */
  #largest(from_s) {
    let most = this.least;
    const see = (_, value) => {
      most = Math.max(most, Math.abs(value) || 0);
    };
    this.names.forEach((_, series) => this.#ring.each(series, from_s, see));
    return most > NEAR_LIMIT * this.#limit ? Math.max(most, this.#limit ?? 0) : most;
  }

  #drawAxes(context, colours, { left, right, top, bottom, most, from_s, x, y }) {
    const step = niceStep(2 * most / ROWS);
    [context.strokeStyle, context.fillStyle, context.lineWidth] = [colours.line, colours.muted, 1];
    [context.textAlign, context.textBaseline] = ["right", "middle"];
    for (let count = -Math.floor(most / step); count * step <= most; count += 1) {
      rule(context, [left, y(count * step)], [right, y(count * step)]);
      context.fillText(tick(count * step, step), left - 5, y(count * step));
    }
    [context.textAlign, context.textBaseline] = ["center", "top"];
    for (let ago_s = 0; ago_s <= SPAN_S; ago_s += TICK_S) {
      const at = x(from_s + SPAN_S - ago_s);
      rule(context, [at, top], [at, bottom]);
      const name = ago_s ? `−${ago_s} s` : "now";
      if (ago_s % (2 * TICK_S) === 0) context.fillText(name, Math.min(at, right - 12), bottom + 4);
    }
  }

  /** Both limits as dashed lines. */
  #drawLimits(context, colours, { left, right, y }) {
    const name = `limit ${number(this.#limit, this.digits)} ${this.unit}`;
    [context.strokeStyle, context.fillStyle, context.lineWidth] = [colours.bad, colours.bad, 1.5];
    context.textAlign = "left";
    context.setLineDash([7, 4]);
    const [high, low] = [y(this.#limit), y(-this.#limit)];
    for (const at of [high, low]) rule(context, [left, at], [right, at]);
    context.setLineDash([]);
    context.textBaseline = "top";
    context.fillText(name, left + 4, high + 3);
    context.textBaseline = "bottom";
    context.fillText(name, left + 4, low - 2);
  }

  #drawLegend(context, colours, { left, top }) {
    [context.textAlign, context.textBaseline] = ["left", "middle"];
    this.names.forEach((name, series) => {
      const [x, y] = [left + 6, top + 8 + series * LEGEND_PX];
      this.#style(context, colours, series);
      rule(context, [x, y], [x + 26, y]);
      context.fillStyle = colours.ink;
      context.fillText(name, x + 32, y);
    });
    context.setLineDash([]);
  }

  /** Colour and dashes tell a series, not the colour alone. */
  #style(context, colours, series) {
    context.strokeStyle = this.station.stale ? colours.muted : colours.series[series];
    context.lineWidth = 2;
    context.setLineDash(DASHES[series]);
  }

  #drawSeries(context, colours, { x, y }, series, from_s) {
    this.#style(context, colours, series);
    context.beginPath();
    let before_s = -Infinity;
    this.#ring.each(series, from_s, (time_s, value) => {
      if (Number.isNaN(value)) return;
      context[time_s - before_s > GAP_S ? "moveTo" : "lineTo"](x(time_s), y(value));
      before_s = time_s;
    });
    context.stroke();
    context.setLineDash([]);
  }
}

function rule(context, from, to) {
  context.beginPath();
  context.moveTo(...from);
  context.lineTo(...to);
  context.stroke();
}

/** A number at an axis, with so many digits as its steps need. */
function tick(value, step) {
  return number(value, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
}
