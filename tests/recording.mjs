#!/usr/bin/env node
// Reads the recording of a run with the MCAP reader of npm, as viewers in a browser do: channels,
// schemas, and each message, which must have the fields that its schema requires. Messages of
// Foxglove's types are checked against Foxglove's own schemas, and have no field beside them.
//
//     tests/recording.mjs RUN      RUN is a directory with run.mcap, or the file
//
// Installs the reader below target/, at the versions that stand here. It is no part of
// `cargo test`. Exit code 1 if something is not as it should be.

import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, statSync } from "node:fs";
import { open } from "node:fs/promises";
import { createRequire } from "node:module";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

const PACKAGES = { "@mcap/core": "2.2.2", "@mcap/nodejs": "1.0.2", "@mcap/support": "1.1.0", "@foxglove/schemas": "2.1.0", ajv: "8.20.0" };
const WANTED = ["/skein/scene", "/skein/frame", "/skein/event", "/skein/end", "/map/site", "/map/cells", "/tf", "/drawn/site", "/drawn/uavs", "/log"];

const root = resolve(dirname(fileURLToPath(import.meta.url)), "..");
const home = join(root, "target", "recording-node");

function install() {
  if (!Object.keys(PACKAGES).every((name) => existsSync(join(home, "node_modules", name)))) {
    mkdirSync(home, { recursive: true });
    const named = Object.entries(PACKAGES).map(([name, version]) => `${name}@${version}`);
    execFileSync("npm", ["install", "--silent", "--no-fund", "--no-audit", "--prefix", home, ...named], { stdio: "inherit" });
  }
  const from = createRequire(join(home, "package.json"));
  return (name) => import(pathToFileURL(from.resolve(name)));
}

function fail(why) {
  console.error(`error: ${why}`);
  process.exit(1);
}

const [given] = process.argv.slice(2);
if (!given || !existsSync(given)) fail("usage: tests/recording.mjs RUN (a directory with run.mcap, or the file)");
const path = statSync(given).isDirectory() ? join(given, "run.mcap") : given;

const load = install();
const { McapIndexedReader } = await load("@mcap/core");
const { FileHandleReadable } = await load("@mcap/nodejs");
const { loadDecompressHandlers } = await load("@mcap/support");
const foxglove = (await load("@foxglove/schemas/jsonschema")).default;
const { default: Ajv } = await load("ajv");

const ajv = new Ajv({ strict: false, validateFormats: false });
const theirs = new Map();
for (const type of ["LocationFix", "GeoJSON", "Log", "FrameTransforms", "SceneUpdate"]) {
  theirs.set(`foxglove.${type}`, { known: foxglove[type].properties, valid: ajv.compile(foxglove[type]) });
}

const file = await open(path, "r");
const reader = await McapIndexedReader.Initialize({
  readable: new FileHandleReadable(file),
  decompressHandlers: await loadDecompressHandlers(),
});

// What viewers make of a schema: a field is of one plain type, an object, or a list of those.
// A channel that has another field is dropped by them.
const PLAIN = ["boolean", "string", "number", "integer"];
function understood(schema, where) {
  for (const [name, field] of Object.entries(schema.properties ?? {})) {
    const here = `${where}.${name}`;
    const one = field.type === "array" ? field.items ?? {} : field;
    if (field.oneOf || one.oneOf) fail(`schema ${here}: alternatives`);
    if (one.type === "object") understood(one, here);
    else if (!PLAIN.includes(one.type)) fail(`schema ${here}: viewers know no ${JSON.stringify(one.type)} there`);
  }
}

const schemas = new Map();
for (const [id, schema] of reader.schemasById) {
  if (schema.encoding !== "jsonschema") fail(`schema ${schema.name}: encoding ${schema.encoding}`);
  const told = JSON.parse(new TextDecoder().decode(schema.data));
  if (told.type !== "object" || told.oneOf) fail(`schema ${schema.name}: no plain object`);
  understood(told, schema.name);
  schemas.set(id, { name: schema.name, valid: ajv.compile(told), required: told.required });
}
const counts = new Map();
let last = 0n;
let checked = 0;
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  const schema = schemas.get(channel.schemaId);
  if (!schema) fail(`${channel.topic}: no schema`);
  if (message.logTime < last) fail(`${channel.topic}: ${message.logTime} comes after ${last}`);
  last = message.logTime;
  const value = JSON.parse(new TextDecoder().decode(message.data));
  const missing = (schema.required ?? []).filter((field) => !(field in value));
  if (missing.length) fail(`${channel.topic}: ${schema.name} lacks ${missing.join(", ")}`);
  const type = theirs.get(schema.name);
  if (!schema.valid(value)) fail(`${channel.topic}: ${ajv.errorsText(schema.valid.errors)}`);
  if (!type && schema.name.startsWith("foxglove.")) fail(`${channel.topic}: nobody checks ${schema.name}`);
  if (type) {
    const strange = Object.keys(value).filter((field) => !(field in type.known));
    if (strange.length) fail(`${channel.topic}: ${schema.name} has no ${strange.join(", ")}`);
    if (!type.valid(value)) fail(`${channel.topic}: ${ajv.errorsText(type.valid.errors)}`);
    checked += 1;
  }
  counts.set(channel.topic, (counts.get(channel.topic) ?? 0) + 1);
}
await file.close();
for (const topic of WANTED) if (!counts.get(topic)) fail(`nothing under ${topic}`);
const places = [...counts.keys()].filter((topic) => /^\/uav\/\d+\/location$/.test(topic));
if (!places.length) fail("no place of any UAV");
const all = [...counts.values()].reduce((sum, n) => sum + n, 0);
console.log(`recording: ok, ${all} messages in ${counts.size} channels, ${places.length} UAVs, ${checked} messages as Foxglove defines them, ${Number(last) / 1e9} s`);
