/** Draws a vehicle on the map: parts, wheels with their headings, instantaneous centre, an arrow where it heads. */

const LEAST_ARROW_PX = 26;
const ARROW_M = 0.25;
const FARTHEST_ICR_M = 50;
const WHEEL_LEAST_PX = 3;

const radians = (angle_deg) => angle_deg * Math.PI / 180;

/** A function that takes points of a frame {x_m, y_m, yaw_deg} to the map. */
function placed({ x_m, y_m, yaw_deg }) {
  const [cos, sin] = [Math.cos(radians(yaw_deg)), Math.sin(radians(yaw_deg))];
  return ([x, y]) => [x_m + x * cos - y * sin, y_m + x * sin + y * cos];
}

/** The pose of a part of the vehicle: a trailer has one of its own. */
function poseOf(part, vehicle) {
  const body = vehicle.pose ?? vehicle.odometry;
  return part === "trailer" ? vehicle.trailer ?? body : body;
}

/** Corners [x, y] of the vehicle's parts on the map, as one list. */
export function vehicleCorners(shape, vehicle) {
  const parts = shape?.parts ?? [];
  return parts.flatMap(({ name, outline_m }) => outline_m.map(placed(poseOf(name, vehicle))));
}

/**
 * Draw the vehicle as its status tells it.
 *
 * @param context of the canvas.
 * @param view a MapView.
 * @param colours the palette.
 * @param shape the result of vehicle.shape, or null: only the arrow is drawn then.
 * @param vehicle of the status, with a pose.
 */
export function drawVehicle(context, view, colours, shape, vehicle) {
  for (const part of shape?.parts ?? []) drawPart(context, view, colours, part, poseOf(part.name, vehicle));
  const wheels = shape?.wheels ?? [];
  for (const wheel of wheels) drawWheel(context, view, colours, wheel, vehicle);
  if (vehicle.icr) drawCentre(context, view, colours, wheels, vehicle);
  drawArrow(context, view, colours, poseOf("body", vehicle));
}

function drawPart(context, view, colours, { outline_m }, pose) {
  view.trace(context, outline_m.map(placed(pose)));
  context.closePath();
  [context.fillStyle, context.strokeStyle, context.lineWidth] = [colours.panel, colours.ink, 2];
  context.fill();
  context.stroke();
}

/** A function that takes points of a wheel's frame to that of its part: a steered wheel turns about its pivot. */
function onPart({ name, x_m, y_m, pivot_x_m = x_m, pivot_y_m = y_m }, vehicle) {
  const turned = placed({ x_m: pivot_x_m, y_m: pivot_y_m, yaw_deg: vehicle.wheels_deg?.[name] ?? 0 });
  return ([x, y]) => turned([x_m - pivot_x_m + x, y_m - pivot_y_m + y]);
}

function drawWheel(context, view, colours, wheel, vehicle) {
  const half = Math.max(wheel.width_m / 2, WHEEL_LEAST_PX / 2 / view.px_m);
  const corners = [[1, 1], [1, -1], [-1, -1], [-1, 1]].map(([x, y]) => [x * wheel.radius_m, y * half]);
  view.trace(context, corners.map(onPart(wheel, vehicle)).map(placed(poseOf(wheel.part, vehicle))));
  context.closePath();
  [context.fillStyle, context.strokeStyle, context.lineWidth] = [colours.ink, colours.accent, 1.5];
  if (!wheel.driven) context.fillStyle = colours.muted;
  context.fill();
  if (wheel.steered) context.stroke();
}

/** The instantaneous centre as a cross, with lines to the wheels of the body. */
function drawCentre(context, view, colours, wheels, vehicle) {
  const { x_m, y_m } = vehicle.icr;
  if (Math.hypot(x_m, y_m) > FARTHEST_ICR_M) return;
  const onMap = placed(poseOf("body", vehicle));
  const centre = onMap([x_m, y_m]);
  [context.strokeStyle, context.lineWidth] = [colours.series[1], 1];
  context.setLineDash([3, 4]);
  for (const wheel of wheels.filter(({ part }) => part === "body")) {
    view.trace(context, [centre, onMap(onPart(wheel, vehicle)([0, 0]))]);
    context.stroke();
  }
  context.setLineDash([]);
  drawCross(context, view, centre);
}

function drawCross(context, view, place) {
  const [x, y] = view.toScreen(...place);
  context.lineWidth = 2;
  context.beginPath();
  for (const [dx, dy] of [[5, 5], [5, -5]]) {
    context.moveTo(x - dx, y - dy);
    context.lineTo(x + dx, y + dy);
  }
  context.stroke();
}

function drawArrow(context, view, colours, pose) {
  const [x, y] = view.toScreen(pose.x_m, pose.y_m);
  const length = Math.max(LEAST_ARROW_PX, ARROW_M * view.px_m);
  context.save();
  context.translate(x, y);
  context.rotate(-radians(pose.yaw_deg));
  [context.strokeStyle, context.fillStyle, context.lineWidth] = [colours.accent, colours.accent, 3];
  context.beginPath();
  context.moveTo(0, 0);
  context.lineTo(length - 8, 0);
  context.stroke();
  context.beginPath();
  for (const [px, py] of [[length, 0], [length - 10, 5], [length - 10, -5]]) context.lineTo(px, py);
  context.fill();
  context.beginPath();
  context.arc(0, 0, 3.5, 0, 2 * Math.PI);
  context.fill();
  context.restore();
}

/** Draw reflectors {name, x_m, y_m} as squares on their corners, with their names. */
export function drawReflectors(context, view, colours, reflectors) {
  [context.strokeStyle, context.fillStyle, context.lineWidth] = [colours.ink, colours.ink, 2];
  [context.textAlign, context.textBaseline] = ["left", "middle"];
  for (const { name, x_m, y_m } of reflectors) {
    const [x, y] = view.toScreen(x_m, y_m);
    context.beginPath();
    for (const [dx, dy] of [[6, 0], [0, 6], [-6, 0], [0, -6]]) context.lineTo(x + dx, y + dy);
    context.closePath();
    context.stroke();
    context.fillText(name, x + 9, y);
  }
}
