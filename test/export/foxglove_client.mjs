// Foxglove's own client: node foxglove_client.mjs MODULES URL SUBPROTOCOL SECONDS subscribes to every channel
// of a server, listens that long, and prints what it heard, as JSON.

import { createRequire } from 'node:module';
import { plain, typeOf } from './protobuf.mjs';

const [modules, url, subprotocol, seconds] = process.argv.slice(2);
const require = createRequire(`${modules}/`);
const { FoxgloveClient } = require('@foxglove/ws-protocol');
const { WebSocket } = require('ws');
const protobuf = require('protobufjs');
require('protobufjs/ext/descriptor');

const heard = { statuses: [], errors: [], unadvertised: [], times: [], channels: {} };
const subscriptions = new Map();  // By the client's id: entry of heard.channels, type.

const socket = new WebSocket(url, [subprotocol]);
const client = new FoxgloveClient({ ws: socket });
client.on('serverInfo', (info) => {
  Object.assign(heard, { serverInfo: info, subprotocol: socket.protocol });
});
client.on('status', (status) => heard.statuses.push(status));
client.on('error', (error) => heard.errors.push(String(error)));
client.on('unadvertise', (ids) => heard.unadvertised.push(...ids));
client.on('time', ({ timestamp }) => heard.times.push(Number(timestamp)));
client.on('advertise', (channels) => {
  for (const { id, topic, encoding, schemaName, schema } of channels) {
    const type = typeOf(protobuf, schemaName, Buffer.from(schema, 'base64'));
    heard.channels[topic] = { encoding, schema: schemaName, messages: 0, contents: [] };
    subscriptions.set(client.subscribe(id), { entry: heard.channels[topic], type });
  }
});
client.on('message', ({ subscriptionId, timestamp, data }) => {
  const { entry, type } = subscriptions.get(subscriptionId);
  entry.messages += 1;
  entry.logTime = String(timestamp);
  const content = plain(type, new Uint8Array(data.buffer, data.byteOffset, data.byteLength));
  if (entry.schema.startsWith('foxglove.') && entry.messages <= 100) entry.contents.push(content);
});
client.on('close', () => heard.errors.push('closed'));

setTimeout(() => process.stdout.write(JSON.stringify(heard), () => process.exit()), 1000 * Number(seconds));
