/**
 * Paths of lines and arcs as numbers, so that the page can draw and edit them. Nothing here knows of a screen.
 *
 * The same as daemon/loops/path.py and daemon/runtime/path_building.py, which have the last word on what can be driven;
 * a browser test compares both. Angles are in radians where the name does not say degrees; left is positive.
 *
 * A piece is {x_m, y_m, direction_rad, length_m, curvature, backward, entry}: its beginning, the direction of travel
 * there, its curvature [1/m] (positive bends to the left of travel), and the number of its entry in the path file.
 */

const STRAIGHT = 1e-9;
export const MAX_GAP_M = 0.005;
export const MAX_KINK_RAD = 0.5 * Math.PI / 180;
const ROUNDING_M = 1e-9;
const KINDS = ["line_m", "line_to_m", "arc_deg", "waypoints_m"];

/** Degrees as radians. */
export const radians = (angle_deg) => angle_deg * Math.PI / 180;

/** Radians as degrees. */
export const degrees = (angle_rad) => angle_rad * 180 / Math.PI;

/** The same angle within half a turn. */
export const wrap = (angle_rad) => angle_rad - 2 * Math.PI * Math.round(angle_rad / (2 * Math.PI));

/** The direction of travel `along_m` from the beginning of a piece, not wrapped. */
export const direction = (piece, along_m) => piece.direction_rad + piece.curvature * along_m;

/** The vehicle's heading there, not wrapped. */
export const heading = (piece, along_m) => direction(piece, along_m) + (piece.backward ? Math.PI : 0);

/** The point [x, y] `along_m` from the beginning of a piece. */
export function point(piece, along_m) {
  const half = piece.curvature * along_m / 2;
  const chord = half ? along_m * Math.sin(half) / half : along_m;
  const towards = piece.direction_rad + half;
  return [piece.x_m + chord * Math.cos(towards), piece.y_m + chord * Math.sin(towards)];
}

/** The centre [x, y] of an arc. */
export function centre(piece) {
  const radius = 1 / piece.curvature;
  return [piece.x_m - radius * Math.sin(piece.direction_rad), piece.y_m + radius * Math.cos(piece.direction_rad)];
}

/** The nearest point of a piece's endless line or circle as [way from its beginning, offset of x, y to the left]. */
export function project(piece, x_m, y_m, near_m = 0) {
  if (Math.abs(piece.curvature) < STRAIGHT) {
    const [dx, dy] = [x_m - piece.x_m, y_m - piece.y_m];
    const [cos, sin] = [Math.cos(piece.direction_rad), Math.sin(piece.direction_rad)];
    return [dx * cos + dy * sin, dy * cos - dx * sin];
  }
  const [cx, cy] = centre(piece);
  const sense = Math.sign(piece.curvature);
  const offset = 1 / piece.curvature - sense * Math.hypot(x_m - cx, y_m - cy);
  const towards = Math.atan2(y_m - cy, x_m - cx) + sense * Math.PI / 2;
  return [near_m + wrap(towards - direction(piece, near_m)) / piece.curvature, offset];
}

/** Distance [m] of a place from a piece with its ends, and the way along it to the nearest point. */
export function distance(piece, x_m, y_m) {
  const [along, offset] = project(piece, x_m, y_m, piece.length_m / 2);
  if (along >= 0 && along <= piece.length_m) return { distance_m: Math.abs(offset), along_m: along };
  const along_m = along < 0 ? 0 : piece.length_m;
  const [ex, ey] = point(piece, along_m);
  return { distance_m: Math.hypot(x_m - ex, y_m - ey), along_m };
}

/** The piece nearest to a place, as {index, distance_m, along_m}; null without pieces. */
export function nearest(pieces, x_m, y_m) {
  let best = null;
  pieces.forEach((piece, index) => {
    const found = distance(piece, x_m, y_m);
    if (!best || found.distance_m < best.distance_m) best = { index, ...found };
  });
  return best;
}

/** Points [x, y] along a piece, its ends among them; on an arc so many that a chord turns by at most `step_rad`. */
export function sample(piece, step_rad = 0.05) {
  const parts = Math.max(1, Math.ceil(Math.abs(piece.curvature) * piece.length_m / step_rad));
  return Array.from({ length: parts + 1 }, (_, number) => point(piece, piece.length_m * number / parts));
}

/** The arc {arc_deg, radius_m} that leaves a place in a direction of travel and goes through a point.
 *  Null where that is a line, or the point lies behind. */
export function arcThrough(place, x_m, y_m) {
  const [dx, dy] = [x_m - place.x_m, y_m - place.y_m];
  const chord = Math.hypot(dx, dy);
  const half = wrap(Math.atan2(dy, dx) - place.direction_rad);
  if (chord < ROUNDING_M || Math.abs(Math.sin(half)) * chord < MAX_GAP_M / 2 || Math.abs(half) > 0.95 * Math.PI) {
    return null;
  }
  return { arc_deg: degrees(2 * half), radius_m: chord / (2 * Math.abs(Math.sin(half))) };
}

/** Length [m] of the line that leaves a place in its direction of travel and ends beside a point. */
export function lineTowards(place, x_m, y_m) {
  const [dx, dy] = [x_m - place.x_m, y_m - place.y_m];
  return dx * Math.cos(place.direction_rad) + dy * Math.sin(place.direction_rad);
}

/** Where the next piece of a path would begin: the state that path files leave unsaid. */
class Chain {
  constructor(start, lead_m, exchanged) {
    [this.x_m, this.y_m, this.heading_rad] = [start.x_m ?? 0, start.y_m ?? 0, radians(start.heading_deg ?? 0)];
    [this.lead_m, this.exchanged, this.backward, this.pieces] = [lead_m, exchanged, exchanged, []];
    [this.gap_m, this.kink_rad] = [0, 0];
  }

  get direction_rad() {
    return this.heading_rad + (this.backward ? Math.PI : 0);
  }

  /** Change the driving direction: the reference point is another one then. */
  turnRound(drive) {
    if (!drive) return;
    const backward = (drive === "backward") !== this.exchanged;
    const lead_m = this.pieces.length ? this.lead_m * (this.backward - backward) : 0;
    this.x_m += lead_m * Math.cos(this.heading_rad);
    this.y_m += lead_m * Math.sin(this.heading_rad);
    this.backward = backward;
  }

  /** Add one entry of a path file; false where it is none. */
  add(entry, number) {
    if (KINDS.filter((kind) => entry[kind] != null).length !== 1) return false;
    this.turnRound(entry.drive);
    const begin = { x_m: entry.from_m?.[0] ?? this.x_m, y_m: entry.from_m?.[1] ?? this.y_m };
    const pieces = this.made(entry, { ...begin, direction_rad: this.direction_rad });
    if (!pieces?.length || !pieces.every(({ length_m }) => length_m > 0 && Number.isFinite(length_m))) return false;
    if (this.pieces.length || entry.from_m) this.meet(pieces[0]);
    for (const piece of pieces) this.pieces.push({ ...piece, entry: number });
    this.goToEnd(pieces.at(-1));
    return true;
  }

  meet(piece) {
    this.gap_m = Math.max(this.gap_m, Math.hypot(piece.x_m - this.x_m, piece.y_m - this.y_m));
    this.kink_rad = Math.max(this.kink_rad, Math.abs(wrap(piece.direction_rad - this.direction_rad)));
  }

  goToEnd(piece) {
    [this.x_m, this.y_m] = point(piece, piece.length_m);
    this.heading_rad = heading(piece, piece.length_m);
    this.backward = piece.backward;
  }

  made(entry, place) {
    if (entry.waypoints_m != null) return this.through(entry, place);
    if (entry.arc_deg != null) return arc(entry, place, this.backward);
    const backward = this.backward;
    if (entry.line_m != null) return [{ ...place, length_m: entry.line_m, curvature: 0, backward }];
    const [dx, dy] = [entry.line_to_m[0] - place.x_m, entry.line_to_m[1] - place.y_m];
    return [{ ...place, direction_rad: Math.atan2(dy, dx), length_m: Math.hypot(dx, dy), curvature: 0, backward }];
  }

  through(entry, place) {
    if (!(entry.radius_m > 0)) return null;
    return joined([[place.x_m, place.y_m], ...entry.waypoints_m], entry.radius_m, this.backward, this.lead_m);
  }
}

function arc(entry, place, backward) {
  const turn = radians(entry.arc_deg);
  let radius = entry.radius_m;
  let { direction_rad } = place;
  if (entry.centre_m) {
    const [dx, dy] = [place.x_m - entry.centre_m[0], place.y_m - entry.centre_m[1]];
    radius = Math.hypot(dx, dy);
    direction_rad = Math.atan2(dy, dx) + Math.sign(turn) * Math.PI / 2;
  }
  if (!(radius > 0) || !turn) return null;
  const length_m = radius * Math.abs(turn);
  return [{ ...place, direction_rad, length_m, curvature: Math.sign(turn) / radius, backward }];
}

/** Straight legs through points, their corners rounded; null where a leg is too short for that. */
function joined(points, radius_m, backward, lead_m) {
  const towards = points.slice(1).map(([x, y], index) => Math.atan2(y - points[index][1], x - points[index][0]));
  const pieces = [];
  let start_m = 0;
  for (const [index, direction_rad] of towards.entries()) {
    const [[x, y], [bx, by]] = [points[index + 1], points[index]];
    const turn = index + 1 < towards.length ? wrap(towards[index + 1] - direction_rad) : 0;
    const cusp = Math.abs(turn) >= Math.PI - MAX_KINK_RAD;
    const cut = cusp ? 0 : radius_m * Math.tan(Math.abs(turn) / 2);
    const length_m = Math.hypot(x - bx, y - by) - start_m - cut;
    if (length_m < -ROUNDING_M) return null;
    const way = length_m + cut;
    const leg = { x_m: x - way * Math.cos(direction_rad), y_m: y - way * Math.sin(direction_rad), direction_rad };
    if (length_m > ROUNDING_M) pieces.push({ ...leg, length_m, curvature: 0, backward });
    if (cut > ROUNDING_M) pieces.push(corner(leg, length_m, turn, radius_m, backward));
    start_m = cusp ? lead_m : cut;
    backward = cusp ? !backward : backward;
  }
  return pieces;
}

function corner(leg, after_m, turn, radius_m, backward) {
  const [x_m, y_m] = point({ ...leg, curvature: 0 }, after_m);
  const length_m = radius_m * Math.abs(turn);
  return { x_m, y_m, direction_rad: leg.direction_rad, length_m, curvature: Math.sign(turn) / radius_m, backward };
}

/**
 * The pieces of a path file.
 *
 * @param path {start?, pieces}, as drive.path takes it.
 * @param here {x_m, y_m, heading_deg} of the vehicle's reference point, for a path without a start.
 * @param lead_m from the reference point for driving backwards ahead to the one for driving forwards.
 * @param exchanged drive backward what the file says is driven forward, and the other way round.
 * @returns {pieces, end, broken, gap_m, kink_rad}: `end` is where a next piece would begin, `broken` the number of the
 *     first entry that is no piece (the pieces end before it) or null, gap and kink are the largest at the joints.
 */
export function build(path, here, { lead_m = 0, exchanged = false } = {}) {
  const chain = new Chain(path.start ?? here, lead_m, exchanged);
  const broken = path.pieces.findIndex((entry, number) => !chain.add(entry, number));
  const { x_m, y_m, heading_rad, direction_rad, backward, gap_m, kink_rad } = chain;
  const end = { x_m, y_m, heading_rad, direction_rad, backward };
  return { pieces: chain.pieces, end, broken: broken < 0 ? null : broken, gap_m, kink_rad };
}

/** Where a next entry of a path would begin when it is driven `backward` (as the file counts), with its direction. */
export function nextPlace(path, here, backward, { lead_m = 0, exchanged = false } = {}) {
  const chain = new Chain(path.start ?? here, lead_m, exchanged);
  path.pieces.every((entry, number) => chain.add(entry, number));
  chain.turnRound(backward ? "backward" : "forward");
  return { x_m: chain.x_m, y_m: chain.y_m, direction_rad: chain.direction_rad };
}

/** Points as [least x, least y, largest x, largest y]; null without points. */
export function bounds(points) {
  if (!points.length) return null;
  const [xs, ys] = [points.map(([x]) => x), points.map(([, y]) => y)];
  return [Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)];
}
