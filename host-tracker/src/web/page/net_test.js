// The connection to the tracker, and requests without an answer: `deno test`.

import { ask, connect, repeat, stamp } from "./net.js";
import { say } from "./words.js";

function equal(found, expected) {
  const [one, other] = [found, expected].map((value) => JSON.stringify(value));
  if (one !== other) throw new Error(`${one} is not ${other}`);
}

/** Calls `does` while some globals are others. */
async function among(globals, does) {
  const before = Object.keys(globals).map((name) => [
    name,
    Object.getOwnPropertyDescriptor(globalThis, name),
  ]);
  for (const [name, value] of Object.entries(globals)) {
    Object.defineProperty(globalThis, name, { value, configurable: true, writable: true });
  }
  try {
    await does();
  } finally {
    for (const [name, descriptor] of before) {
      if (descriptor) Object.defineProperty(globalThis, name, descriptor);
      else delete globalThis[name];
    }
  }
}

Deno.test("every try to connect that fails is told, though the state stays the same", async () => {
  const sockets = [], again = [];
  class WebSocket {
    constructor() {
      sockets.push(this);
    }
  }
  const globals = {
    WebSocket,
    location: { protocol: "http:", host: "tracker" },
    document: { hidden: false, addEventListener() {} },
    setTimeout: (does) => again.push(does),
    setInterval() {},
  };
  await among(globals, () => {
    const told = [];
    connect({ editors() {}, link: (state) => told.push(state), closed: () => told.push("closed") });
    sockets[0].onclose();
    again.shift()();
    sockets[1].onclose();
    equal(told, ["lost", "closed", "closed"]);
  });
});

/** Calls `does` with a connection whose clock, visibility and timer are the test's; `log` has what was told and sent. */
async function connected(does) {
  const sockets = [], again = [], log = [], listeners = {}, clock = { ms: 0 };
  class WebSocket {
    static OPEN = 1;
    constructor() {
      this.readyState = 0;
      sockets.push(this);
    }
    send(text) {
      log.push(JSON.parse(text).frames);
    }
    close() {
      this.readyState = 2;
    }
  }
  let tick = null;
  const page = { hidden: false, addEventListener: (name, listens) => listeners[name] = listens };
  const globals = {
    WebSocket,
    location: { protocol: "http:", host: "tracker" },
    document: page,
    performance: { now: () => clock.ms },
    setTimeout: (does) => again.push(does),
    setInterval: (does) => tick = does,
  };
  const on = { editors() {}, frame() {}, link: (state) => log.push(state), closed: () => log.push("closed") };
  await among(globals, () => {
    connect(on);
    const opens = () => {
      sockets.at(-1).readyState = 1;
      sockets.at(-1).onopen();
    };
    const frame = (unix_ms) => sockets.at(-1).onmessage({ data: JSON.stringify({ frame: { unix_ms } }) });
    const pass = (ms) => {
      clock.ms += ms;
      tick();
    };
    const hide = (hidden) => {
      page.hidden = hidden;
      listeners.visibilitychange();
    };
    does({ sockets, again, opens, frame, pass, hide, told: () => log.splice(0) });
  });
}

Deno.test("a connection over which nothing comes any more is given up, and a frame of before is no sign of life", async () => {
  await connected(({ sockets, again, opens, frame, pass, told }) => {
    opens();
    frame(1000);
    equal(told(), [true, "live"]);
    pass(3500);
    equal(told(), ["silent"]);
    pass(6000);
    equal(told(), []);
    pass(1000);
    // It is not waited for until the end of the old one is told.
    equal([told(), sockets[0].readyState, sockets[0].onclose], [["lost", "closed"], 2, null]);
    again.shift()();
    opens();
    frame(1000);
    equal(told(), [true]);
    frame(1100);
    equal(told(), ["live"]);
  });
});

Deno.test("a hidden page asks for a frame now and then, and gives up a connection that does not answer", async () => {
  await connected(({ sockets, again, opens, frame, pass, hide, told }) => {
    opens();
    frame(1000);
    hide(true);
    told();
    pass(15_000);
    equal(told(), []);
    pass(6000);
    equal(told(), [true]);
    frame(22_000);
    equal(told(), [false]);
    pass(21_000);
    equal(told(), [true]);
    pass(11_000);
    equal([told(), sockets.length, again.length], [["lost", "closed"], 1, 1]);
  });
});

Deno.test("an answer that breaks off is none, and an empty one is", async () => {
  const answers = [
    new Response('{"name":"front"}'),
    new Response(""),
    new Response(new ReadableStream({ pull: (to) => to.error(new DOMException("late", "TimeoutError")) })),
  ];
  await among({ fetch: () => Promise.resolve(answers.shift()) }, async () => {
    equal(await ask("/"), { name: "front" });
    equal(await ask("/"), {});
    const error = await ask("/").catch((error) => error);
    if (!(error instanceof Error)) throw new Error(JSON.stringify(error));
  });
});

Deno.test("without an answer it is said where the tracker is, and that a change may have been made", async () => {
  const said = (options) => ask("/api/site", options).catch(({ message }) => message);
  const globals = { location: { host: "hall:8420" } };
  await among({ ...globals, fetch: () => Promise.reject(new TypeError()) }, async () => {
    equal(await said(), say("net.no-answer", { host: "hall:8420" }));
    equal(await said({ method: "PUT" }), say("net.change-not-known", { host: "hall:8420" }));
  });
  await among({ ...globals, fetch: () => Promise.resolve(new Response("", { status: 502 })) }, async () => {
    equal(await said(), say("net.status", { host: "hall:8420", status: 502 }));
  });
});

Deno.test("what is repeated waits for the last call to end, and is hastened once", async () => {
  const timers = [], ends = [];
  const globals = { setTimeout: (does, ms) => timers.push([does, ms]), clearTimeout() {} };
  await among(globals, async () => {
    const again = repeat(() => new Promise((end) => ends.push(end)), 300);
    equal([ends.length, timers.length], [1, 0]);
    const ended = async () => {
      ends.at(-1)();
      await Promise.resolve().then(() => {}).then(() => {});
    };
    await ended();
    equal([ends.length, timers.map(([, ms]) => ms)], [1, [300]]);
    timers.shift()[0]();
    again();
    again();
    equal(ends.length, 2);
    await ended();
    equal([ends.length, timers.map(([, ms]) => ms)], [2, [0]]);
  });
});

Deno.test("messages to doors count from 1 with a number of the page's own, and not by the clock", () => {
  const [first, second] = [stamp(1_700_000_000_000), stamp(1_700_000_000_001)];
  equal([first.id, second.id, first.boot === second.boot], [1, 2, true]);
  equal([Number.isSafeInteger(first.boot), first.at_ms, second.at_ms], [
    true,
    1_700_000_000_000,
    1_700_000_000_001,
  ]);
  const page = Deno.readTextFileSync(new URL("door.js", import.meta.url));
  equal(page.includes("{ ...stamp(at_ms), number }"), true);
});
