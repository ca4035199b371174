/** What drawings on a canvas share: the colours of the style sheet, and a canvas as sharp as the screen. */

const NAMES = ["ink", "paper", "panel", "line", "accent", "good", "warn", "bad", "muted"];
const SERIES = ["series-1", "series-2", "series-3", "series-4"];

let colours = null;
const changed = new Set();

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  colours = null;
  for (const listener of changed) listener();
});

/** The colours of the style sheet by their names without dashes in front, and `series`, a list. */
export function palette() {
  if (colours) return colours;
  const style = getComputedStyle(document.documentElement);
  const read = (name) => style.getPropertyValue(`--${name}`).trim();
  colours = Object.fromEntries(NAMES.map((name) => [name, read(name)]));
  colours.series = SERIES.map(read);
  return colours;
}

/** The font of the page in a size [px]. */
export function font(size) {
  return `${size}px ${getComputedStyle(document.body).fontFamily}`;
}

/**
 * Keep a canvas as sharp as the screen.
 *
 * @param canvas an element that its style sheet gives a size.
 * @param draw called when its size or the colours have changed.
 * @returns a function that gives {context, width, height}, cleared, in CSS pixels.
 */
export function sharp(canvas, draw) {
  changed.add(draw);
  new ResizeObserver(draw).observe(canvas);
  return () => {
    const [width, height, ratio] = [canvas.clientWidth, canvas.clientHeight, devicePixelRatio];
    const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, width, height);
    return { context, width, height };
  };
}
