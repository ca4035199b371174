/** Making and changing elements; styles stand in style.css alone. */

/**
 * An element.
 *
 * @param {string} tag its name
 * @param {object} attributes by name; `onclick` and the like are listeners; false and null leave one out
 * @param {...(Node|string|number|null|Array)} children what it holds
 * @returns {HTMLElement}
 */
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value !== false && value != null) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.flat().filter((child) => child != null));
  return element;
}

/** Set the text of an element, where it is not that already. */
export function text(element, value) {
  const told = String(value ?? "");
  if (element.textContent !== told) element.textContent = told;
}

/** Set an attribute, where it is not that already; null and false take it away. */
export function attribute(element, name, value) {
  if (value == null || value === false) element.removeAttribute(name);
  else if (element.getAttribute(name) !== String(value)) element.setAttribute(name, value);
}

/** A number for people, with a true minus sign; `–` where there is none. */
export function number(value, digits = 2) {
  if (value == null || !Number.isFinite(value)) return "–";
  const told = value.toFixed(digits);
  return (Number(told) === 0 ? told.replace("-", "") : told).replace("-", "−");
}

/** A number with its unit; a degree sign stands beside the number. */
export function quantity(value, digits, unit) {
  return `${number(value, digits)}${unit.startsWith("°") ? "" : " "}${unit}`;
}

/**
 * Draw at most once an animation frame, and not while the element cannot be seen.
 *
 * @param {HTMLElement} element of the panel
 * @param {function(): void} draw draws it
 * @returns {function(): void} to be called whenever something has changed
 */
export function redraw(element, draw) {
  let waiting = false;
  return () => {
    if (waiting || element.closest("[hidden]") || document.hidden) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      draw();
    });
  };
}

/** Call no more often than people can read: news in between are in the next call, as long as news keep coming. */
export function seldom(draw, period_ms = 100) {
  let last_ms = -Infinity;
  return () => {
    const now_ms = performance.now();
    if (now_ms - last_ms < period_ms) return;
    last_ms = now_ms;
    draw();
  };
}

/**
 * Let a control be used, or disable it with the reason for people.
 *
 * @param {HTMLElement} control a button or an input
 * @param {string|null} reason why not; null where it may be used
 */
export function allow(control, reason) {
  if (control.disabled !== Boolean(reason)) control.disabled = Boolean(reason);
  attribute(control, "title", reason);
}
