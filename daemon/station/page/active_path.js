/** The path that the vehicle follows now, whoever had it driven: asked for when it begins. */

import { build } from "./path_geometry.js";

/**
 * Attribute `pieces`: of the path followed now, in the frame of the map; null where none is followed.
 * Calls `changed` when that is another one.
 */
export class ActivePath {
  #station;
  #motion = null;

  constructor(station, changed) {
    [this.#station, this.changed, this.pieces] = [station, changed, null];
    station.on("status", ({ vehicle }) => this.#look(vehicle?.following ?? null));
    station.on("robot", () => this.#look(null));
  }

  #look(following) {
    const motion = following?.motion ?? null;
    if (motion === this.#motion) return;
    this.#motion = motion;
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
