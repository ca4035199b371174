/** The path that the vehicle follows now, whoever had it driven: asked for when it begins. */

import { build } from "./path_geometry.js";

/**
 * Attributes: `pieces` of the path followed now, in the frame of the map, null where none is followed; `last`, of the
 * one that was followed before, where it was, until the next one or `forget`. Calls `changed` when one is another.
 */
export class ActivePath {
  #station;
  #motion = null;

  constructor(station, changed) {
    [this.#station, this.changed, this.pieces, this.last] = [station, changed, null, null];
    station.on("status", ({ vehicle }) => this.#look(vehicle?.following ?? null));
    station.on("robot", () => this.forget());
  }

  /** Show no path any more, until the next one is followed. */
  forget() {
    this.#look(null);
    this.last = null;
    this.changed();
  }

  #look(following) {
    const motion = following?.motion ?? null;
    if (motion === this.#motion) return;
    this.#motion = motion;
    this.last = motion === null ? this.pieces : null;
    this.#show(null);
    if (motion !== null) this.#ask(motion);
  }

  /** A daemon that does not tell is no trouble: the path in the editor stays to be seen. */
  async #ask(motion) {
    const { path } = await this.#station.call("path.active").catch(() => ({}));
    if (path && motion === this.#motion) this.#show(build(path, path.start).pieces);
  }

  #show(pieces) {
    this.pieces = pieces;
    this.changed();
  }
}
