// The JavaScript part of scripts/other-readers. read_session.mjs and node_modules are beside this file where it runs.
//
// Usage: node compare.mjs FOLDER SESSION CUT...
// Writes every column of SESSION to FOLDER/NAME.values, 64 bits a value (phases as JSON), and to FOLDER/NAME.known, a byte
// a value, and of raw bytes to FOLDER/raw.pieces. Prints one object: how many messages each topic of the session and of each cut has, and what differs.
import { readdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { indexed, pieces, read, streamed } from "./read_session.mjs";

const [folder, session, ...cuts] = process.argv.slice(2);
const files = readdirSync(session).filter((name) => /^\d+\.mcap$/.test(name)).sort();
const differences = [];

function counted(messages) {
  const counts = {};
  for (const [topic] of messages) counts[topic] = (counts[topic] ?? 0) + 1;
  return counts;
}

function byTopic(messages) {
  const found = {};
  for (const [topic, sequence, data] of messages) (found[topic] ??= []).push([sequence, Buffer.from(data)]);
  return found;
}

/** Says so where messages are not those that the whole ones begin with, topic by topic. */
function compare(what, messages, whole) {
  for (const [topic, found] of Object.entries(byTopic(messages))) {
    const odd = found.findIndex(([sequence, data], i) => {
      const theirs = whole[topic]?.[i];
      return !theirs || theirs[0] !== sequence || !theirs[1].equals(data);
    });
    if (odd >= 0) differences.push(`${what}: message ${odd} of ${topic} is not that of the whole file`);
  }
}

const { columns, others } = read(session);
for (const [name, values] of Object.entries(columns)) {
  const bits = new DataView(new ArrayBuffer(8 * values.length));
  values.forEach((value, i) => {
    if (typeof value === "bigint") bits.setBigInt64(8 * i, BigInt.asIntN(64, value), true);
    else if (typeof value === "number") bits.setFloat64(8 * i, value, true);
  });
  const isText = typeof values[0] === "string";
  writeFileSync(join(folder, `${name}.values`), isText ? JSON.stringify(values) : bits);
  writeFileSync(join(folder, `${name}.known`), Uint8Array.from(values, (value) => (value === null ? 0 : 1)));
}
for (const [topic, found] of Object.entries(others)) {
  writeFileSync(join(folder, `${topic.replaceAll("/", "_")}.messages`), Buffer.concat(found.flatMap((one) => [one, Buffer.from("\n")])));
}

// Raw bytes unpacked, a piece a line.
const raw = (others["/raw"] ?? []).flatMap(pieces);
const lines = raw.map((one) => `${one.time} ${one.device} ${one.isSent} ${Buffer.from(one.bytes).toString("hex")}\n`);
writeFileSync(join(folder, "raw.pieces"), lines.join(""));

// A finished file through its index. Only messages with the same time may come in another order.
const last = join(session, files.at(-1));
const whole = streamed(last);
const throughIndex = await indexed(last);
compare(`the index of ${last}`, throughIndex, byTopic(whole));
if (throughIndex.length !== whole.length) {
  differences.push(`${last}: ${throughIndex.length} messages through the index, ${whole.length} in the stream`);
}
const beginning = byTopic(streamed(join(session, files[0])));
const cutCounts = cuts.map((cut) => {
  const messages = streamed(join(cut, files[0]));
  compare(cut, messages, beginning);
  return counted(messages);
});
console.log(JSON.stringify({ counts: counted(whole), cuts: cutCounts, differences }));
