/** The path in the editor: what the table, the map and the keys change, with undo. It draws nothing. */

import { arcThrough, build, degrees, lineTowards, MAX_GAP_M, MAX_KINK_RAD, nextPlace, wrap } from "./path_geometry.js";

export const SNAP_M = 0.1;
export const SNAP_DEG = 5;
const SHORTEST_M = 0.01;
const MOST_STEPS = 200;
/** More are no work for hands, and too much for one request to the daemon. */
const MOST_PIECES = 500;
const NEW_LINE = { kind: "line", length_m: 1 };
const NEW_ARC = { kind: "arc", radius_m: 1.5, arc_deg: 45 };
const EMPTY = { description: "", start: null, entries: [], exchanged: false };
let entriesMade = 0;

const editors = new WeakMap();

/** The one editor of a page. */
export function editorOf(station) {
  if (!editors.has(station)) editors.set(station, new PathEditor(station));
  return editors.get(station);
}

/** The nearest multiple of a step. */
const stepped = (value, step) => Math.round(value / step) * step;

/** So exact as anybody means it: tenths of a millimetre, thousandths of a degree. */
const rounded = (value, digits) => Number(value.toFixed(digits));

/**
 * Dispatches `change` whenever the path, the choice in it or the way to drive it is another one, and before something
 * is undone `undo`, which may be prevented.
 *
 * entries: {kind: "line", length_m, backward} and {kind: "arc", radius_m, arc_deg, backward}, each going on where the
 * one before it ends, and each with a number of its own as its `id`. start: {x_m, y_m, heading_deg}, or null for a
 * path that begins where the vehicle is.
 */
class PathEditor extends EventTarget {
  #station;
  #state = EMPTY;
  #before = [];
  #undone = [];
  #group = null;

  constructor(station) {
    super();
    this.#station = station;
    this.chosen = null;
    this.nextBackward = false;
    this.snaps = true;
    this.problem = null;
    station.on("robot", () => this.#forget());
  }

  get entries() {
    return this.#state.entries;
  }

  get start() {
    return this.#state.start;
  }

  get description() {
    return this.#state.description;
  }

  /** Whether the path is driven backwards: forward and backward exchanged in all of it. */
  get exchanged() {
    return this.#state.exchanged;
  }

  get undoable() {
    return this.#before.length > 0;
  }

  get redoable() {
    return this.#undone.length > 0;
  }

  /** From the reference point for driving backwards ahead to the one for driving forwards [m]. */
  get lead_m() {
    return this.#station.shape?.path?.lead_m ?? 0;
  }

  get options() {
    return { lead_m: this.lead_m, exchanged: this.exchanged };
  }

  /** The path as drive.path takes it. */
  spec() {
    return asSpec(this.#state);
  }

  /** The path as it would be driven, for a file: whoever drives that forwards does the same. */
  drivenSpec() {
    const { entries, exchanged, ...rest } = this.#state;
    return asSpec({ ...rest, entries: entries.map((entry) => ({ ...entry, backward: entry.backward !== exchanged })) });
  }

  /** The pieces in the frame of the map, and where a next one would begin. */
  built() {
    return build(this.spec(), this.here(), this.options);
  }

  /** Where a path without a start begins: the vehicle's reference point for its first piece. */
  here() {
    const first = this.entries[0]?.backward ?? this.nextBackward;
    return referencePoint(this.#station.status, first !== this.exchanged);
  }

  /**
   * Change the path so that it can be undone.
   *
   * @param {function(object): void} change gets a copy of the state to change
   * @param {*} group changes that follow each other with the same one are undone together, as those of one drag
   */
  edit(change, group = null) {
    const state = structuredClone(this.#state);
    change(state);
    if (JSON.stringify(state) === JSON.stringify(this.#state)) return;
    if (group === null || group !== this.#group) this.#before = [...this.#before.slice(1 - MOST_STEPS), this.#state];
    [this.#group, this.#undone] = [group, []];
    this.#show(state);
  }

  undo() {
    if (this.dispatchEvent(new Event("undo", { cancelable: true }))) this.#step(this.#before, this.#undone);
  }

  redo() {
    this.#step(this.#undone, this.#before);
  }

  #step(from, to) {
    if (!from.length) return;
    to.push(this.#state);
    this.#group = null;
    this.#show(from.pop());
  }

  #show(state) {
    this.#state = state;
    if (this.chosen !== null && this.chosen >= state.entries.length) this.chosen = null;
    this.problem = null;
    this.#station.setPath(state.entries.length ? this.spec() : null);
    this.changed();
  }

  /** Tell everybody that something looks different. */
  changed() {
    this.dispatchEvent(new Event("change"));
  }

  /** Set a property that is no part of the path: chosen, nextBackward, snaps, problem. */
  set(name, value) {
    if (this[name] === value) return;
    this[name] = value;
    this.changed();
  }

  clear() {
    const { exchanged } = this;
    this.edit((state) => Object.assign(state, structuredClone(EMPTY), { exchanged }));
  }

  /** Have the path driven backwards, or as it is written. */
  exchange(exchanged) {
    this.edit((state) => Object.assign(state, { exchanged }));
  }

  #forget() {
    [this.#before, this.#undone] = [[], []];
    this.#show(EMPTY);
  }

  /** Take over a path of any form, to be driven as it is written; points and waypoints become lines and arcs that join.
   *  Returns {taken, lost}: a path with a piece that this vehicle has no place for is not taken; what is lost, for
   *  people, or "". */
  load(path) {
    const { pieces, broken, gap_m, kink_rad } = build(path, this.here(), { lead_m: this.lead_m });
    if (broken !== null) return { taken: false, lost: `piece ${broken} is none for this vehicle: nothing is taken over` };
    const entries = pieces.slice(0, MOST_PIECES).map((piece) => made(asEntry(piece)));
    const { description = "", start = null } = path;
    this.chosen = null;
    this.edit((state) =>
      Object.assign(state, { description, start: start && fullStart(start), entries, exchanged: false }),
    );
    if (pieces.length > MOST_PIECES) return { taken: true, lost: `only its first ${MOST_PIECES} pieces are here` };
    const joins = gap_m <= MAX_GAP_M && kink_rad <= MAX_KINK_RAD;
    return { taken: true, lost: joins ? "" : "its pieces did not join; here each begins where the one before it ends" };
  }

  // --- pieces ---------------------------------------------------------------------------------------------------

  /** Put a new line or arc behind the chosen piece, or at the end. */
  insert(kind) {
    const at = this.chosen === null ? this.entries.length : this.chosen + 1;
    const backward = this.entries[at - 1]?.backward ?? this.nextBackward;
    const entry = made({ ...(kind === "arc" ? NEW_ARC : NEW_LINE), backward });
    this.edit((state) => state.entries.splice(at, 0, entry));
    this.set("chosen", at);
  }

  remove(index) {
    this.edit((state) => state.entries.splice(index, 1));
    this.set("chosen", this.entries.length ? Math.min(index, this.entries.length - 1) : null);
  }

  /** Change numbers of a piece. */
  change(index, numbers, group = null) {
    this.edit((state) => Object.assign(state.entries[index], numbers), group);
  }

  /** The line or arc that leads from the end to a point of the map; null where none does. */
  candidate(kind, x_m, y_m, free) {
    const place = nextPlace(this.spec(), this.here(), this.nextBackward, this.options);
    const numbers = this.#towards(kind, place, x_m, y_m, free);
    return numbers && { kind, ...numbers, backward: this.nextBackward };
  }

  /** Put an entry at the end. */
  append(entry) {
    this.edit((state) => state.entries.push(made(entry)));
    this.set("chosen", this.entries.length - 1);
  }

  /** The path with one entry more, in the frame of the map. */
  builtWith(entry) {
    const { pieces, ...spec } = this.spec();
    const more = asPiece(entry, this.entries.at(-1)?.backward ?? false);
    return build({ ...spec, pieces: [...pieces, more] }, this.here(), this.options);
  }

  /** Let a piece end at (an arc) or beside (a line) a point of the map; what follows goes with it. */
  dragEnd(index, x_m, y_m, free, group) {
    const piece = this.built().pieces[index];
    const numbers = piece && this.#towards(this.entries[index].kind, piece, x_m, y_m, free);
    if (numbers) this.change(index, numbers, group);
  }

  #towards(kind, place, x_m, y_m, free) {
    const snaps = this.snaps && !free;
    if (kind === "line") {
      const wanted = lineTowards(place, x_m, y_m);
      const length_m = rounded(snaps ? stepped(wanted, SNAP_M) : wanted, 4);
      return length_m >= SHORTEST_M ? { length_m } : null;
    }
    const arc = arcThrough(place, x_m, y_m);
    if (!arc) return null;
    const radius_m = rounded(snaps ? stepped(arc.radius_m, SNAP_M) : arc.radius_m, 4);
    const arc_deg = rounded(snaps ? stepped(arc.arc_deg, SNAP_DEG) : arc.arc_deg, 3);
    return radius_m > 0 && arc_deg ? { radius_m, arc_deg } : null;
  }

  // --- start ----------------------------------------------------------------------------------------------------

  /** Let the path begin at a place, or (null) where the vehicle is. */
  begin(start, free = true, group = null) {
    this.edit((state) => {
      state.start = start && this.#snapped(start, !this.snaps || free);
    }, group);
  }

  /** Turn the start so that the vehicle heads for a point of the map. */
  turnStart(x_m, y_m, free, group) {
    const start = this.start ?? this.here();
    const heading_deg = degrees(Math.atan2(y_m - start.y_m, x_m - start.x_m));
    this.begin({ ...start, heading_deg }, free, group);
  }

  #snapped({ x_m, y_m, heading_deg }, free) {
    const [step_m, step_deg] = free ? [1e-4, 1e-3] : [SNAP_M, SNAP_DEG];
    const turned = degrees(wrap(stepped(heading_deg, step_deg) * Math.PI / 180));
    const place = { x_m: rounded(stepped(x_m, step_m), 4), y_m: rounded(stepped(y_m, step_m), 4) };
    return { ...place, heading_deg: rounded(turned, 3) };
  }
}

/** Where the vehicle's reference point is: of one with a trailer that drives backwards, the trailer's axle. */
function referencePoint(status, backward) {
  const vehicle = status?.vehicle;
  const pose = (backward && vehicle?.trailer) || vehicle?.pose || vehicle?.odometry;
  return { x_m: pose?.x_m ?? 0, y_m: pose?.y_m ?? 0, heading_deg: pose?.yaw_deg ?? 0 };
}

function made(entry) {
  entriesMade += 1;
  return { ...entry, id: entriesMade };
}

function fullStart({ x_m = 0, y_m = 0, heading_deg = 0 }) {
  return { x_m, y_m, heading_deg };
}

function asSpec({ description, start, entries }) {
  const pieces = entries.map((entry, index) => asPiece(entry, index ? entries[index - 1].backward : false));
  return { ...(description && { description }), ...(start && { start }), pieces };
}

function asPiece({ kind, length_m, radius_m, arc_deg, backward }, before) {
  const drive = backward === before ? {} : { drive: backward ? "backward" : "forward" };
  return kind === "arc" ? { ...drive, arc_deg, radius_m } : { ...drive, line_m: length_m };
}

function asEntry({ length_m, curvature, backward }) {
  const turn_deg = degrees(curvature * length_m);
  if (Math.abs(turn_deg) < 1e-3) return { kind: "line", length_m: rounded(length_m, 4), backward };
  const radius_m = rounded(1 / Math.abs(curvature), 4);
  return { kind: "arc", radius_m, arc_deg: rounded(turn_deg, 3), backward };
}
