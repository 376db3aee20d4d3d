// SPDX-License-Identifier: Apache-2.0
'use strict';

// The check sum of CANopen's block transfers, bit by bit: 16 bits, nothing reflected. [CiA 301]
function crc(bits, reflected, polynomial, initialLow, initialHigh, xorLow, xorHigh, reflectedOut, data) {
  if (bits !== 16 || reflected || initialLow || initialHigh || xorLow || xorHigh || reflectedOut)
    throw new RangeError('only the check sum of CANopen is computed here');
  let sum = 0;
  for (const byte of data) {
    sum ^= byte << 8;
    for (let bit = 0; bit < 8; ++bit) sum = ((sum << 1) ^ (sum & 0x8000 ? polynomial : 0)) & 0xffff;
  }
  return Buffer.from([sum >> 8, sum & 0xff]);
}

module.exports = { crc };
