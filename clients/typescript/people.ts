// Prints how many people are in each zone, ten times a second:
//
//   KEHAI_TOKEN=kehai_… deno run --allow-net --allow-env=KEHAI_TOKEN clients/typescript/people.ts ws://127.0.0.1:8420/ws
import type { ToClient } from "./types.ts";

const token = Deno.env.get("KEHAI_TOKEN");
const headers = token ? { Authorization: `Bearer ${token}` } : undefined;
const socket = new WebSocket(Deno.args[0] ?? "ws://127.0.0.1:8420/ws", { headers });
socket.onmessage = ({ data }) => {
  const message: ToClient = JSON.parse(data);
  if (!("frame" in message)) return;
  for (const [zone, { count }] of Object.entries(message.frame.zones)) {
    console.log(zone, count ?? "not known");
  }
};
// A refusal is told here alone, with its status: 401 where a token is missing or wrong.
socket.onerror = (event) => console.error((event as ErrorEvent).message);
socket.onclose = ({ code, reason }) => {
  console.error("The connection has ended:", code, reason);
  Deno.exit(1);
};
