// Reads MCAP files as Foxglove's own libraries do: node mcap_reader.mjs MODULES read FILE prints what is
// in one, as JSON; node mcap_reader.mjs MODULES schemas FOLDER prints the names of those .proto files
// in FOLDER that are not Foxglove's.

import { open, readdir, readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { plain, typeOf } from './protobuf.mjs';

const [modules, command, path] = process.argv.slice(2);
const require = createRequire(`${modules}/`);
const { McapIndexedReader, McapStreamReader } = require('@mcap/core');
const protobuf = require('protobufjs');
require('protobufjs/ext/descriptor');

class Readable {
  constructor(file, size) {
    Object.assign(this, { file, bytes: BigInt(size) });
  }

  async size() {
    return this.bytes;
  }

  async read(offset, length) {
    const buffer = new Uint8Array(Number(length));
    const { bytesRead } = await this.file.read(buffer, 0, buffer.length, Number(offset));
    if (bytesRead !== buffer.length) throw new Error(`${length} bytes at ${offset} are not there`);
    return buffer;
  }
}

/** By topic and schema: how many messages, and the first and the last one, decoded. */
async function channelsOf(reader) {
  const types = new Map([...reader.schemasById].map(([id, schema]) => [id, typeOf(protobuf, schema.name, schema.data)]));
  const channels = {};
  for await (const message of reader.readMessages()) {
    const { topic, schemaId, messageEncoding } = reader.channelsById.get(message.channelId);
    const content = plain(types.get(schemaId), message.data);
    const entry = { logTime: String(message.logTime), publishTime: String(message.publishTime), content };
    channels[topic] ??= { schema: reader.schemasById.get(schemaId).name, messageEncoding, messages: 0, first: entry };
    channels[topic].messages += 1;
    channels[topic].last = entry;
  }
  return channels;
}

/** How many messages are found from the file's start on, without its indexes. */
function countByStream(bytes) {
  const reader = new McapStreamReader({ validateCrcs: true });
  reader.append(bytes);
  let messages = 0;
  for (let record = reader.nextRecord(); record; record = reader.nextRecord()) {
    if (record.type === 'Message') messages += 1;
  }
  if (!reader.done()) throw new Error('the file does not end');
  return messages;
}

async function read() {
  const file = await open(path);
  const readable = new Readable(file, (await file.stat()).size);
  const reader = await McapIndexedReader.Initialize({ readable });  // Holds the summary to its check sum.
  const { header, statistics } = reader;
  return {
    header,
    statistics: { messages: Number(statistics.messageCount), chunks: statistics.chunkCount },
    dataEnd: { at: Number(reader.dataEndOffset), crc32: reader.dataSectionCrc },
    streamed: countByStream(await readFile(path)),
    channels: await channelsOf(reader),
  };
}

async function differingSchemas() {
  const { foxgloveEnumSchemas, foxgloveMessageSchemas, generateProto } = require('@foxglove/schemas/internal.js');
  const theirs = new Map(Object.values(foxgloveMessageSchemas).map((schema) => [`${schema.name}.proto`, generateProto(
    schema, Object.values(foxgloveEnumSchemas).filter((each) => each.parentSchemaName === schema.name))]));
  const meaning = (text) => {
    const { root, imports } = protobuf.parse(text, { keepCase: true });
    return JSON.stringify({ root, imports });
  };
  const names = (await readdir(path)).filter((name) => name.endsWith('.proto'));
  const differing = [];
  for (const name of names) {
    const ours = meaning(await readFile(`${path}/${name}`, 'utf8'));
    if (!theirs.has(name) || meaning(theirs.get(name)) !== ours) differing.push(name);
  }
  return { compared: names.length, differing };
}

console.log(JSON.stringify(await { read, schemas: differingSchemas }[command]()));
