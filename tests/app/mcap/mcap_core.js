// SPDX-License-Identifier: Apache-2.0
'use strict';

// Reads an MCAP file with the npm package @mcap/core, all checksums included.
//
// usage: node mcap_core.js index FILE         a line of JSON on the file, then one a message, by its index
//        node mcap_core.js cut FILE SIZE...   for each size how many messages a file cut there has, as a list

const fs = require('fs');
const { McapIndexedReader, McapStreamReader } = require('@mcap/core');
const fzstd = require('fzstd');

const decompressHandlers = { zstd: (bytes, size) => fzstd.decompress(bytes, new Uint8Array(Number(size))) };

class Readable {
  constructor(bytes) { this.bytes = bytes; }
  async size() { return BigInt(this.bytes.length); }
  async read(offset, size) { return this.bytes.subarray(Number(offset), Number(offset + size)); }
}

const plain = (key, value) => (typeof value === 'bigint' ? value.toString() : value instanceof Map ? [...value] : value);
const tell = (value) => process.stdout.write(`${JSON.stringify(value, plain)}\n`);

async function index(bytes) {
  const reader = await McapIndexedReader.Initialize({ readable: new Readable(bytes), decompressHandlers });
  const metadata = [];
  for await (const { name, metadata: table } of reader.readMetadata()) metadata.push([name, [...table]]);
  const schemas = [...reader.schemasById.values()].map(({ id, name, encoding, data }) => ({
    id, name, encoding, data: Buffer.from(data).toString(),
  }));
  const channels = [...reader.channelsById.values()];
  tell({ header: reader.header, statistics: reader.statistics, schemas, channels, metadata, chunks: reader.chunkIndexes,
         dataSectionCrc: reader.dataSectionCrc, dataEndOffset: reader.dataEndOffset });
  for await (const message of reader.readMessages()) {
    const { channelId, sequence, logTime, publishTime, data } = message;
    tell({ channelId, sequence, logTime, publishTime, data: Buffer.from(data).toString() });
  }
}

function messagesIn(bytes) {
  const reader = new McapStreamReader({ decompressHandlers });
  let messages = 0;
  reader.append(bytes);
  for (let record; (record = reader.nextRecord());) messages += record.type === 'Message';
  return messages;
}

const [what, file, ...sizes] = process.argv.slice(2);
const bytes = new Uint8Array(fs.readFileSync(file));
if (what === 'index') index(bytes);
else tell(sizes.map((size) => messagesIn(bytes.slice(0, Number(size)))));
