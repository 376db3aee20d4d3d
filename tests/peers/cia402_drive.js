// SPDX-License-Identifier: Apache-2.0
'use strict';

// Servo drives of CiA 402 on the npm package canopen, which knows nothing of Tendril: its object dictionary, SDO
// server, PDOs, NMT and heartbeats; the power states and the motion are written here from the standard.
//
// usage: node cia402_drive.js EDS NODE [EDS NODE...]
//
// Frames go in and out as lines "ID#DATA", both hexadecimal; a line "fault NODE CODE" in makes a drive fail with
// that EMCY code. What happens is told on standard error. Ends with standard input.

const readline = require('readline');
const { Device } = require('canopen');

const ERROR_REGISTER = 0x1001, CONTROLWORD = 0x6040, STATUSWORD = 0x6041, MODE = 0x6060, MODE_DISPLAY = 0x6061;
const ACTUAL_POSITION = 0x6064, TARGET_POSITION = 0x607a;
const CYCLIC_SYNCHRONOUS_POSITION = 8, MASTER_LOST = 0x8130;
const INITIALISING = 0, PRE_OPERATIONAL = 0x7f;

const STATUS = {
  'switch on disabled': 0x0250,
  'ready to switch on': 0x0231,
  'switched on': 0x0233,
  'operation enabled': 0x1237,
  'quick stop active': 0x0217,
  fault: 0x0218,
};

// Commands by controlword: mask, value, and where they lead from where.
const COMMANDS = [
  [0x87, 0x06, { 'switch on disabled': 'ready to switch on', 'switched on': 'ready to switch on',
                 'operation enabled': 'ready to switch on' }],
  [0x8f, 0x07, { 'ready to switch on': 'switched on', 'operation enabled': 'switched on' }],
  [0x8f, 0x0f, { 'switched on': 'operation enabled', 'quick stop active': 'operation enabled' }],
  [0x86, 0x02, { 'ready to switch on': 'switch on disabled', 'switched on': 'switch on disabled',
                 'operation enabled': 'quick stop active' }],
  [0x82, 0x00, { 'ready to switch on': 'switch on disabled', 'switched on': 'switch on disabled',
                 'operation enabled': 'switch on disabled', 'quick stop active': 'switch on disabled' }],
];

class Drive {
  constructor(eds, node) {
    this.node = node;
    this.device = new Device({ eds, id: node });
    this.state = 'switch on disabled';
    this.resetBit = 0;
    this.nmt = INITIALISING;
    this.device.eds.addSdoServerParameter(0, 0x580 + node, 0x600 + node);
    this.device.eds.getEntry(MODE).addListener('update', (mode) => this.device.setValue(MODE_DISPLAY, mode.value));
    this.device.on('message', ({ id, data }) => say(id, data));
    this.device.sync.on('sync', () => this.work());
    this.device.nmt.on('timeout', () => this.fail(MASTER_LOST));
    this.device.nmt.on('changeState', (state) => this.announce(state));
    this.enter(this.state);
    this.device.start();
  }

  // The package has no boot-up message, and a reset of communication clears the profile's objects too.
  announce(state) {
    if (state === PRE_OPERATIONAL && this.nmt === INITIALISING) {
      this.device.setValue(STATUSWORD, STATUS[this.state]);
      say(0x700 + this.node, Buffer.from([0]));
    }
    this.nmt = state;
    this.tell(`NMT ${state.toString(16)}`);
  }

  tell(what) {
    process.stderr.write(`node ${this.node}: ${what}\n`);
  }

  enter(state) {
    this.state = state;
    this.device.setValue(STATUSWORD, STATUS[state]);
    this.tell(state);
  }

  fail(code) {
    this.enter('fault');
    this.device.setValue(ERROR_REGISTER, 1);
    this.device.emcy.write(code);
  }

  // One SYNC: the state that the controlword leads to, and in operation the way to the target.
  work() {
    const word = this.device.getValue(CONTROLWORD);
    const rising = word & 0x80 && !this.resetBit;
    this.resetBit = word & 0x80;
    if (this.state === 'fault') {
      if (rising) this.enter('switch on disabled');
      return;
    }
    const [, , leads] = COMMANDS.find(([mask, value]) => (word & mask) === value) || [0, 0, {}];
    if (leads[this.state]) this.enter(leads[this.state]);
    if (this.state !== 'operation enabled' || this.device.getValue(MODE) !== CYCLIC_SYNCHRONOUS_POSITION) return;
    this.device.setValue(ACTUAL_POSITION, this.device.getValue(TARGET_POSITION));
  }
}

function say(id, data) {
  process.stdout.write(`${id.toString(16)}#${data.toString('hex')}\n`);
}

const drives = new Map();
for (let i = 2; i < process.argv.length; i += 2) {
  const node = Number(process.argv[i + 1]);
  drives.set(node, new Drive(process.argv[i], node));
}

const lines = readline.createInterface({ input: process.stdin });
lines.on('line', (line) => {
  const order = line.match(/^fault (\d+) 0x([0-9a-f]+)$/i);
  if (order) {
    drives.get(Number(order[1])).fail(parseInt(order[2], 16));
    return;
  }
  const [id, data] = line.split('#');
  for (const drive of drives.values()) drive.device.receive({ id: parseInt(id, 16), data: Buffer.from(data, 'hex') });
});
lines.on('close', () => process.exit(0));
