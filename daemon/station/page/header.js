/** What is always in sight: robot, state, who has it, the connection, and the ways to stop it. */

import { attribute, text } from "./dom.js";
import { Reset, Takeover } from "./header_buttons.js";
import { choose } from "./login.js";
import { Stopper } from "./stopper.js";
import { inPageWords } from "./words.js";

/** A state has a shape, too: colour alone is no word. */
const SHAPES = { idle: "●", active: "▶", stopping: "◼", fault: "✖", estop: "✖", waiting: "◌", booting: "◌" };
const LATCHED = ["estop", "fault"];
const ROLES = { stop: "may only stop", watch: "watching", drive: "may drive", configure: "may configure" };

const element = (name) => document.getElementById(name);

/** Keep the header up to date, and its buttons at work. */
export function watchHeader(station) {
  const stopper = new Stopper(station);
  stopper.watch(element("stop"), element("estop"));
  element("robot").addEventListener("change", (event) => choose(station, event.target.value));
  const buttons = { takeover: new Takeover(station), reset: new Reset(station) };
  station.on("robot", () => forget());
  for (const kind of ["status", "connected", "stale", "robot"]) station.on(kind, () => show(station, buttons));
}

function forget() {
  showState("none", "○ no word yet");
  for (const name of ["message", "latched-why"]) text(element(name), "");
  element("latched").hidden = true;
}

function show(station, { takeover, reset }) {
  showConnection(station);
  if (station.status) showStatus(station);
  takeover.show();
  reset.show(LATCHED.includes(station.status?.state));
  text(element("who"), whoIsHere(station));
}

/** A stop that is latched is told once: in the banner. */
function showStatus({ status, stale, age_s }) {
  const { state, message } = status;
  const latched = LATCHED.includes(state);
  const word = state === "estop" ? "emergency stop" : state;
  if (stale) showState("unknown", `? last: ${word}, ${ageWords(age_s)} ago`);
  else showState(state, `${SHAPES[state] ?? "○"} ${word}`);
  text(element("message"), latched ? "" : message);
  attribute(element("message"), "title", latched ? null : message || null);
  element("latched").hidden = !latched;
  text(element("latched-why"), latched ? inPageWords(message) || word : "");
}

function showState(state, words) {
  attribute(element("state"), "data-state", state);
  text(element("state"), words);
}

/** Values that are too old are marked as such everywhere by `data-stale` of the body. */
function showConnection(station) {
  attribute(document.body, "data-stale", station.stale ? "true" : null);
  attribute(element("connection"), "data-connection", station.stale ? "bad" : "good");
  text(element("connection"), connectionWords(station));
  text(element("connection-told"), station.stale ? "values are stale" : "connected");
  element("stale").hidden = !station.stale || !station.status;
  const since = `Stale: nothing heard for ${ageWords(station.age_s)}. All values are old, and nothing can be moved.`;
  text(element("stale"), station.remedy ? `${since} What to do: ${station.remedy}.` : since);
}

function connectionWords({ robot, connected, stale, status, reason, age_s }) {
  if (!robot) return "no robot chosen";
  if (!connected) return reason ? `reconnecting: ${reason}` : "connecting";
  if (!status) return "connected, no word yet";
  return stale ? `stale since ${ageWords(age_s)}` : "connected";
}

function ageWords(age_s) {
  return `${Math.max(1, Math.round(age_s))} s`;
}

function whoIsHere({ connected, hello, role }) {
  return connected && role ? `${hello.name ? `${hello.name}: ` : ""}${ROLES[role] ?? role}` : "";
}
