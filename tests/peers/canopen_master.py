# SPDX-License-Identifier: Apache-2.0
"""A CANopen master for one CiA 402 drive on python3-can, written from the standards alone."""

import struct
import time

import bench
import cia402

try:
    import can
except ImportError:
    bench.skip("python3-can is not installed; tools/setup --tests installs it")

WRITE = {1: 0x2F, 2: 0x2B, 4: 0x23}  # command of an expedited download by the size of its data
READ, ABORT = 0x40, 0x80


class Abort(Exception):
    """The server ended a transfer with this code."""

    def __init__(self, code):
        super().__init__(f"SDO abort {code:08X}")
        self.code = code


class Master:
    """What is heard of a drive is kept in `frames`, pairs of identifier and data, until it is asked for."""

    def __init__(self, node):
        self.node = node
        self.frames = []
        ids = (0x080, 0x180, 0x580, 0x700)
        self.bus = can.Bus(
            interface="socketcan",
            channel=bench.INTERFACE,
            can_filters=[{"can_id": base + node, "can_mask": 0x7FF, "extended": False} for base in ids],
        )

    def close(self):
        self.bus.shutdown()

    def send(self, identifier, data=b"", **more):
        self.bus.send(can.Message(arbitration_id=identifier, data=data, **{"is_extended_id": False, **more}))

    def take(self, base, matches=lambda data: True):
        """The data of the first frame with that identifier that matches, which need not have come yet."""
        end = time.monotonic() + bench.PATIENCE_S
        while time.monotonic() < end:
            for i, (identifier, data) in enumerate(self.frames):
                if identifier == base + self.node and matches(data):
                    del self.frames[i]
                    return data
            message = self.bus.recv(0.1)
            if message is not None and not message.is_remote_frame:  # those are others' questions
                self.frames.append((message.arbitration_id, bytes(message.data)))
        last = [f"{identifier:03X}#{data.hex()}" for identifier, data in self.frames[-5:]]
        raise AssertionError(f"no frame {base + self.node:03X} came that fits; the last of others: {last}")

    def forget(self):
        """Drops what has been heard, all that the drive has sent so far included."""
        self.read(0x1001)
        self.frames.clear()

    def heard(self, base):
        """Whether a frame with that identifier was heard among all that the drive has sent so far."""
        self.read(0x1001)
        return any(identifier == base + self.node for identifier, _ in self.frames)

    def sdo(self, request):
        """The answer to the eight bytes of a request. Raises Abort."""
        self.send(0x600 + self.node, request)
        answer = self.take(0x580)
        assert len(answer) == 8, answer
        if answer[0] == ABORT:
            raise Abort(struct.unpack("<I", answer[4:])[0])
        return answer

    def write(self, index, sub, size, value):
        command = struct.pack("<BHBI", WRITE[size], index, sub, value & 0xFFFFFFFF)
        answer = self.sdo(command)
        assert answer == struct.pack("<BHBI", 0x60, index, sub, 0), answer

    def read(self, index, sub=0):
        """The bytes of an entry, however many: those above four come in segments."""
        answer = self.sdo(struct.pack("<BHBI", READ, index, sub, 0))
        assert answer[1:4] == struct.pack("<HB", index, sub), answer
        if answer[0] & 0x02:
            return answer[4 : 8 - (answer[0] >> 2 & 3)]
        data, toggle = b"", 0
        while True:
            answer = self.sdo(bytes([0x60 | toggle, 0, 0, 0, 0, 0, 0, 0]))
            assert answer[0] & 0xF0 == toggle, answer
            data += answer[1 : 8 - (answer[0] >> 1 & 7)]
            if answer[0] & 0x01:
                return data
            toggle ^= 0x10

    def read_number(self, index, sub=0):
        return int.from_bytes(self.read(index, sub), "little")

    def nmt(self, command, node=None):
        self.send(cia402.NMT, [command, self.node if node is None else node])

    def heartbeat_of(self, state):
        self.take(0x700, lambda data: data == bytes([state]))

    def restart(self):
        """Makes the drive as it is at power-on, but for where it stands."""
        self.frames.clear()
        self.nmt(cia402.RESET_NODE)
        self.heartbeat_of(cia402.BOOT_UP)
        self.frames.clear()

    def set_up(self, receive_type=1, target=0x607A0020, mode=8):
        """PDOs and mode as a CSP master wants them; the COB-IDs also say, in bit 30, that no remote frame is sent."""
        for communication, mapping, cob_id, first, second, kind in (
            (0x1400, 0x1600, 0x200 + self.node, 0x60400010, target, receive_type),
            (0x1800, 0x1A00, 0x180 + self.node, 0x60410010, 0x60640020, 1),
        ):
            self.write(communication, 1, 4, 0xC0000000 | cob_id)
            self.write(mapping, 0, 1, 0)
            self.write(mapping, 1, 4, first)
            self.write(mapping, 2, 4, second)
            self.write(mapping, 0, 1, 2)
            self.write(communication, 2, 1, kind)
            self.write(communication, 1, 4, 0x40000000 | cob_id)
        self.write(0x6060, 0, 1, mode)
        self.write(0x60C2, 1, 1, 10)
        self.write(0x60C2, 2, 1, -3)

    def start(self):
        self.nmt(cia402.START)
        self.write(0x1017, 0, 2, 20)
        self.heartbeat_of(cia402.OPERATIONAL)

    def target(self, controlword, position):
        self.send(0x200 + self.node, struct.pack("<Hi", controlword, position))

    def push(self, controlword, thousandths):
        """State and position after a target torque, where the RPDO has one."""
        self.send(0x200 + self.node, struct.pack("<Hh", controlword, thousandths))
        return self.sync()

    def sync(self, data=b""):
        """State and position with which the drive answers a SYNC."""
        self.send(cia402.SYNC, data)
        answer = self.take(0x180)
        assert len(answer) == 6, answer
        statusword, position = struct.unpack("<Hi", answer)
        self.statusword = statusword
        return cia402.state_of(statusword), position

    def step(self, controlword, position):
        self.target(controlword, position)
        return self.sync()

    def enable(self):
        """Up to "operation enabled", where it stands; there the position is returned."""
        state, position = self.sync()
        for word, expected in (
            (0x06, "ready to switch on"),
            (0x07, "switched on"),
            (0x0F, "operation enabled"),
        ):
            state, position = self.step(word, position)
            assert state == expected, f"{state} after controlword {word:02X}"
        return position

    def move(self, position):
        """Waits until the drive, enabled, is there."""
        return bench.wait_until(lambda: abs(self.step(0x0F, position)[1] - position) <= 2, f"position {position}")
