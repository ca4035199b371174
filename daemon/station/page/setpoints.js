/**
 * Drives by `drive.set` for as long as one control is held, and by no more than one control at a time.
 *
 * Each set-point waits for the answer to the last, so that no more than one can be on its way to a robot whose network
 * hangs; it is too old soon after it arrives.
 */

const PERIOD_MS = 100;
/** Age at which the daemon drops a set-point. */
const VALID_FOR_MS = 300;
/** An answer that took longer: the robot has stopped meanwhile, and does not go on by itself. */
const LINK_LOST_S = 1;
const NO_MORE = "let go, and hold it again to drive";

export class SetPoints {
  #station;
  #source = null;
  #timer = 0;
  #asked = false;
  #motion = null;
  #ending = null;

  /** @param {object} station see station.js */
  constructor(station) {
    this.#station = station;
    /** Called with the parameters of each set-point, and with null when nothing is commanded any more. */
    this.onSent = () => {};
    station.on("connected", () => station.connected || this.#forget());
    station.on("robot", () => this.#forget());
  }

  /** The control that is held: `{values, onLost}`; null while none is. */
  get source() {
    return this.#source;
  }

  /**
   * Drive from now on until the control is let go of.
   *
   * @param {{values: function(): object, onLost: function(): void}} source gives the parameters of `drive.set`, and
   *   is told when the robot does not follow it any more
   * @returns {boolean} false where it cannot be driven, which is told
   */
  hold(source) {
    if (this.#source) return this.#source === source;
    const reason = this.#station.cannot("drive.set");
    if (reason) {
      this.#station.say(`not driving: ${reason}`, "warning");
      return false;
    }
    this.#source = source;
    this.#station.lease.hold(this);
    this.#timer = setInterval(() => this.#send(), PERIOD_MS);
    this.#send();
    return true;
  }

  /** Let go: the motion ends by its ramp. Of a control that is not held nothing is heard. */
  release(source) {
    if (!this.#source || source !== this.#source) return;
    this.#rest();
    if (!this.#asked) this.#endMotion();
  }

  /** Let go of whatever is held. */
  releaseAll() {
    const source = this.#source;
    this.release(source);
    source?.onLost();
  }

  async #send() {
    if (this.#asked || this.#ending || !this.#source) return;
    this.#asked = true;
    const begun_ms = performance.now();
    try {
      const values = this.#source.values();
      this.onSent(values);
      const parameters = { ...values, valid_for_ms: VALID_FOR_MS };
      const answer = await this.#station.call("drive.set", parameters, { timeout_ms: 2000 * LINK_LOST_S });
      this.#follow(answer.motion);
      const took_s = (performance.now() - begun_ms) / 1000;
      if (took_s > LINK_LOST_S) this.#lose(`the robot answered after ${took_s.toFixed(1)} s, and has stopped`);
    } catch (error) {
      this.#lose(error.remedy ? `${error.message} – ${error.remedy}` : error.message, isLatched(error));
    } finally {
      this.#asked = false;
      if (!this.#source) this.#endMotion();
    }
  }

  /** Remember the motion of these set-points; one that ends before its control is let go of was stopped. */
  #follow(motion) {
    if (motion === this.#motion) return;
    this.#motion = motion;
    const over = (why, told) => {
      if (motion !== this.#motion) return;
      this.#motion = null;
      this.#lose(why, told);
    };
    const end = this.#station.call("motion.wait", { motion }, { timeout_ms: 0 });
    end.then(() => over("the motion is over"), (error) => over(error.message, isLatched(error)));
  }

  #endMotion() {
    const motion = this.#motion;
    if (!motion) return;
    this.#motion = null;
    const end = this.#station.call("motion.stop", { motion }, { timeout_ms: 10_000 }).catch(() => {});
    this.#ending = end.then(() => {
      this.#ending = null;
    });
  }

  /** Drive no more before the control was let go of and held again. */
  #lose(why, told = false) {
    const source = this.#source;
    if (!source) return;
    this.#rest();
    if (!told) this.#station.say(`${why}: ${NO_MORE}`, "warning");
    source.onLost();
  }

  #rest() {
    clearInterval(this.#timer);
    this.#source = null;
    this.#station.lease.release(this);
    this.onSent(null);
  }

  #forget() {
    this.#motion = null;
    this.#lose("the connection to the robot is lost");
  }
}

/** Whether an emergency stop is the reason, which the header tells. */
function isLatched(error) {
  return error.data?.type === "EmergencyStop";
}
