/** One robot's daemon, reached through the station: JSON-RPC 2.0 over a WebSocket that comes back by itself. */

const FIRST_PAUSE_MS = 250;
const LONGEST_PAUSE_MS = 2000;
/** Silence after which a connection is given up, though the network has not told that it is gone. */
const SILENCE_MS = 4000;
const STATUS_RATE_HZ = 20;
const NO_STATION = "no connection to the control station";

/** By which people tell this page from others: of three digits, as long as it is open. */
const PAGE_NUMBER = 100 + Math.floor(900 * Math.random());

/** What the daemon or the station answered instead of a result, or why there was no answer. */
export class RpcError extends Error {
  /**
   * @param {string} message what went wrong, for people
   * @param {number} code of JSON-RPC; 0 where no answer came
   * @param {object} data the daemon's fields: type, node, object, limit, remedy
   */
  constructor(message, code = 0, data = {}) {
    super(message);
    this.code = code;
    this.data = data;
  }

  /** What to do next; empty where nobody knows. */
  get remedy() {
    return this.data.remedy ?? "";
  }
}

/**
 * Dispatches `open` (detail: hello, methods, shape), `closed` (detail: reason, remedy), `status` and `event` (detail:
 * as the daemon told it).
 */
export class Connection extends EventTarget {
  #socket = null;
  #pending = new Map();
  #lastId = 0;
  #pause_ms = FIRST_PAUSE_MS;
  #again = 0;
  #watch = 0;
  /** The error that is no answer: why the other end hangs up. */
  #farewell = null;

  /** @param {string} robot name of the robot */
  constructor(robot) {
    super();
    this.robot = robot;
    this.lastHeard_ms = 0;
  }

  /** Whether a message would leave this page now. */
  get sends() {
    return this.#socket?.readyState === WebSocket.OPEN;
  }

  /** Connect, and connect again whenever the connection is lost, until `close`. */
  open() {
    const address = new URL(`ws/${encodeURIComponent(this.robot)}?page=${PAGE_NUMBER}`, document.baseURI);
    address.protocol = address.protocol.replace("http", "ws");
    const socket = new WebSocket(address);
    this.#socket = socket;
    this.#farewell = null;
    this.lastHeard_ms = performance.now();
    socket.onopen = () => this.#greet(socket);
    socket.onmessage = (message) => this.#take(message.data);
    socket.onclose = (end) => this.#lose(this.#farewell?.message ?? (end.reason || NO_STATION));
    this.#watch = setInterval(() => this.#lookForSilence(), SILENCE_MS / 4);
  }

  /** Hang up for good. */
  close() {
    clearTimeout(this.#again);
    this.#drop("the page has hung up");
  }

  /**
   * Call a method of the daemon or of the station.
   *
   * @param {string} method its name
   * @param {object} params its parameters
   * @param {{timeout_ms?: number}} options how long to wait; 0 waits as long as the connection lasts
   * @returns {Promise<object>} its result; rejects with RpcError
   */
  call(method, params = {}, { timeout_ms = 5000 } = {}) {
    if (!this.sends) {
      const remedy = "it comes back by itself; the robot stops meanwhile";
      return Promise.reject(new RpcError(`${method} was not sent: no connection to the robot`, 0, { remedy }));
    }
    const id = ++this.#lastId;
    // by sent_ms the station tells a command that hung in the network from a fresh one
    this.#socket.send(JSON.stringify({ jsonrpc: "2.0", id, method, params, sent_ms: Date.now() }));
    return new Promise((resolve, reject) => {
      const timer = timeout_ms ? setTimeout(() => this.#giveUp(id, method, timeout_ms), timeout_ms) : 0;
      this.#pending.set(id, { resolve, reject, timer });
    });
  }

  #giveUp(id, method, timeout_ms) {
    const told = `no answer to ${method} within ${timeout_ms / 1000} s`;
    this.#settle(id)?.reject(new RpcError(told, 0, { remedy: "look at the connection, and try again" }));
  }

  #settle(id) {
    const call = this.#pending.get(id);
    this.#pending.delete(id);
    clearTimeout(call?.timer);
    return call;
  }

  async #greet(socket) {
    try {
      const hello = await this.call("hello");
      const { methods } = await this.call("api.schema");
      const shape = await this.call("vehicle.shape").catch(nothingWhereUnknown);
      this.#tell("open", { hello, methods, shape });
      await this.call("subscribe", { rate_hz: STATUS_RATE_HZ });
      this.#pause_ms = FIRST_PAUSE_MS;
    } catch (error) {
      if (socket === this.#socket) this.#lose(error.remedy ? `${error.message}: ${error.remedy}` : error.message);
    }
  }

  #take(text) {
    this.lastHeard_ms = performance.now();
    const message = parsed(text);
    if (message.method === "status" || message.method === "event") {
      this.#tell(message.method, message.params);
    } else if (message.error) {
      const { code, message: told, data } = message.error;
      if (message.id == null) this.#farewell = new RpcError(told, code, data);
      this.#settle(message.id)?.reject(new RpcError(told, code, data));
    } else {
      this.#settle(message.id)?.resolve(message.result);
    }
  }

  #lookForSilence() {
    const silent_ms = performance.now() - this.lastHeard_ms;
    if (silent_ms > SILENCE_MS) this.#lose(`no word from the robot for ${Math.round(silent_ms / 1000)} s`);
  }

  #lose(reason) {
    this.#drop(reason);
    this.#again = setTimeout(() => this.open(), this.#pause_ms);
    this.#pause_ms = Math.min(2 * this.#pause_ms, LONGEST_PAUSE_MS);
  }

  /** Let go of the socket without waiting for a farewell, which never comes over a network that is cut. */
  #drop(reason) {
    clearInterval(this.#watch);
    const socket = this.#socket;
    this.#socket = null;
    if (socket) {
      socket.onopen = socket.onmessage = socket.onclose = null;
      socket.close();
    }
    for (const id of [...this.#pending.keys()]) {
      const remedy = "it comes back by itself";
      this.#settle(id).reject(new RpcError("the connection to the robot was lost", 0, { remedy }));
    }
    this.#tell("closed", { reason, remedy: this.#farewell?.remedy ?? "" });
  }

  #tell(kind, detail) {
    this.dispatchEvent(new CustomEvent(kind, { detail }));
  }
}

function parsed(text) {
  try {
    return JSON.parse(text) ?? {};
  } catch {
    return {};
  }
}

function nothingWhereUnknown(error) {
  if (error.code) return null;
  throw error;
}
