#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The simulated ODrive axis, asked and commanded as the maker's documentation of CANSimple has it, on python3-can."""

import struct
import time
import unittest

import bench

try:
    import can
except ImportError:
    bench.skip("python3-can is not installed; tools/setup --tests installs it")

NODE = 1  # of the actuator "right"
VERSION, HEARTBEAT, ESTOP, ERROR, AXIS_STATE, ESTIMATES, INPUT_POSITION = 0x00, 0x01, 0x02, 0x03, 0x07, 0x09, 0x0C
IQ, TEMPERATURE, SUPPLY, CLEAR_ERRORS = 0x14, 0x15, 0x17, 0x18
IDLE, CLOSED_LOOP = 1, 8
ESTOP_REQUESTED = 0x02000000
SUCCESS, DISARMED = 0, 3


class OdriveClientTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.robot = cls.enterClassContext(bench.Bench(bench.finger("odrive")))
        cls.robot.start_plant()
        cls.bus = cls.enterClassContext(can.Bus(interface="socketcan", channel=bench.INTERFACE))

    def send(self, message, data=b"", **more):
        identifier = NODE << 5 | message
        self.bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False, **more))

    def hear(self, message, matches=lambda data: True):
        """The data of the next frame of that message that matches."""
        end = time.monotonic() + bench.PATIENCE_S
        while time.monotonic() < end:
            heard = self.bus.recv(0.1)
            if heard and heard.arbitration_id == NODE << 5 | message and matches(bytes(heard.data)):
                return bytes(heard.data)
        raise AssertionError(f"no frame of message {message:02X} came that fits")

    def ask(self, message):
        while self.bus.recv(0):
            pass
        self.send(message, is_remote_frame=True)
        return self.hear(message)

    def test_what_it_tells_it_tells_when_a_remote_frame_asks(self):
        protocol, *hardware_and_firmware = self.ask(VERSION)
        self.assertEqual((protocol, hardware_and_firmware[3:5]), (2, [0, 6]))
        self.assertEqual(struct.unpack("<II", self.ask(ERROR)), (0, 0))
        self.assertEqual(len(self.ask(ESTIMATES)), 8)
        self.assertEqual(struct.unpack("<ff", self.ask(IQ)), (0, 0))  # it is idle
        self.assertEqual(struct.unpack("<ff", self.ask(TEMPERATURE)), (25, 25))
        self.assertEqual(struct.unpack("<ff", self.ask(SUPPLY)), (24, 0))

    def test_it_goes_where_it_is_told_and_an_emergency_stop_ends_that(self):
        start, _ = struct.unpack("<ff", self.ask(ESTIMATES))
        self.send(INPUT_POSITION, struct.pack("<fhh", start, 0, 0))
        self.send(AXIS_STATE, struct.pack("<I", CLOSED_LOOP))
        closed = struct.pack("<IBBxx", 0, CLOSED_LOOP, SUCCESS)
        self.hear(HEARTBEAT, lambda data: data == closed)
        self.send(INPUT_POSITION, struct.pack("<fhh", start + 0.02, 0, 0))
        self.hear(ESTIMATES, lambda data: abs(struct.unpack("<ff", data)[0] - start - 0.02) < 0.001)
        self.send(ESTOP)
        stopped = struct.pack("<IBBxx", ESTOP_REQUESTED, IDLE, DISARMED)
        self.hear(HEARTBEAT, lambda data: data == stopped)
        self.assertEqual(struct.unpack("<II", self.ask(ERROR)), (ESTOP_REQUESTED, ESTOP_REQUESTED))
        self.send(CLEAR_ERRORS)
        self.hear(HEARTBEAT, lambda data: data[:5] == bytes([0, 0, 0, 0, IDLE]))


if __name__ == "__main__":
    bench.main()
