/** Pointers and the wheel on the map: pan, zoom, pinch; what is no gesture of the map goes to the path's handles. */

const CLICK_PX = 5;
const WHEEL_STEP = 1.0015;

/**
 * Listen on a canvas.
 *
 * @param canvas of the map.
 * @param view its MapView.
 * @param handlers grab(x, y, event) -> true to have the drag to itself; drag(x, y, event); drop(); click(x, y, event);
 *     hover(x, y, event) and leave(); moved(zoomed) after the view has changed.
 */
export function listen(canvas, view, handlers) {
  const gestures = new Gestures(view, handlers);
  for (const kind of ["pointerdown", "pointermove", "pointerup", "pointercancel", "pointerleave", "wheel"]) {
    canvas.addEventListener(kind, (event) => gestures[kind](event, canvas), { passive: false });
  }
}

class Gestures {
  #pointers = new Map();
  #grabbed = false;
  #way = 0;

  constructor(view, handlers) {
    [this.view, this.handlers] = [view, handlers];
  }

  pointerdown(event, canvas) {
    if (event.button) return;
    canvas.setPointerCapture(event.pointerId);
    this.#pointers.set(event.pointerId, [event.offsetX, event.offsetY]);
    if (this.#pointers.size > 1) {
      this.#letGo();
      this.#way = Infinity;
      return;
    }
    this.#way = 0;
    this.#grabbed = this.handlers.grab(event.offsetX, event.offsetY, event);
  }

  pointermove(event) {
    const [x, y] = [event.offsetX, event.offsetY];
    const before = this.#pointers.get(event.pointerId);
    this.handlers.hover(x, y, event);
    if (!before) return;
    this.#way += Math.hypot(x - before[0], y - before[1]);
    if (this.#pointers.size === 2) this.#pinch(event.pointerId, before, [x, y]);
    else if (this.#way > CLICK_PX) this.#drag(event, before, [x, y]);
    if (this.#way > CLICK_PX) this.#pointers.set(event.pointerId, [x, y]);
  }

  #drag(event, before, [x, y]) {
    if (this.#grabbed) return this.handlers.drag(x, y, event);
    this.view.pan(x - before[0], y - before[1]);
    this.handlers.moved(false);
  }

  #pinch(id, before, now) {
    const [, [ox, oy]] = [...this.#pointers].find(([other]) => other !== id);
    const [was, is] = [Math.hypot(before[0] - ox, before[1] - oy), Math.hypot(now[0] - ox, now[1] - oy)];
    this.view.pan((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
    if (was > 1 && is > 1) this.view.zoom(is / was, (now[0] + ox) / 2, (now[1] + oy) / 2);
    this.handlers.moved(true);
  }

  pointerup(event) {
    const clicked = this.#pointers.has(event.pointerId) && this.#way <= CLICK_PX;
    this.#end(event);
    if (clicked) this.handlers.click(event.offsetX, event.offsetY, event);
  }

  pointercancel(event) {
    this.#end(event);
  }

  pointerleave() {
    this.handlers.leave();
  }

  #end(event) {
    this.#pointers.delete(event.pointerId);
    this.#letGo();
  }

  #letGo() {
    if (this.#grabbed) this.handlers.drop();
    this.#grabbed = false;
  }

  wheel(event) {
    event.preventDefault();
    this.view.zoom(WHEEL_STEP ** -event.deltaY, event.offsetX, event.offsetY);
    this.handlers.moved(true);
  }
}
