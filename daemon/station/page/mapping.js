/** From sticks and sliders to the parameters of `drive.set`. Pure: numbers in, numbers out. */

/** Commands that are parameters of `drive.set` by another name. */
const PLAIN = { yaw_rate: "yaw_rate_deg_s", steering: "steering_deg", direction: "direction_deg" };
const DEGREES = 180 / Math.PI;

/**
 * What may be commanded, with its ends.
 *
 * @param {object|null} told the result of `drive.gamepad`: the profile's sticks; null where it is not known
 * @param {object|null} shape the result of `vehicle.shape`: the limits, where no stick gives a command
 * @returns {object} `{least, full, unit}` by command: speed, sideways, yaw_rate, steering, direction
 */
export function rangesOf(told, shape) {
  const { limits = {}, stream } = shape ?? {};
  const both = (full, unit) => (full ? { least: -full, full, unit } : null);
  const plain = stream && {
    speed: both(limits.speed_m_s, "m/s"),
    yaw_rate: stream.yaw_rate && both(limits.yaw_rate_deg_s, "deg/s"),
    steering: stream.steering && both(limits.steering_deg, "deg"),
    direction: stream.direction && both(180, "deg"),
  };
  const ranges = { ...plain, ...told?.sticks };
  return Object.fromEntries(Object.entries(ranges).filter(([, range]) => range));
}

/** What the on-screen stick and keys give aside: the command that one needs most while driving; null: none. */
export function asideOf(ranges, takenAtRest) {
  return ["sideways", "steering", "yaw_rate"].find((name) => ranges[name] && !takenAtRest.includes(name)) ?? null;
}

/**
 * @param {object} commands values by command
 * @param {number} fastest speed that is not exceeded, however forward and sideways add up
 * @returns {object} parameters of `drive.set`
 */
export function parametersOf(commands, fastest) {
  let speed = commands.speed ?? 0;
  const parameters = {};
  for (const [command, name] of Object.entries(PLAIN)) {
    if (commands[command] !== undefined) parameters[name] = commands[command];
  }
  if (commands.sideways !== undefined) {
    parameters.direction_deg = Math.atan2(commands.sideways, speed) * DEGREES;
    speed = Math.hypot(commands.sideways, speed);
  }
  return { speed_m_s: Math.max(-fastest, Math.min(fastest, speed)), ...parameters };
}

/** Whether an axis is within the dead zone of its stick. */
export function rests(stick, position) {
  return Math.abs(position) <= stick.dead_zone;
}

/** What an axis commands at a position from -1 to 1: nothing in the dead zone, and from there on without a jump. */
export function stickValue(stick, position) {
  if (rests(stick, position)) return 0;
  const share = ((Math.abs(position) - stick.dead_zone) / (1 - stick.dead_zone)) ** stick.exponent;
  return share * (position * stick.sign > 0 ? stick.full : stick.least);
}

/** A share from -1 to 1 of the way to either end of a range. */
export function shareOf(range, share) {
  return share < 0 ? -share * range.least : share * range.full;
}

/** On a vehicle that stands to steer: commands that count as they were when it last began to roll. */
export class TakenAtRest {
  #names;
  #kept = {};
  #rolling = false;

  /** @param {string[]} names of these commands; mostly none */
  constructor(names) {
    this.#names = names;
  }

  /** The commands as they count now. */
  apply(commands) {
    const rolling = Boolean(commands.speed || commands.sideways);
    if (!rolling || !this.#rolling) {
      const names = this.#names.filter((name) => name in commands);
      this.#kept = Object.fromEntries(names.map((name) => [name, commands[name]]));
    }
    this.#rolling = rolling;
    return { ...commands, ...this.#kept };
  }
}
