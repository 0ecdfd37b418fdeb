// Holds docs/schemas/asyncapi.json against the schema of AsyncAPI 3.0: deno run --allow-read tests/asyncapi.ts
//
//   @asyncapi/specs ─▶ JSON Schema of such documents ─▶ ajv ─▶ status 1 and what is wrong, if it is none
import Ajv from "ajv";
import addFormats from "ajv-formats";
import spec from "@asyncapi/specs/schemas/3.0.0.json" with { type: "json" };

const document = JSON.parse(Deno.readTextFileSync(new URL("../docs/schemas/asyncapi.json", import.meta.url)));
// The schema has that of JSON Schema draft 07 in it.
const ajv = new Ajv.default({ allErrors: true, strict: false, meta: false, validateSchema: false });
addFormats.default(ajv);
const validate = ajv.compile(spec);
if (!validate(document)) {
  console.error("docs/schemas/asyncapi.json is no AsyncAPI document:", validate.errors?.slice(0, 10));
  Deno.exit(1);
}
