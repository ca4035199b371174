/** What other pages and programs do to the robot, told at once: who has stopped it, who has taken it over. */

const TOLD = /^(stop was |.* has taken the robot over)/;

/** Tell it from now on; what this page itself does is told where it is done. */
export function watchOthers(station) {
  station.on("event", ({ message }) => {
    const own = station.hello?.name;
    if (TOLD.test(message) && !(own && acts(own, message))) station.say(message, "warning");
  });
}

function acts(name, message) {
  return message.startsWith(`${name} `) || message.endsWith(` on ${name}`);
}
