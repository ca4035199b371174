/** What is always in sight: robot, state, who has it, the connection, and the ways to stop it. */

import { allow, attribute, text } from "./dom.js";
import { choose } from "./login.js";
import { Stopper } from "./stopper.js";

/** A state has a shape, too: colour alone is no word. */
const SHAPES = { idle: "●", active: "▶", stopping: "◼", fault: "✖", estop: "✖", waiting: "◌", booting: "◌" };
const LATCHED = ["estop", "fault"];
const SURE_MS = 6000;
const TAKEOVER = "takeover";

const element = (name) => document.getElementById(name);

/** Keep the header up to date, and its buttons at work. */
export function watchHeader(station) {
  const stopper = new Stopper(station);
  stopper.watch(element("stop"), element("estop"));
  element("robot").addEventListener("change", (event) => choose(station, event.target.value));
  element("takeover").addEventListener("click", () => takeOverOrGiveBack(station));
  watchReset(station);
  station.on("status", () => showStatus(station));
  station.on("robot", () => showRobot());
  station.on("connected", () => showConnection(station));
  station.on("stale", () => showConnection(station));
  document.addEventListener("visibilitychange", () => document.hidden && station.lease.release(TAKEOVER));
}

function showRobot() {
  showState("none", "no word yet");
  for (const name of ["message", "holder", "latched-why"]) text(element(name), "");
  element("latched").hidden = element("takeover").hidden = true;
}

function showStatus(station) {
  const { state, message } = station.status;
  showState(state, state);
  text(element("message"), message);
  attribute(element("message"), "title", message || null);
  element("latched").hidden = !LATCHED.includes(state);
  text(element("latched-why"), LATCHED.includes(state) ? message || state : "");
  showHolder(station);
  allow(element("reset"), station.cannot("reset"));
}

function showState(state, word) {
  attribute(element("state"), "data-state", state);
  text(element("state"), `${SHAPES[state] ?? "○"} ${word === "estop" ? "emergency stop" : word}`);
}

function showHolder(station) {
  const { holder } = station.status;
  const button = element("takeover");
  const kept = station.holds && station.lease.holds(TAKEOVER);
  text(element("holder"), !holder ? "" : station.holds ? "you have the robot" : `${holder.client} has the robot`);
  text(button, kept ? "Give back" : "Take over");
  button.hidden = !kept && (!holder || station.holds);
  allow(button, station.cannot("lease.take"));
}

/** The robot stays taken over until it is given back, or the page is hidden or gone. */
async function takeOverOrGiveBack(station) {
  if (station.lease.holds(TAKEOVER)) {
    station.lease.release(TAKEOVER);
    await station.attempt(station.call("lease.close"), "giving back");
    return;
  }
  station.lease.hold(TAKEOVER);
  const answer = await station.attempt(station.call("lease.take", {}, { timeout_ms: 10_000 }), "taking over");
  if (!answer) station.lease.release(TAKEOVER);
  else station.say(answer.taken_from ? `you have the robot; ${answer.taken_from} had it` : "you have the robot");
}

/** Values that are too old are marked as such everywhere by `data-stale` of the body. */
function showConnection(station) {
  attribute(document.body, "data-stale", station.stale ? "true" : null);
  attribute(element("connection"), "data-connection", station.stale ? "bad" : "good");
  text(element("connection"), connectionWords(station));
  text(element("connection-told"), station.stale ? "values are stale" : "connected");
  element("stale").hidden = !station.stale || !station.status;
  const since = ageWords(station);
  text(element("stale"), `Stale: nothing heard for ${since}. All values are old, and nothing can be moved.`);
}

function connectionWords({ robot, connected, stale, status, reason, age_s }) {
  if (!robot) return "no robot chosen";
  if (!connected) return reason ? `reconnecting: ${reason}` : "connecting";
  if (!status) return "connected, no word yet";
  return stale ? `stale since ${ageWords({ age_s })}` : "connected";
}

function ageWords({ age_s }) {
  return `${Math.max(1, Math.round(age_s))} s`;
}

/** The first press asks, the second one resets; a question in a window of its own would keep the stop waiting. */
function watchReset(station) {
  const button = element("reset");
  let timer = 0;
  const calm = () => {
    clearTimeout(timer);
    timer = 0;
    text(button, "Reset…");
  };
  button.addEventListener("click", async () => {
    if (!timer) {
      text(button, "It is safe: reset");
      timer = setTimeout(calm, SURE_MS);
      return;
    }
    calm();
    const answer = await station.attempt(station.call("reset", {}, { timeout_ms: 10_000 }), "reset");
    if (answer) station.say(`reset: ${answer.message || `the robot is ${answer.state}`}`);
  });
}
