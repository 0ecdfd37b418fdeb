// What clients/typescript/people.ts says of a tracker with users: deno test --allow-net=127.0.0.1 --allow-run tests/people.ts

/** What it prints, with a token or without, of a tracker that takes one token and then says one frame. */
async function said(token: string): Promise<{ out: string; err: string; code: number }> {
  const frame = { zones: { hall: { count: 2 }, kitchen: { count: null } } };
  const tracker = Deno.serve({ hostname: "127.0.0.1", port: 0, onListen: () => {} }, (request) => {
    if (request.headers.get("Authorization") !== "Bearer kehai_right") {
      return new Response("log in", { status: 401 });
    }
    const { socket, response } = Deno.upgradeWebSocket(request);
    socket.onopen = () => {
      socket.send(JSON.stringify({ frame }));
      socket.close(1001, "the tracker ends");
    };
    return response;
  });
  const script = new URL("../clients/typescript/people.ts", import.meta.url).pathname;
  const args = ["run", "--quiet", "--allow-net", "--allow-env=KEHAI_TOKEN", script];
  const people = new Deno.Command(Deno.execPath(), {
    args: [...args, `ws://127.0.0.1:${tracker.addr.port}/ws`],
    env: { KEHAI_TOKEN: token, NO_COLOR: "1" },
  });
  const { code, stdout, stderr } = await people.output();
  await tracker.shutdown();
  const text = (bytes: Uint8Array) => new TextDecoder().decode(bytes);
  return { out: text(stdout), err: text(stderr), code };
}

function assert(is: boolean, what: unknown) {
  if (!is) throw new Error(JSON.stringify(what));
}

Deno.test("people are counted with a token, and the end is told", async () => {
  const { out, err, code } = await said("kehai_right");
  assert(out === "hall 2\nkitchen not known\n", out);
  assert(code === 1 && err.includes("The connection has ended: 1001 the tracker ends"), err);
});

Deno.test("without a token it says that it was refused", async () => {
  for (const token of ["", "kehai_wrong"]) {
    const { out, err, code } = await said(token);
    assert(code === 1 && out === "" && err.includes("401"), { out, err });
  }
});
