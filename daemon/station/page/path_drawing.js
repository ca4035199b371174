/** Draws paths on the map: the one in the editor with its handles, and the one that is followed. */

import { point, sample } from "./path_geometry.js";

export const KNOB_PX = 44;
const DASHES = { forward: [], backward: [8, 5] };

/** Where the knob is that turns the start, on the screen. */
export function knobAt(view, start) {
  const [x, y] = view.toScreen(start.x_m, start.y_m);
  const heading = start.heading_deg * Math.PI / 180;
  return [x + KNOB_PX * Math.cos(heading), y - KNOB_PX * Math.sin(heading)];
}

/** A path as a line, dashed where it is driven backwards. */
export function drawPieces(context, view, pieces, colour, width) {
  [context.strokeStyle, context.lineWidth] = [colour, width];
  for (const piece of pieces) {
    context.setLineDash(piece.backward ? DASHES.backward : DASHES.forward);
    view.trace(context, sample(piece));
    context.stroke();
  }
  context.setLineDash([]);
}

/** The path in the editor with the chosen piece and the one that is wrong. */
export function drawEdited(context, view, colours, editor) {
  const { pieces } = editor.built();
  drawPieces(context, view, pieces, colours.series[0], 3);
  const wrong = editor.problem?.piece ?? null;
  if (editor.chosen !== null && pieces[editor.chosen]) {
    drawPieces(context, view, [pieces[editor.chosen]], colours.accent, 6);
  }
  if (wrong !== null && pieces[wrong]) drawPieces(context, view, [pieces[wrong]], colours.bad, 5);
}

/** What the path in the editor is held by. */
export function drawHandles(context, view, colours, editor) {
  editor.built().pieces.forEach((piece, index) => drawEnd(context, view, colours, piece, index));
  drawStart(context, view, colours, editor);
}

/** A dot at the end of a piece, with its number. */
function drawEnd(context, view, colours, piece, index) {
  const [x, y] = view.toScreen(...point(piece, piece.length_m));
  [context.fillStyle, context.strokeStyle, context.lineWidth] = [colours.paper, colours.series[0], 2];
  context.beginPath();
  context.arc(x, y, 6, 0, 2 * Math.PI);
  context.fill();
  context.stroke();
  [context.fillStyle, context.textAlign, context.textBaseline] = [colours.ink, "left", "bottom"];
  context.fillText(String(index), x + 8, y - 4);
}

/** A square where the path begins, open while that is where the vehicle is, and the knob that turns it. */
function drawStart(context, view, colours, editor) {
  if (!editor.entries.length) return;
  const start = editor.start ?? editor.here();
  const [[x, y], [kx, ky]] = [view.toScreen(start.x_m, start.y_m), knobAt(view, start)];
  [context.fillStyle, context.strokeStyle, context.lineWidth] = [colours.series[0], colours.series[0], 2];
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(kx, ky);
  context.stroke();
  if (!editor.start) context.fillStyle = colours.paper;
  context.beginPath();
  context.rect(x - 6, y - 6, 12, 12);
  context.fill();
  context.stroke();
  context.beginPath();
  context.arc(kx, ky, 5, 0, 2 * Math.PI);
  context.fill();
  context.stroke();
}
