// The connection to the tracker, and requests without an answer: `deno test`.

import { connect } from "./net.js";

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
