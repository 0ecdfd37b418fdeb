// Prints how many people are in each zone, ten times a second: deno run --allow-net clients/typescript/people.ts
import type { ToClient } from "./types.ts";

const socket = new WebSocket(Deno.args[0] ?? "ws://127.0.0.1:8420/ws");
socket.onmessage = ({ data }) => {
  const message: ToClient = JSON.parse(data);
  if (!("frame" in message)) return;
  for (const [zone, { count }] of Object.entries(message.frame.zones)) {
    console.log(zone, count ?? "not known");
  }
};
