/** Why something cannot be done now, for people. */

import { whoHas } from "./words.js";

const RANK = ["stop", "watch", "drive", "configure"];
/** Methods of the station itself that change something. */
const STATION_ROLES = {
  "station.path.write": "drive",
  "station.path.delete": "drive",
  "station.record.start": "drive",
  "station.record.stop": "drive",
};
/** Methods that not every vehicle has, and what a vehicle without them does not do. */
const NOT_OF_ALL = {
  steer: "has no wheel pairs that are steered one by one",
  "drive.set": "is not driven by hand",
  "drive.parallel": "cannot move without turning",
  "drive.turn": "drives no arc of fixed headings by command",
  "drive.rotate": "cannot turn about its own centre",
  "drive.heading": "does not keep a heading by command",
  "drive.to": "does not drive to a place by itself",
  "drive.path": "follows no paths",
};
/** States in which nothing new begins to move. */
const STANDING = {
  estop: "the emergency stop is latched: reset it first",
  fault: "the vehicle is in fault: reset it first",
  stopping: "the vehicle is stopping: wait until it is at rest",
};

/**
 * @param {object} station see station.js
 * @param {string} method of the daemon or of the station
 * @returns {string|null} the reason against calling it now
 */
export function reasonAgainst(station, method) {
  if (!station.connected) return "no connection to the robot";
  if (!station.status) return "no word from the robot yet";
  const told = station.methods.get(method);
  if (!told && !method.startsWith("station.")) return `this daemon is too old for ${method}`;
  return (
    reasonOfRole(station, method, told?.role ?? STATION_ROLES[method]) ??
    reasonOfVehicle(station, method) ??
    (moves(method, told) ? reasonOfState(station, method, told) : null)
  );
}

/** What this vehicle lacks for a method, for people; null where it has all, or nothing is known of it yet. */
export function lackOf(station, method) {
  return station.status ? reasonOfVehicle(station, method) : null;
}

function reasonOfRole(station, method, needed = "watch") {
  if (RANK.indexOf(station.role) >= RANK.indexOf(needed)) return null;
  const way = station.status?.role_remedy;
  return `needs the role ${needed}, and this page has ${station.role}${way ? `: ${way}` : ""}`;
}

function reasonOfVehicle({ status, shape }, method) {
  const cannotTurn = method === "drive.rotate" && shape?.stream?.yaw_rate === false;
  const lacks = cannotTurn || !status.vehicle.methods.includes(method);
  if (method in NOT_OF_ALL && lacks) return `this vehicle ${NOT_OF_ALL[method]}`;
  if (method.startsWith("brake.") && !status.brakes.length) return "this vehicle has no brakes";
  if (method.startsWith("simulation.") && shape && !shape.simulated) return "this robot is no simulation";
  return null;
}

/** Whether a method moves something, or lets something move. */
function moves(method, told) {
  return Boolean(told?.needs_lease) || method === "brake.release" || method === "motor.enable";
}

function reasonOfState({ status, stale, holds }, method, told) {
  if (stale) return "the values are stale: nothing is heard from the robot";
  const { state, message, holder } = status;
  if (state in STANDING) return STANDING[state];
  if (method in NOT_OF_ALL && (state === "waiting" || state === "booting")) return message || `the vehicle is ${state}`;
  if (told.needs_lease && holder && !holds) return `${whoHas(holder)} has the robot: wait, or take it over`;
  return null;
}
