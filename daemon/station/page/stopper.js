/** Stop and emergency stop: sent the moment they are pressed, whatever else the page does. */

/** Time without an answer after which somebody should look at the robot. */
const ANSWER_MS = 2000;
/** Longest time from a pointer's press to the click that it makes. */
const CLICK_MS = 1000;
const LOOK = "look at the robot; stop it there if it moves";
/** Inputs in which a space is something to write. */
const WRITING_TYPES = "[type=text], [type=search], [type=password], [type=url], :not([type])";
const WRITING = `textarea, [contenteditable], input:is(${WRITING_TYPES}):not(.number)`;
const TICKED = "input:is([type=checkbox], [type=radio])";

export class Stopper {
  #station;

  /** @param {object} station see station.js */
  constructor(station) {
    this.#station = station;
  }

  /** Stop by these buttons, and by the space bar wherever the focus is. */
  watch(stop, estop) {
    pressed(stop, () => this.send("stop"));
    pressed(estop, () => this.send("estop"));
    document.addEventListener("keydown", (event) => this.#onKey(event), { capture: true });
    document.addEventListener("keyup", swallowSpace, { capture: true });
  }

  /**
   * Send a stop now, and tell what has become of it.
   *
   * @param {"stop"|"estop"} method which one
   * @param {string} way how it was pressed, for people
   */
  async send(method, way = "pressed") {
    const station = this.#station;
    const what = method === "stop" ? "stop" : "emergency stop";
    if (!station.sends) {
      station.stopAlarm.raise(`${what} NOT SENT`, "no connection to the robot!", "stop it at the robot itself");
      return;
    }
    const answer = station.call(method, { reason: `${way} on ${this.#page}` }, { timeout_ms: 15_000 });
    const late = setTimeout(() => this.#tellLate(what), ANSWER_MS);
    try {
      const told = await answer;
      station.stopAlarm.end();
      if (method === "stop") station.say(`stopped: ${told.message || `the robot is ${told.state}`}`, "warning");
    } catch (error) {
      station.stopAlarm.raise(`${what} not confirmed`, error.message, LOOK);
    } finally {
      clearTimeout(late);
    }
  }

  #tellLate(what) {
    const { stale, status } = this.#station;
    if (!stale && status.state === "stopping") {
      this.#station.say(`${what}: the robot is coming to rest`, "warning");
    } else {
      const why = stale ? "nothing is heard from the robot" : `it is ${status.state}`;
      this.#station.stopAlarm.raise(`${what} sent, NO ANSWER YET`, why, LOOK);
    }
  }

  get #page() {
    return this.#station.hello?.name ?? "the control station's page";
  }

  #onKey(event) {
    if (event.key === "Escape" && event.target.matches?.(WRITING)) {
      event.target.blur();
    } else if (event.key === "Enter" && event.target.matches?.(TICKED)) {
      event.preventDefault();
      event.target.click();
    } else if (isStop(event)) {
      event.preventDefault();
      event.stopPropagation();
      if (!event.repeat) this.send("stop", "pressed by the space bar");
    }
  }
}

function isStop(event) {
  return event.code === "Space" && !event.target.matches?.(WRITING);
}

/** A space that has stopped the robot does not press the button that has the focus, too. */
function swallowSpace(event) {
  if (isStop(event)) event.preventDefault();
}

/**
 * Call at the moment a button goes down; of a click only where no pointer has just made it (Enter, a screen reader).
 * Once too often stops as well as once.
 */
function pressed(button, act) {
  let down_ms = -Infinity;
  button.addEventListener("pointerdown", (event) => {
    down_ms = event.timeStamp;
    act();
  });
  button.addEventListener("click", (event) => {
    if (event.timeStamp - down_ms > CLICK_MS) act();
  });
}
