// The connection to the tracker: receives frames, reports its own state, and connects again by itself.

import { LINK } from "./names.js";
import { say } from "./words.js";

const AGAIN_MS = [300, 1000, 2000, 4000];
const SILENT_MS = 3000;
/** A connection over which no frame comes for so long, though it is asked for, is given up: its end may never be told. */
const DEAD_MS = 10_000;
/** A hidden page asks for one frame so often, as a sign that its connection is alive: alarms come over it. */
const SIGN_MS = 20_000;

/** The event of an answer that says that nobody is logged in. */
export const LOGGED_OUT = "logged-out";

/**
 * Calls `on.frame`, `on.fields`, `on.alarms`, `on.site`, `on.editors` with what arrives, `on.link` with a LINK when it changes, and
 * `on.closed` each time a connection ends or cannot be made. What it returns is called with whether the editor is open here.
 */
export function connect(on) {
  let socket = null, tries = 0, last = 0, newest = null, signs = false, state = "", editing = false;
  const tell = (next) => {
    if (next !== state) on.link(state = next);
  };
  const open = () => {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    socket = new WebSocket(`${scheme}://${location.host}/ws`);
    socket.onopen = () => {
      tries = 0;
      wish(false);
    };
    socket.onmessage = ({ data }) => {
      const message = JSON.parse(data);
      if (message.frame) {
        // A connection begins with the newest frame: one that was here before says nothing of now.
        if (message.frame.unix_ms !== newest) {
          newest = message.frame.unix_ms;
          last = performance.now();
          tell(LINK.LIVE);
        }
        on.frame(message.frame);
        if (signs) wish(false);
      }
      if (message.fields) on.fields(message.fields);
      if (message.alarms) on.alarms(message.alarms);
      if (message.site) on.site(message.site);
      if (message.editors) on.editors(message.editors);
      if (message.error) console.warn(message.error);
    };
    socket.onclose = ended;
  };
  const ended = () => {
    // Who has gone meanwhile would not be heard of.
    on.editors([]);
    tell(LINK.LOST);
    on.closed();
    setTimeout(open, AGAIN_MS[Math.min(tries++, AGAIN_MS.length - 1)]);
  };
  const giveUp = () => {
    socket.onmessage = socket.onclose = null;
    socket.close();
    ended();
  };
  // A hidden page asks for no frames, but for a sign now and then.
  const wish = (sign) => {
    signs = sign;
    const open = socket.readyState === WebSocket.OPEN;
    if (open) socket.send(JSON.stringify({ frames: !document.hidden || signs, editing }));
    last = performance.now();
  };
  document.addEventListener("visibilitychange", () => wish(false));
  setInterval(() => {
    if (socket.readyState !== WebSocket.OPEN) return;
    const silent = performance.now() - last, asks = !document.hidden || signs;
    if (asks && silent > DEAD_MS) return giveUp();
    if (!asks && silent > SIGN_MS) return wish(true);
    if (!document.hidden && silent > SILENT_MS) tell(LINK.SILENT);
  }, 500);
  open();
  return (now) => {
    editing = now;
    wish(signs);
  };
}

/** Requests by which the tracker changes nothing. */
const READS = ["GET", undefined];

/** The tracker that is asked, as the visitor has addressed it. */
const host = () => globalThis.location?.host;

/** What is said when no answer comes: one that is lost may be the answer to a change that was made. */
function noAnswer(options) {
  const key = READS.includes(options?.method) ? "net.no-answer" : "net.change-not-known";
  return new Error(say(key, { host: host() }));
}

/** The answer to a request, or an error that says why there is none. */
export async function ask(path, options) {
  let response;
  try {
    response = await fetch(path, options);
  } catch {
    throw noAnswer(options);
  }
  if (response.status === 401) dispatchEvent(new Event(LOGGED_OUT));
  const answer = await response.json().catch((error) => {
    // No JSON is no error. An answer that breaks off is one.
    if (error instanceof SyntaxError) return {};
    throw noAnswer(options);
  });
  if (!response.ok) {
    const { status } = response;
    const error = new Error(answer.error ?? say("net.status", { host: host(), status }));
    throw Object.assign(error, { answer, status, isOfTracker: Boolean(answer.error) });
  }
  return answer;
}

/**
 * Calls `does` again and again, `ms` after the last call has ended: two calls are never under way. What it returns calls it at once,
 * or right after the call that is under way.
 */
export function repeat(does, ms) {
  let timer = 0, busy = false, again = false;
  const run = async () => {
    if (busy) {
      again = true;
      return;
    }
    clearTimeout(timer);
    busy = true;
    again = false;
    await does();
    busy = false;
    timer = setTimeout(run, again ? 0 : ms);
  };
  run();
  return run;
}

const boot = crypto.getRandomValues(new Uint32Array(1))[0];
let sent = 0;

/** The stamp of a message to a door: each opening of a page counts for itself, and is in the way of no other device's numbers. */
export const stamp = (at_ms) => ({ id: ++sent, boot, at_ms });

/** The answer to a body of JSON; `more` of the options of `fetch`. */
export const send = (method, path, body, headers = {}, more = {}) =>
  ask(path, {
    ...more,
    method,
    headers: { "Content-Type": "application/json", ...headers },
    body: JSON.stringify(body),
  });

/** Asks a module to do something, or, without a body, for what it knows. */
export function askModule(name, action, body) {
  const path = `/api/module/${encodeURIComponent(name)}${action ? `/${action}` : ""}`;
  return body === undefined ? ask(path) : send("POST", path, body);
}
