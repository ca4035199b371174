/** Words of the daemon as this page says them, and times for people. */

const CLOCK = new Intl.DateTimeFormat([], { hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23" });

/** A time of day, of milliseconds since 1970. */
export function clockTime(at_ms) {
  return CLOCK.format(at_ms);
}

/** A message of the daemon with the button of this page instead of the command that does the same. */
export function inPageWords(message) {
  return (message ?? "").replaceAll("`canhelm reset`", "“Reset”");
}

/** Who has the robot: a page by its name, another program as the daemon tells it. */
export function whoHas(holder) {
  return holder.name ?? holder.client;
}
