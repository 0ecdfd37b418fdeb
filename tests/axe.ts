// Prints axe-core's script, with which browser tests judge accessibility: deno run tests/axe.ts
//
//   npm axe-core, as deno.lock pins it ─▶ the script that a page runs
import axe from "axe-core";

console.log(axe.source);
