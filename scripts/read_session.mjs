// Reads a session without palpate: the JavaScript example of docs/format.md, and a reader of scripts/other-readers.
//
// Usage: node read_session.mjs SESSION      (needs `npm install @mcap/core fzstd` in the same folder)
import { existsSync, readFileSync, readdirSync, statSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { decompress } from "fzstd";

const decompressHandlers = { zstd: (data, size) => decompress(data, new Uint8Array(Number(size))) };
const RECORD_VERSION = 4; // The newest that is known here.
const PHASES = ("idle self-test home tare contact rest ramp hold retract stopped ended jog unload creep sine prompt weigh " +
  "check-home paused imported follow").split(" ");

/** The whole numbers of a packed array, 64 bits each: seven bits a byte, lowest first, 128 where more follow. */
function numbers(data) {
  const values = [];
  for (let at = 0; at < data.length; ) {
    let low = data[at++];
    if (low < 128) {
      values.push(BigInt(low));
      continue;
    }
    let value = BigInt(low & 127);
    for (let shift = 7n, byte = 128; byte >= 128; shift += 7n) {
      byte = data[at++];
      value |= BigInt(byte & 127) << shift;
    }
    values.push(value);
  }
  return values;
}

/** A Protocol Buffers message as an object from field number to whole number, eight bytes or packed array. */
export function fields(data) {
  const found = {};
  let at = 0;
  const varint = () => {
    const start = at;
    while (data[at++] >= 128);
    return Number(numbers(data.subarray(start, at))[0]);
  };
  while (at < data.length) {
    const key = varint();
    const kind = key & 7;
    const length = kind === 1 ? 8 : varint();
    found[key >>> 3] = kind === 0 ? length : data.subarray(at, at + length);
    if (kind !== 0) at += length;
  }
  return found;
}

const signed = (data) => numbers(data).map((value) => (value >> 1n) ^ -(value & 1n));

/** Values of which the differences are stored, the first from 0. */
function summed(data, asType) {
  let value = 0n;
  return signed(data).map((difference) => (value = asType(64, value + difference)));
}

/** The pieces of a message of /raw: session time in ns (BigInt), device, whether the computer sent it, bytes. */
export function pieces(message) {
  const block = fields(message);
  const isSent = numbers(block[4]);
  const lengths = numbers(block[5]).map(Number);
  let at = 0;
  return summed(block[3], BigInt.asUintN).map((time, i) => {
    const bytes = block[6].subarray(at, (at += lengths[i]));
    return { time, device: new TextDecoder().decode(block[2]), isSent: isSent[i] !== 0n, bytes };
  });
}

export function doubles(data) {
  const view = new DataView(data.buffer, data.byteOffset, data.length);
  return Array.from({ length: data.length / 8 }, (_, i) => view.getFloat64(8 * i, true));
}

/** The columns of a pair of blocks. A value that is not known is null; 64-bit numbers are BigInt. */
function samples(rawBytes, derivedBytes) {
  const raw = fields(rawBytes);
  const derived = fields(derivedBytes);
  const tick = summed(raw[2], BigInt.asUintN);
  const absent = tick.map(() => null);
  const small = (data) => numbers(data).map(Number);
  const validity = small(derived[4]);
  const known = (data, bit) => doubles(data).map((x, i) => (validity[i] & bit ? x : null));
  return {
    tick,
    host_ns: summed(raw[3], BigInt.asUintN),
    counts: raw[4] ? signed(raw[4]).map(Number) : absent,
    signal_V: raw[5] ? doubles(raw[5]) : absent,
    pulses: raw[6] ? summed(raw[6], BigInt.asIntN) : absent,
    status: small(raw[7]),
    force_N: known(derived[2], 1),
    depth_mm: known(derived[3], 2),
    phase: small(derived[5]).map((code) => PHASES[code]),
    cycle: small(derived[6]),
  };
}

/**
 * [topic, sequence, bytes] of every message up to where the file ends or is cut. Nothing of a damaged chunk is used;
 * `notes` gets a sentence for each.
 */
export function streamed(path, notes = []) {
  const bytes = readFileSync(path);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  const topics = new Map();
  const found = [];
  const CHUNK = 6;
  const beginning = []; // Where the channels are, for a reader that goes on behind damage.
  let reader;
  const records = (piece) => {
    const read = [];
    reader.append(piece);
    for (let record; (record = reader.nextRecord()); ) read.push(record);
    return read;
  };
  const restart = () => {
    reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
    beginning.forEach(records);
  };
  restart();
  // The magic of eight bytes, then records: opcode, length of eight bytes, body.
  for (let at = 0, end = Math.min(8, bytes.length); at < end; ) {
    const piece = bytes.subarray(at, end);
    const isChunk = at > 0 && piece[0] === CHUNK;
    try {
      const read = records(piece);
      if (at === 0 || read.some((record) => record.type === "Channel")) beginning.push(piece);
      for (const record of read) {
        if (record.type === "Channel") topics.set(record.id, record.topic);
        if (record.type === "Message") found.push([topics.get(record.channelId), record.sequence, record.data]);
      }
    } catch (error) {
      if (!isChunk) throw error;
      notes.push(`${path}: a chunk is damaged (${error.message}) and nothing of it is used`);
      restart();
    }
    at = end;
    // What is left where the file is cut, and the magic at its end, is no record.
    end = at + 9 <= bytes.length && bytes[at] !== 0 ? at + 9 + Number(view.getBigUint64(at + 1, true)) : at;
    if (end > bytes.length) break;
  }
  return found;
}

/** The same of a finished file through its index, in the order of time. */
export async function indexed(path) {
  const bytes = readFileSync(path);
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const found = [];
  for await (const message of reader.readMessages()) {
    found.push([reader.channelsById.get(message.channelId).topic, message.sequence, message.data]);
  }
  return found;
}

/** The files of a log in order. Those that its disk could not take are in the folder that the file `spare` names. */
export function segments(session) {
  if (!statSync(session).isDirectory()) return [session];
  const spare = join(session, "spare");
  const folders = existsSync(spare) ? [readFileSync(spare, "utf8")] : [];
  const found = new Map();
  // Where both have a number, that of the session's own folder is it.
  for (const folder of [...folders.filter((folder) => existsSync(folder)), session]) {
    for (const name of readdirSync(folder)) if (/^\d+\.mcap$/.test(name)) found.set(parseInt(name), join(folder, name));
  }
  return [...found.keys()].sort((a, b) => a - b).map((number) => found.get(number));
}

/** The columns of all samples, of every other topic its messages' bytes, and in `notes` what is damaged or missing. */
export function read(session) {
  const notes = [];
  const messages = segments(session).flatMap((file) => streamed(file, notes));
  return assembled(messages, notes);
}

export function assembled(messages, notes = []) {
  const columns = {};
  const others = {};
  const following = {};
  let raw;
  for (const [topic, sequence, data] of messages) {
    const expected = following[topic] ?? 0;
    if (sequence < expected) continue; // It was written again after the disk had failed.
    if (sequence > expected) notes.push(`${sequence - expected} messages of ${topic} are missing, from number ${expected}`);
    following[topic] = sequence + 1;
    if (topic === "/manifest") {
      const { record_version: version } = JSON.parse(new TextDecoder().decode(data));
      if (version > RECORD_VERSION) {
        throw new Error(`record_version ${version} is newer than ${RECORD_VERSION}, the newest that this program reads`);
      }
    }
    if (topic === "/daq/block") raw = data;
    else if (topic === "/derived/block") {
      // Without the block that it was made of it is nothing.
      if (!raw || fields(raw)[1] !== fields(data)[1]) continue;
      for (const [name, values] of Object.entries(samples(raw, data))) (columns[name] ??= []).push(values);
    } else (others[topic] ??= []).push(data);
  }
  for (const name in columns) columns[name] = columns[name].flat();
  if (columns.tick) {
    // Seconds since the first sample. In an imported session, which has no rig, a tick is a picosecond.
    const { rig } = JSON.parse(new TextDecoder().decode(others["/manifest"][0]));
    const ticks = columns.tick.map((tick) => Number(BigInt.asIntN(64, tick - columns.tick[0])));
    columns.t_s = ticks.map((n) => (rig ? n * (rig.tick_nanos * 1e-9) : n / 1e12));
  }
  return { columns, others, notes };
}

if (import.meta.url === pathToFileURL(process.argv[1]).href) {
  const { columns, others, notes } = read(process.argv[2]);
  for (const [name, values] of Object.entries(columns)) {
    console.log(`${name}: ${values.length} samples, first ${values[0]}, last ${values.at(-1)}`);
  }
  for (const [topic, found] of Object.entries(others)) console.log(`${topic}: ${found.length} messages`);
  if (!others["/end"]) console.log("no /end: the recording was interrupted, or its last file is missing");
  notes.forEach((note) => console.error(note));
}
