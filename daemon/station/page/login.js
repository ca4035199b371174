/** Who the page's person is, and which robots there are: asked again and again over HTTP. */

import { Absent } from "./absent.js";
import { h } from "./dom.js";

const PERIOD_MS = 2000;
/** Characters of a line of the tokens' file: more is something else. */
const LONGEST = 1000;
const ROLE_BEFORE = /^(watch|drive|configure)\s+/;

/**
 * Ask for the login where one is needed, then keep the choice of robots up to date.
 *
 * @param {object} station see station.js
 */
export function watchLogin(station) {
  const absent = new Absent(station, (robot) => choose(station, robot));
  const look = async () => {
    seen = await lookForRobots(station);
    absent.show(seen);
    setTimeout(look, PERIOD_MS);
  };
  let seen = { robots: [] };
  for (const kind of ["connected", "robot"]) station.on(kind, () => absent.show(seen));
  look();
  document.getElementById("logout").addEventListener("click", () => logOut(station));
}

async function lookForRobots(station) {
  try {
    const { login_needed, role } = await fetched("session");
    document.getElementById("logout").hidden = !login_needed || !role;
    showLogin(station, login_needed && !role);
    if (login_needed && !role) return { robots: [] };
    const { robots } = await fetched("robots");
    offer(station, robots);
    return { robots };
  } catch {
    return { robots: [], answers: false };
  }
}

async function fetched(path) {
  const answer = await fetch(path, { cache: "no-store", signal: AbortSignal.timeout(2 * PERIOD_MS) });
  if (!answer.ok) throw new Error(answer.statusText);
  return answer.json();
}

/** The choice of robots; a robot that is chosen stays chosen while its daemon is away. */
function offer(station, robots) {
  const select = document.getElementById("robot");
  const names = robots.map((robot) => robot.name);
  const chosen = station.robot ?? asked() ?? (robots.find((robot) => robot.alive) ?? robots[0])?.name ?? null;
  if (chosen && !names.includes(chosen)) robots = [...robots, { name: chosen, alive: false }];
  const told = robots.map((robot) => `${robot.name}${robot.alive ? "" : " (not running)"}`);
  if (select.dataset.told !== told.join()) {
    select.dataset.told = told.join();
    select.replaceChildren(...robots.map((robot, i) => h("option", { value: robot.name }, told[i])));
  }
  if (chosen) select.value = chosen;
  choose(station, chosen);
}

function asked() {
  return new URLSearchParams(location.search).get("robot");
}

/** Choose a robot, and keep it in the address. */
export function choose(station, robot) {
  if (robot && asked() !== robot) {
    history.replaceState(null, "", `?robot=${encodeURIComponent(robot)}${location.hash}`);
  }
  station.choose(robot);
}

function showLogin(station, needed) {
  const section = document.getElementById("login");
  if (needed && section.hidden) section.replaceChildren(...form(station));
  section.hidden = !needed;
}

function form(station) {
  const token = h("input", { id: "token", type: "password", autocomplete: "current-password" });
  const trouble = h("p", { class: "bad", role: "alert" });
  const send = h("button", { type: "submit", class: "main" }, "Log in");
  const asking = h("form", {}, h("label", { for: "token" }, "Token"), token, send, trouble);
  asking.addEventListener("submit", async (event) => {
    event.preventDefault();
    send.disabled = true;
    const typed = token.value.trim();
    trouble.textContent = whyNoToken(typed) || (await logIn(typed.replace(ROLE_BEFORE, "")));
    send.disabled = false;
    if (!trouble.textContent) await lookForRobots(station);
  });
  return [
    h("h2", { id: "login-title" }, "Log in"),
    h("p", {}, "This control station asks for a token. Whoever has set it up gives you one; a whole line of the file",
      " of tokens will do, too."),
    asking,
  ];
}

/** Forget the token; what this page moves comes to rest with its connection. */
async function logOut(station) {
  station.choose(null);
  await station.attempt(fetch("logout", { method: "POST" }), "logging out");
  showLogin(station, true);
}

/** Why something cannot be a token; empty where it may be one. */
function whyNoToken(typed) {
  if (!typed) return "Type or paste the token first.";
  if (typed.length > LONGEST) return `These are ${typed.length} characters: paste the one line with your token.`;
  return /\s/.test(typed.replace(ROLE_BEFORE, "")) ? "A token has no spaces: paste the one line with yours." : "";
}

/** What went wrong, for people; empty where the login is done. */
async function logIn(token) {
  const headers = { "Content-Type": "application/json" };
  try {
    const answer = await fetch("login", { method: "POST", headers, body: JSON.stringify({ token }) });
    if (answer.ok) return "";
    const { message, remedy } = await answer.json();
    return `${message}: ${remedy}`;
  } catch {
    return "The control station does not answer: is it still running?";
  }
}
