/** Asks the daemon, while a path is drawn, whether it could be driven: drive.path with dry_run. */

const PAUSE_MS = 250;
const PIECE = /^pieces\[(\d+)\]/;

/**
 * What the daemon says of the path in the editor; the newest question's answer wins.
 *
 * Attribute `verdict`: {kind: "none"} without a path, {kind: "asking"}, {kind: "unknown", message} where it cannot be
 * asked, {kind: "good", summary} or {kind: "bad", message, remedy, piece} with the piece's number or null.
 * Dispatches `change`.
 */
export class PathCheck extends EventTarget {
  #station;
  #editor;
  #timer = 0;
  #asked = "";
  #state = null;

  /**
   * @param station the station.
   * @param editor whose path is checked.
   * @param boxes tell by `speed_m_s()` the speed that is asked for, null for as fast as the vehicle may, and by
   *     `wrong()` in words what is wrong in a box, so that the path is not as it is written; null where nothing is.
   */
  constructor(station, editor, { speed_m_s, wrong }) {
    super();
    [this.#station, this.#editor, this.verdict] = [station, editor, { kind: "none" }];
    [this.speed_m_s, this.wrong] = [speed_m_s, wrong];
    editor.addEventListener("change", () => this.look());
    for (const kind of ["connected", "shape", "robot"]) station.on(kind, () => this.again());
    station.on("status", () => this.#watchState());
  }

  /** What drive.path is asked for. */
  params() {
    const speed_m_s = this.speed_m_s();
    return {
      path: this.#editor.spec(),
      backward: this.#editor.exchanged,
      ...(speed_m_s !== null && { speed_m_s }),
    };
  }

  /** Ask, if it has not been asked for just this; a moment later, so that a drag asks when it pauses. */
  look() {
    const wrong = this.wrong();
    const asked = JSON.stringify([wrong, this.params()]);
    if (asked === this.#asked) return;
    this.#asked = asked;
    clearTimeout(this.#timer);
    if (!this.#editor.entries.length) return this.#tell({ kind: "none" });
    if (wrong) return this.#tell({ kind: "bad", message: wrong, remedy: "mend it, or undo it", piece: null });
    this.#tell({ kind: "asking" });
    this.#timer = setTimeout(() => this.#ask(asked), PAUSE_MS);
  }

  /** The verdict on the path as it is now, as soon as there is one. */
  async settled() {
    this.look();
    while (this.verdict.kind === "asking") {
      await new Promise((resolve) => this.addEventListener("change", resolve, { once: true }));
    }
    return this.verdict;
  }

  /** Ask once more: the vehicle or its place is another one. */
  again() {
    this.#asked = "";
    this.look();
  }

  /** Whether a path begins near enough depends on where the vehicle has come to rest. */
  #watchState() {
    const state = this.#station.status?.state;
    if (state === this.#state) return;
    this.#state = state;
    if (state === "idle") this.again();
  }

  async #ask(asked) {
    const reason = this.#reason();
    if (reason) return this.#tell({ kind: "unknown", message: reason });
    let verdict;
    try {
      verdict = { kind: "good", summary: await this.#station.call("drive.path", { ...this.params(), dry_run: true }) };
    } catch (error) {
      verdict = refusal(error);
    }
    if (asked === this.#asked) this.#tell(verdict);
  }

  /** Why it cannot be asked; a vehicle that moves or is in fault can. */
  #reason() {
    const { connected, status, shape } = this.#station;
    if (!connected) return "no connection to the robot";
    if (shape && !shape.path) return "this vehicle follows no paths";
    if (status?.role === "watch" || status?.role === "stop") return "checking a path needs the role drive";
    return null;
  }

  #tell(verdict) {
    this.verdict = verdict;
    this.#editor.set("problem", verdict.kind === "bad" ? verdict : null);
    this.dispatchEvent(new Event("change"));
  }
}

function refusal(error) {
  const found = PIECE.exec(error.data?.object ?? "");
  const { message, remedy = "" } = error;
  return { kind: error.code ? "bad" : "unknown", message, remedy, piece: found ? Number(found[1]) : null };
}
