// Prints Foxglove's own JSON Schemas, for tests/foxglove.py: deno run tests/foxglove.ts
//
//   npm @foxglove/schemas, as deno.lock pins it ─▶ {"LaserScan": {"title": "foxglove.LaserScan", …}, …}
import * as schemas from "@foxglove/schemas/jsonschema.js";

console.log(JSON.stringify(Object.fromEntries(
  Object.entries(schemas).filter(([, schema]) =>
    (schema as { title?: string })?.title?.startsWith("foxglove.")
  ),
)));
