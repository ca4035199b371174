/** Editing a path on the map: its handles are dragged, pieces are added and chosen by clicks. */

import { knobAt, KNOB_PX } from "./path_drawing.js";
import { nearest, point } from "./path_geometry.js";

const REACH_PX = { mouse: 10, pen: 14, touch: 24 };

/** What the pointer does on the map is said by `tool`: "move", "line" or "arc". */
export class PathHandles {
  #editor;
  #view;
  #grabbed = null;

  constructor(editor, view) {
    [this.#editor, this.#view, this.tool, this.hovered] = [editor, view, "move", null];
  }

  /** Take hold of the handle under the pointer; whether there is one. */
  grab(x, y, event) {
    const handle = this.#under(x, y, event.pointerType);
    this.#grabbed = handle && { ...handle, group: Symbol("drag") };
    if (handle?.kind === "end") this.#editor.set("chosen", handle.index);
    return Boolean(handle);
  }

  drag(x, y, { altKey }) {
    const { kind, index, group } = this.#grabbed;
    const place = this.#view.toWorld(x, y);
    if (kind === "end") return this.#editor.dragEnd(index, ...place, altKey, group);
    if (kind === "knob") return this.#editor.turnStart(...place, altKey, group);
    const { heading_deg } = this.#editor.start ?? this.#editor.here();
    return this.#editor.begin({ x_m: place[0], y_m: place[1], heading_deg }, altKey, group);
  }

  drop() {
    this.#grabbed = null;
  }

  /** Add a piece by the tool, or choose the piece under the pointer; false where the tool finds no way there. */
  click(x, y, event) {
    const candidate = this.#candidate(x, y, event);
    this.hovered = null;
    if (candidate) this.#editor.append(candidate);
    else if (this.tool === "move") this.#choose(x, y, event.pointerType);
    return Boolean(candidate) || this.tool === "move";
  }

  #choose(x, y, pointerType) {
    const found = nearest(this.#editor.built().pieces, ...this.#view.toWorld(x, y));
    const reach_m = (REACH_PX[pointerType] ?? REACH_PX.mouse) / this.#view.px_m;
    this.#editor.set("chosen", found && found.distance_m < reach_m ? found.index : null);
  }

  /** Remember what a click here would add. */
  hover(x, y, event) {
    this.hovered = this.#grabbed || event.buttons ? null : this.#candidate(x, y, event);
  }

  #candidate(x, y, { altKey }) {
    if (this.tool === "move") return null;
    return this.#editor.candidate(this.tool, ...this.#view.toWorld(x, y), altKey);
  }

  #under(x, y, pointerType) {
    const reach = REACH_PX[pointerType] ?? REACH_PX.mouse;
    const near = ([hx, hy]) => Math.hypot(hx - x, hy - y) < reach;
    const { pieces } = this.#editor.built();
    if (!pieces.length) return null;
    const index = pieces.findLastIndex((piece) => near(this.#view.toScreen(...point(piece, piece.length_m))));
    if (index >= 0) return { kind: "end", index };
    const start = this.#editor.start ?? this.#editor.here();
    if (near(this.#view.toScreen(start.x_m, start.y_m))) return { kind: "start" };
    return near(knobAt(this.#view, start)) && reach < KNOB_PX ? { kind: "knob" } : null;
  }
}
