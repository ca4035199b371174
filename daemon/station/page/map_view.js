/** What part of the floor the map shows: metres to pixels and back, the grid, the scale bar. */

import { font } from "./canvas.js";

const LEAST_PX_M = 2;
const MOST_PX_M = 2000;
const GRID_PX = 60;
const SHARE_OF_FIT = 0.85;
const LEAST_SPAN_M = 4;

/** The least of 1, 2, 5, 10, ... (and their tenths) that is at least a value. */
export function niceStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= least * 0.9999);
}

/** A length for people. */
export function metres(value_m) {
  return value_m < 1 ? `${Math.round(value_m * 100)} cm` : `${value_m.toFixed(0)} m`;
}

/** x to the right, y up; the place in the middle of the map, and pixels a metre. */
export class MapView {
  constructor() {
    [this.x_m, this.y_m, this.px_m] = [0, 0, 100];
    [this.width, this.height] = [1, 1];
  }

  toScreen(x_m, y_m) {
    return [this.width / 2 + (x_m - this.x_m) * this.px_m, this.height / 2 - (y_m - this.y_m) * this.px_m];
  }

  toWorld(x, y) {
    return [this.x_m + (x - this.width / 2) / this.px_m, this.y_m - (y - this.height / 2) / this.px_m];
  }

  pan(dx, dy) {
    this.x_m -= dx / this.px_m;
    this.y_m += dy / this.px_m;
  }

  centre(x_m, y_m) {
    [this.x_m, this.y_m] = [x_m, y_m];
  }

  /** Show `factor` times as large what lies at a pixel, which stays where it is. */
  zoom(factor, x = this.width / 2, y = this.height / 2) {
    const [fx, fy] = this.toWorld(x, y);
    this.px_m = Math.min(MOST_PX_M, Math.max(LEAST_PX_M, this.px_m * factor));
    const [nx, ny] = this.toWorld(x, y);
    this.centre(this.x_m + fx - nx, this.y_m + fy - ny);
  }

  /** Show [least x, least y, largest x, largest y]. */
  fit([x0, y0, x1, y1]) {
    const [wide, high] = [Math.max(x1 - x0, LEAST_SPAN_M), Math.max(y1 - y0, LEAST_SPAN_M)];
    const px_m = SHARE_OF_FIT * Math.min(this.width / wide, this.height / high);
    this.px_m = Math.min(MOST_PX_M, Math.max(LEAST_PX_M, px_m));
    this.centre((x0 + x1) / 2, (y0 + y1) / 2);
  }

  /** Move the pen of a context along points [x, y] in metres. */
  trace(context, points) {
    context.beginPath();
    for (const [x, y] of points) context.lineTo(...this.toScreen(x, y));
  }

  /** Lines each so many metres; the axes through the origin are stronger. */
  drawGrid(context, colours) {
    const step = niceStep(GRID_PX / this.px_m);
    const [[x0, y1], [x1, y0]] = [this.toWorld(0, 0), this.toWorld(this.width, this.height)];
    context.strokeStyle = colours.line;
    for (let count = Math.ceil(x0 / step); count * step <= x1; count += 1) {
      this.#rule(context, count, [count * step, y0], [count * step, y1]);
    }
    for (let count = Math.ceil(y0 / step); count * step <= y1; count += 1) {
      this.#rule(context, count, [x0, count * step], [x1, count * step]);
    }
  }

  #rule(context, count, from, to) {
    context.lineWidth = count ? 0.5 : 1.5;
    this.trace(context, [from, to]);
    context.stroke();
  }

  /** How long a metre is here, at the lower left. */
  drawScaleBar(context, colours) {
    const length_m = niceStep(GRID_PX / this.px_m);
    const [x, y, width] = [12, this.height - 12, length_m * this.px_m];
    [context.strokeStyle, context.fillStyle, context.lineWidth] = [colours.ink, colours.ink, 2];
    context.beginPath();
    for (const [px, py] of [[x, y - 5], [x, y], [x + width, y], [x + width, y - 5]]) context.lineTo(px, py);
    context.stroke();
    [context.font, context.textAlign, context.textBaseline] = [font(12), "left", "bottom"];
    context.fillText(metres(length_m), x + 4, y - 3);
  }
}
