/** Where the vehicle was: the newest points of its way. */

const MOST_POINTS = 2000;
const APART_M = 0.02;
const JUMP_M = 0.5;

export class Trail {
  #xs = new Float32Array(MOST_POINTS);
  #ys = new Float32Array(MOST_POINTS);
  #begin = 0;
  #count = 0;

  clear() {
    [this.#begin, this.#count] = [0, 0];
  }

  /** Keep a point, if it lies apart from the last one; whether it does. */
  add(x_m, y_m) {
    if (this.#count) {
      const last = (this.#begin + this.#count - 1) % MOST_POINTS;
      if (Math.hypot(x_m - this.#xs[last], y_m - this.#ys[last]) < APART_M) return false;
    }
    const place = (this.#begin + this.#count) % MOST_POINTS;
    [this.#xs[place], this.#ys[place]] = [x_m, y_m];
    if (this.#count < MOST_POINTS) this.#count += 1;
    else this.#begin = (this.#begin + 1) % MOST_POINTS;
    return true;
  }

  /** Draw it; where the vehicle was put somewhere else, the line is broken. */
  draw(context, view) {
    context.beginPath();
    let [before_x, before_y] = [Infinity, Infinity];
    for (let number = 0; number < this.#count; number += 1) {
      const place = (this.#begin + number) % MOST_POINTS;
      const [x, y] = [this.#xs[place], this.#ys[place]];
      const jumps = Math.hypot(x - before_x, y - before_y) > JUMP_M;
      context[jumps ? "moveTo" : "lineTo"](...view.toScreen(x, y));
      [before_x, before_y] = [x, y];
    }
    context.stroke();
  }
}
