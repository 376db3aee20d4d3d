// SPDX-License-Identifier: Apache-2.0
'use strict';

// An SDO client on the npm package canopen: reads every entry of a data sheet from a node, tries block transfers, and
// writes an entry.
//
// usage: node sdo_client.js EDS NODE
//
// Frames go in and out as lines "ID#DATA". Each answer is a line on standard error, "read INDEX SUB DATA" or
// "aborted WHAT CODE"; the last line is "done".

const readline = require('readline');
const { Device, Eds } = require('canopen');

const PATIENCE_MS = 30000 * Number(process.env.TENDRIL_PATIENCE || 1), TARGET_POSITION = 0x607a, ERROR_WINDOW = 0x6065;

const [eds, node] = [process.argv[2], Number(process.argv[3])];
const device = new Device({ id: 126 });
device.eds.addSdoClientParameter(node, 0x600 + node, 0x580 + node);
device.on('message', ({ id, data }) => process.stdout.write(`${id.toString(16)}#${data.toString('hex')}\n`));
device.start();

readline.createInterface({ input: process.stdin }).on('line', (line) => {
  const [id, data] = line.split('#');
  device.receive({ id: parseInt(id, 16), data: Buffer.from(data, 'hex') });
});

function tell(...words) {
  process.stderr.write(`${words.join(' ')}\n`);
}

async function attempt(what, transfer) {
  try {
    return await transfer;
  } catch (error) {
    tell('aborted', what, error.code.toString(16));
    return undefined;
  }
}

async function read(index, subIndex, more = {}) {
  const what = `${index.toString(16)} ${subIndex}`;
  const upload = { deviceId: node, index, subIndex, timeout: PATIENCE_MS, ...more };
  const data = await attempt(what, device.sdo.upload(upload));
  if (data) tell('read', what, data.toString('hex'));
}

async function write(index, data, more = {}) {
  const what = `${index.toString(16)} ${data.toString('hex')}`;
  await attempt(what, device.sdo.download({ deviceId: node, index, data, timeout: PATIENCE_MS, ...more }));
}

async function main() {
  for (const entry of Eds.fromFile(eds).values()) {
    const subs = entry.subNumber ? [...Array(256).keys()].filter((sub) => entry.at(sub)) : [0];
    for (const sub of subs) await read(entry.index, sub);
  }
  tell('block transfers');
  await read(TARGET_POSITION, 0, { blockTransfer: true });
  await write(TARGET_POSITION, Buffer.alloc(4), { blockTransfer: true });
  tell('a written entry');
  await write(ERROR_WINDOW, Buffer.from('d2040000', 'hex'));
  await read(ERROR_WINDOW, 0);
  tell('done');
}

main();
