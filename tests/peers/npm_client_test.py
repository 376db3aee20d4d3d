#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The simulated CiA 402 drive and its data sheet, as an SDO client on the npm package canopen reads them."""

import configparser
import contextlib
import unittest

import bench
from canopen_master import Master
from npm_peer import NpmProgram, data_sheet

NODE = 2
VISIBLE_STRING = 0x0009
LIVE = ("6041", "6064", "6076")  # what they read is no default


class NpmClientTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with contextlib.ExitStack() as stack:
            robot = stack.enter_context(bench.Bench(bench.finger()))
            robot.start_plant()
            master = Master(NODE)
            stack.callback(master.close)
            master.restart()
            eds = robot.folder / "drive.eds"
            eds.write_text(data_sheet(NODE))
            cls.sheet = configparser.ConfigParser()
            cls.sheet.read(eds)
            client = stack.enter_context(NpmProgram("sdo_client.js", [eds, NODE], robot.folder / "client.log"))
            client.wait_for("done\n")
            cls.said = client.said()

    def part(self, begin, end):
        return self.said.partition(begin)[2].partition(end)[0].split("\n")[1:-1]

    def default(self, section, size):
        entry = self.sheet[section]
        if int(entry["DataType"], 0) == VISIBLE_STRING:
            return entry["DefaultValue"].encode()
        return (int(entry["DefaultValue"], 0) % 256**size).to_bytes(size, "little")

    def test_every_entry_of_the_data_sheet_reads_as_its_default(self):
        found = {}
        for line in self.said.partition("block transfers")[0].splitlines():
            verb, index, sub, data = line.split()
            self.assertEqual(verb, "read", line)
            found[index.upper(), int(sub)] = bytes.fromhex(data)
        for section in self.sheet.sections():
            if "DefaultValue" not in self.sheet[section]:
                continue
            index, _, sub = section.partition("sub")
            data = found.pop((index, int(sub or "0", 16)))
            if index not in LIVE:
                self.assertEqual(data, self.default(section, len(data)), section)
        self.assertEqual(found, {})

    def test_block_transfers_are_refused_with_the_code_for_an_unknown_command(self):
        self.assertEqual(
            self.part("block transfers", "a written entry"), ["aborted 607a 0 5040001", "aborted 607a 00000000 5040001"]
        )

    def test_what_is_written_is_read_back(self):
        self.assertEqual(self.part("a written entry", "done"), ["read 6065 0 d2040000"])


if __name__ == "__main__":
    bench.main()
