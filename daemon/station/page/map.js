/** The map: the vehicle, where it was, where it goes, and the path in the editor. */

import { ActivePath } from "./active_path.js";
import { font, palette, sharp } from "./canvas.js";
import { attribute, h, number, redraw, text } from "./dom.js";
import { listen } from "./map_gestures.js";
import { MapView } from "./map_view.js";
import { drawEdited, drawHandles, drawPieces } from "./path_drawing.js";
import { editorOf } from "./path_editor.js";
import { bounds, nearest, sample } from "./path_geometry.js";
import { PathHandles } from "./path_handles.js";
import { Trail } from "./trail.js";
import { drawReflectors, drawVehicle, vehicleCorners } from "./vehicle_drawing.js";

const ZOOM_STEP = 1.4;
const TOLD_EACH_MS = 1000;
const TOOLS = { move: "Move", line: "Add lines", arc: "Add arcs" };

/** The panel. */
export function create(station) {
  return new MapPanel(station).element;
}

class MapPanel {
  #view = new MapView();
  #trail = new Trail();
  #follows = true;
  #fitted = false;
  #cursor = null;
  #told_ms = 0;
  #seen = "";
  #changed;
  #surface;

  constructor(station) {
    this.station = station;
    this.editor = editorOf(station);
    this.handles = new PathHandles(this.editor, this.#view);
    this.#make();
    const draw = redraw(this.element, () => this.#draw());
    this.#changed = draw;
    this.#surface = sharp(this.canvas, draw);
    this.active = new ActivePath(station, draw);
    this.editor.addEventListener("change", () => this.#edited());
    station.on("status", ({ vehicle }) => this.#took(vehicle));
    station.on("robot", () => this.#forget());
    for (const kind of ["shape", "stale", "connected"]) station.on(kind, draw);
    listen(this.canvas, this.#view, this.#handlers());
    this.#edited();
  }

  // --- elements -------------------------------------------------------------------------------------------------

  #make() {
    this.canvas = h("canvas", { class: "map-canvas", role: "img", "aria-label": "Map: no vehicle yet" });
    const follow = { type: "button", "aria-pressed": "true", onclick: () => this.#follow() };
    this.followButton = h("button", { ...follow, "aria-label": "Follow the vehicle" }, "Follow");
    const zoom = (factor) => () => this.#zoomed(factor);
    this.cursorText = h("output", { class: "map-cursor", "aria-label": "Place of the pointer" });
    this.staleText = h("p", { class: "map-stale", hidden: true }, "Values are stale");
    this.element = h(
      "section",
      { class: "map", "aria-labelledby": "map-title" },
      h("h2", { id: "map-title" }, "Map"),
      h(
        "div",
        { class: "map-tools", role: "group", "aria-label": "View of the map" },
        h("button", { type: "button", "aria-label": "Zoom in", onclick: zoom(ZOOM_STEP) }, "+"),
        h("button", { type: "button", "aria-label": "Zoom out", onclick: zoom(1 / ZOOM_STEP) }, "−"),
        h("button", { type: "button", onclick: () => this.#fit() }, "Fit"),
        this.followButton,
        h("button", { type: "button", onclick: () => this.#clearTrail() }, "Clear trail"),
      ),
      this.#pathTools(),
      h("div", { class: "map-frame" }, this.canvas, this.staleText, this.cursorText),
    );
  }

  #pathTools() {
    this.tools = Object.entries(TOOLS).map(([tool, title]) =>
      h("button", { type: "button", "data-tool": tool, onclick: () => this.#choose(tool) }, title),
    );
    const turn = () => this.editor.set("nextBackward", !this.editor.nextBackward);
    this.directionButton = h("button", { type: "button", onclick: turn }, "New pieces: forward");
    this.undoButton = h("button", { type: "button", onclick: () => this.editor.undo() }, "Undo");
    this.redoButton = h("button", { type: "button", onclick: () => this.editor.redo() }, "Redo");
    const group = { class: "map-tools", role: "group", "aria-label": "Path on the map" };
    const buttons = [...this.tools, this.directionButton, this.undoButton, this.redoButton];
    this.pathGroup = h("div", group, ...buttons);
    return this.pathGroup;
  }

  // --- what happens ---------------------------------------------------------------------------------------------

  #handlers() {
    const { handles } = this;
    return {
      grab: (x, y, event) => !this.active.pieces && handles.grab(x, y, event),
      drag: (x, y, event) => handles.drag(x, y, event),
      drop: () => handles.drop(),
      click: (x, y, event) => this.active.pieces || this.#click(x, y, event),
      hover: (x, y, event) => this.#hover(x, y, event),
      leave: () => this.#leave(),
      moved: (zoomed) => this.#moved(zoomed),
    };
  }

  #choose(tool) {
    this.handles.tool = tool;
    this.handles.hovered = null;
    this.#edited();
  }

  #click(x, y, event) {
    if (this.handles.click(x, y, event)) return;
    this.station.say(`No ${this.handles.tool} leads there`, "info", "it goes on where the path ends, in its direction");
  }

  #hover(x, y, event) {
    this.#cursor = this.#view.toWorld(x, y);
    this.handles.hover(x, y, event);
    this.#changed();
  }

  #leave() {
    [this.#cursor, this.handles.hovered] = [null, null];
    this.#changed();
  }

  /** A pan by hand ends following; a zoom goes on with it. */
  #moved(zoomed) {
    if (!zoomed) this.#follow(false);
    this.#changed();
  }

  #zoomed(factor) {
    this.#view.zoom(factor);
    this.#changed();
  }

  #follow(follows = !this.#follows) {
    this.#follows = follows;
    attribute(this.followButton, "aria-pressed", String(follows));
    this.#changed();
  }

  #clearTrail() {
    this.#trail.clear();
    if (!this.active.pieces) this.active.forget();
    this.#changed();
  }

  #forget() {
    this.#trail.clear();
    this.#fitted = false;
    this.#changed();
  }

  #took(vehicle) {
    const pose = placeOf(vehicle);
    if (pose) this.#trail.add(pose.x_m, pose.y_m);
    this.#tell(vehicle);
    const seen = JSON.stringify([pose, vehicle?.trailer, vehicle?.wheels_deg, vehicle?.icr]);
    if (seen === this.#seen) return;
    this.#seen = seen;
    this.#changed();
  }

  #edited() {
    const { editor, handles } = this;
    for (const button of this.tools) attribute(button, "aria-pressed", String(button.dataset.tool === handles.tool));
    text(this.directionButton, `New pieces: ${editor.nextBackward ? "backward" : "forward"}`);
    [this.undoButton.disabled, this.redoButton.disabled] = [!editor.undoable, !editor.redoable];
    this.#changed();
  }

  // --- drawing --------------------------------------------------------------------------------------------------

  /** All points that Fit shows. */
  #points() {
    const { shape, status } = this.station;
    const vehicle = status?.vehicle;
    const places = (shape?.reflectors ?? []).map(({ x_m, y_m }) => [x_m, y_m]);
    const pieces = this.active.pieces ?? this.editor.built().pieces;
    const corners = placeOf(vehicle) ? vehicleCorners(shape, vehicle) : [];
    return [...places, ...pieces.flatMap((piece) => sample(piece)), ...corners];
  }

  #fit() {
    const box = bounds(this.#points());
    if (!box) return;
    this.#follow(false);
    this.#view.fit(box);
    this.#changed();
  }

  #draw() {
    const { context, width, height } = this.#surface();
    const view = this.#view;
    [view.width, view.height] = [width, height];
    this.#place();
    const colours = this.#colours();
    context.font = font(12);
    context.lineJoin = "round";
    view.drawGrid(context, colours);
    drawReflectors(context, view, colours, this.station.shape?.reflectors ?? []);
    this.#drawWays(context, colours);
    const vehicle = this.station.status?.vehicle;
    if (placeOf(vehicle)) drawVehicle(context, view, colours, this.station.shape, vehicle);
    if (!this.active.pieces) drawHandles(context, view, colours, this.editor);
    view.drawScaleBar(context, colours);
    this.#drawTexts();
  }

  /** The first view of a robot shows all of it; then the vehicle stays in the middle, if it shall. */
  #place() {
    const { shape, status } = this.station;
    const pose = placeOf(status?.vehicle);
    if (!pose) return;
    if (!this.#fitted && shape) {
      this.#fitted = true;
      const box = bounds(this.#points());
      if (box) this.#view.fit(box);
    }
    if (this.#follows) this.#view.centre(pose.x_m, pose.y_m);
  }

  /** Stale values are grey. */
  #colours() {
    const colours = palette();
    if (!this.station.stale) return colours;
    const grey = Object.fromEntries(["ink", "accent", "good", "warn", "bad"].map((name) => [name, colours.muted]));
    return { ...colours, ...grey, series: colours.series.map(() => colours.muted) };
  }

  #drawWays(context, colours) {
    const { pieces, last } = this.active;
    if (last) drawPieces(context, this.#view, last, colours.good, 1.5);
    if (pieces) drawPieces(context, this.#view, pieces, colours.good, 4);
    else this.#drawEditor(context, colours);
    [context.strokeStyle, context.lineWidth] = [colours.series[3], 2];
    this.#trail.draw(context, this.#view);
  }

  /** The path in the editor, and what a click would add to it. */
  #drawEditor(context, colours) {
    drawEdited(context, this.#view, colours, this.editor);
    const { hovered } = this.handles;
    const piece = hovered && this.editor.builtWith(hovered).pieces.at(-1);
    if (piece) drawPieces(context, this.#view, [piece], colours.muted, 2);
  }

  #drawTexts() {
    const [x, y] = this.#cursor ?? [];
    text(this.cursorText, this.#cursor ? `x ${number(x)} m, y ${number(y)} m` : "");
    this.staleText.hidden = !this.station.stale;
    this.pathGroup.hidden = !this.station.shape?.path;
  }

  /** The map in words, at most once a second. */
  #tell(vehicle) {
    const now_ms = performance.now();
    if (now_ms - this.#told_ms < TOLD_EACH_MS) return;
    this.#told_ms = now_ms;
    const pose = placeOf(vehicle);
    if (pose) attribute(this.canvas, "aria-label", `Map: ${inWords(pose, vehicle.following, this.editor, this.active.last)}`);
  }
}

function placeOf(vehicle) {
  return vehicle?.pose ?? vehicle?.odometry ?? null;
}

function inWords({ x_m, y_m, yaw_deg }, following, editor, last) {
  const where = `vehicle at x ${number(x_m)} m, y ${number(y_m)} m, heading ${number(yaw_deg, 0)} degrees`;
  if (following) return `${where}, following a path, ${number(Math.abs(following.error_m))} m from it`;
  const from = (pieces, name) => {
    const found = nearest(pieces ?? [], x_m, y_m);
    return found ? `, ${number(found.distance_m)} m from the ${name}` : "";
  };
  return `${where}${from(editor.built().pieces, "path in the editor")}${from(last, "path driven last")}`;
}
