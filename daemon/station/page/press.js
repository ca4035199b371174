/** Presses that are meant: a double-click is one, and so is a key that is held down. */

import { attribute } from "./dom.js";

/** Time after a press in which another one does not count, and begins the time anew. */
const PAUSE_MS = 700;

/**
 * Call at each press that is meant; none is while the last one is being carried out.
 *
 * @param {HTMLElement} button that is pressed
 * @param {function(): (Promise|void)} act what it does
 */
export function onPress(button, act) {
  let pause = 0;
  let busy = false;
  const show = () => attribute(button, "aria-disabled", pause || busy ? "true" : null);
  const rest = () => {
    clearTimeout(pause);
    pause = setTimeout(() => {
      pause = 0;
      show();
    }, PAUSE_MS);
    show();
  };
  button.addEventListener("keydown", (event) => event.repeat && event.key === "Enter" && event.preventDefault());
  button.addEventListener("click", async () => {
    const counts = !pause && !busy;
    rest();
    if (!counts) return;
    busy = true;
    await act();
    busy = false;
    show();
  });
}
