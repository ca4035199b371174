/** What all panels share: the robot that was chosen, its connection and its newest status. */

import { Connection } from "./connection.js";
import { Lease } from "./lease.js";
import { lackOf, reasonAgainst } from "./reasons.js";
import { StopAlarm } from "./stop_alarm.js";

/** Age at which values are stale. */
const STALE_MS = 1000;
const LOOK_MS = 200;

class Station {
  #listeners = new Map();
  #connection = null;
  #told_ms = -Infinity;

  constructor() {
    /** Name of the chosen robot. */
    this.robot = null;
    /** The newest `status` of the daemon, be it stale. */
    this.status = null;
    /** The result of `vehicle.shape`; null where there is none. */
    this.shape = null;
    /** The result of `hello`. */
    this.hello = null;
    /** Methods of the daemon by their names, as `api.schema` tells them. */
    this.methods = new Map();
    this.connected = false;
    this.stale = true;
    /** Why there is no connection. */
    this.reason = "";
    /** What to do about that; empty where it comes back by itself. */
    this.remedy = "";
    /** The path in the editor: start and pieces; null where there is none. */
    this.path = null;
    this.lease = new Lease(this);
    this.stopAlarm = new StopAlarm(this);
  }

  /** Watch the age of the values from now on. */
  start() {
    setInterval(() => this.#lookAtAge(), LOOK_MS);
  }

  /**
   * Hear of something.
   *
   * @param {"status"|"event"|"shape"|"connected"|"stale"|"robot"|"path"|"said"|"unsaid"} kind of what
   * @param {function(any): void} listener is given the news, where there is more than the station itself holds
   */
  on(kind, listener) {
    this.#listeners.set(kind, [...(this.#listeners.get(kind) ?? []), listener]);
  }

  /** What the page's person may do: stop, watch, drive or configure; null before it is known. */
  get role() {
    return this.status?.role ?? this.hello?.role ?? null;
  }

  /** Age of the newest status in seconds. */
  get age_s() {
    return (performance.now() - this.#told_ms) / 1000;
  }

  /** Whether a message would leave this page now, be it never answered. */
  get sends() {
    return Boolean(this.#connection?.sends);
  }

  /** Whether this page's connection has the robot. */
  get holds() {
    return Boolean(this.status?.holder && this.status.lease && this.status.holder.lease === this.status.lease);
  }

  /** Choose a robot by its name; the last one's motions end with its connection. */
  choose(robot) {
    if (robot === this.robot) return;
    this.#connection?.close();
    this.robot = robot;
    this.status = this.shape = this.hello = this.path = null;
    this.reason = this.remedy = "";
    this.#emit("robot");
    if (robot) this.#connect(robot);
  }

  /** Call a method, as of Connection. */
  call(method, params = {}, options = {}) {
    if (this.#connection) return this.#connection.call(method, params, options);
    return Promise.reject(new Error("no robot is chosen"));
  }

  /**
   * Begin a motion and wait for its end; the page holds it by its lease, so that it ends with the page.
   *
   * @returns {Promise<object>} the method's result; rejects with RpcError
   */
  async move(method, params = {}) {
    const held = Symbol(method);
    this.lease.hold(held);
    try {
      return await this.call(method, params, { timeout_ms: 0 });
    } finally {
      this.lease.release(held);
    }
  }

  /** Why a method cannot be called now, for people; null where it can. */
  cannot(method) {
    return reasonAgainst(this, method);
  }

  /** What this vehicle has not got for a method, however it stands; null where it has. */
  lacks(method) {
    return lackOf(this, method);
  }

  /** Tell people something: info, warning or error, and what to do; with a key it stays until that is unsaid. */
  say(text, severity = "info", remedy = "", key = null) {
    this.#emit("said", { text, severity, remedy, key });
  }

  /** Take back what was said with a key. */
  unsay(key) {
    this.#emit("unsaid", key);
  }

  /**
   * Wait for something, and tell people where it fails.
   *
   * @param {Promise} promise of what was asked for
   * @param {string} what it is, for people
   * @returns {Promise<any>} its result; undefined where it failed
   */
  async attempt(promise, what) {
    try {
      return await promise;
    } catch (error) {
      this.say(what ? `${what}: ${error.message}` : error.message, "error", error.remedy);
      return undefined;
    }
  }

  /** Show a path on the map and in the editor; null: none. */
  setPath(path) {
    this.path = path;
    this.#emit("path", path);
  }

  #connect(robot) {
    const connection = new Connection(robot);
    this.#connection = connection;
    connection.addEventListener("open", ({ detail }) => this.#opened(detail));
    connection.addEventListener("closed", ({ detail }) => this.#closed(connection, detail));
    connection.addEventListener("status", ({ detail }) => this.#took(detail));
    connection.addEventListener("event", ({ detail }) => this.#emit("event", detail));
    connection.open();
  }

  #opened({ hello, methods, shape }) {
    this.hello = hello;
    this.shape = shape;
    this.methods = new Map(methods.map((method) => [method.name, method]));
    this.connected = true;
    this.reason = this.remedy = "";
    this.#emit("connected");
    this.#emit("shape", shape);
  }

  #closed(connection, { reason, remedy }) {
    if (connection !== this.#connection) return;
    this.connected = false;
    [this.reason, this.remedy] = [reason, remedy];
    this.#emit("connected");
    this.#lookAtAge();
  }

  #took(status) {
    this.status = status;
    this.#told_ms = performance.now();
    this.#lookAtAge();
    this.#emit("status", status);
  }

  #lookAtAge() {
    const stale = !this.connected || !this.status || this.age_s * 1000 > STALE_MS;
    if (!stale && !this.stale) return;
    this.stale = stale;
    this.#emit("stale", this.age_s);
  }

  #emit(kind, news) {
    for (const listener of this.#listeners.get(kind) ?? []) listener(news);
  }
}

export const station = new Station();
