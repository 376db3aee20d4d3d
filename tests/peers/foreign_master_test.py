#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The simulated CiA 402 drive under a master that is not Tendril's, while cangen floods the bus."""

import struct
import unittest

import bench
import cia402
from canopen_master import Abort, Master

NODE = 1  # of the actuator "right"
FLOOD_GAP_MS = 5


class MasterTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.robot = bench.Bench(bench.finger())
        cls.addClassCleanup(cls.robot.__exit__)
        cls.robot.start_plant()
        cls.enterClassContext(cls.robot.flood(FLOOD_GAP_MS))
        cls.master = Master(NODE)
        cls.addClassCleanup(cls.master.close)

    def setUp(self):
        self.master.restart()

    def run_drive(self, **more):
        self.master.set_up(**more)
        self.master.start()
        return self.master.enable()

    def wait_for_state(self, state, word=0x0F):
        position = self.master.sync()[1]
        bench.wait_until(lambda: self.master.step(word, position)[0] == state, state)

    def emergency(self):
        code, register = struct.unpack("<HB5x", self.master.take(0x080))
        return code, register

    def test_it_names_its_profile_its_identity_and_its_cob_ids(self):
        master = self.master
        self.assertEqual(master.read_number(0x1000) & 0xFFFF, 402)
        self.assertEqual(master.read(0x1001), b"\0")
        self.assertEqual(master.read_number(0x1018), 4)
        for sub in range(1, 5):
            self.assertEqual(len(master.read(0x1018, sub)), 4)
        self.assertEqual(master.read_number(0x1005), 0x80)
        self.assertEqual(master.read_number(0x1014), 0x80 + NODE)
        self.assertEqual(master.read_number(0x1400, 1), 0x80000200 + NODE)
        self.assertTrue(master.read_number(0x6502) & 1 << 7, "cyclic synchronous position")
        self.assertEqual(master.read(0x603F), b"\0\0")

    def test_what_cannot_be_served_is_aborted_with_the_standards_code_and_the_next_request_is_served(self):
        master = self.master
        master.set_up()
        for request, code, why in (
            ("40 45 23 00", 0x06020000, "no such object"),
            ("40 18 10 05", 0x06090011, "no such subindex"),
            ("23 00 10 00", 0x06010002, "read-only"),
            ("2B 05 10 00 80", 0x06070013, "too short"),
            ("23 40 60 00 06", 0x06070012, "too long"),
            ("23 05 10 00 81", 0x06090030, "another SYNC"),
            ("2F C2 60 02 01", 0x06090031, "above the range"),
            ("2F C2 60 01 00", 0x06090032, "below the range"),
            ("2F 60 60 00 01", 0x06090030, "profile position mode"),
            ("23 00 16 01 10 00 40 60", 0x06010000, "mapping of a PDO that is on"),
            ("C6 7A 60 00 04", 0x05040001, "block download"),
            ("A4 64 60 00 04", 0x05040001, "block upload"),
            ("60", 0x05040001, "segment of no transfer"),
            ("E0", 0x05040001, "reserved command"),
        ):
            with self.subTest(why):
                with self.assertRaises(Abort) as raised:
                    master.sdo(bytes.fromhex(request).ljust(8, b"\0"))
                self.assertEqual(f"{raised.exception.code:08X}", f"{code:08X}")
                self.assertEqual(master.read_number(0x1018), 4)
        master.write(0x1400, 1, 4, 0x80000200 + NODE)
        master.write(0x1600, 0, 1, 0)
        with self.assertRaises(Abort) as raised:
            master.write(0x1600, 1, 4, 0x60640020)  # which cannot be received
        self.assertEqual(raised.exception.code, 0x06040041)
        master.start()
        with self.assertRaises(Abort) as raised:
            master.write(0x1600, 1, 4, 0x60400010)
        self.assertEqual(raised.exception.code, 0x08000022)

    def test_a_name_comes_in_segments_or_is_no_object(self):
        try:
            self.assertTrue(self.master.read(0x1008).decode("ascii").isprintable())
        except Abort as abort:
            self.assertEqual(abort.code, 0x06020000)

    def test_its_heartbeat_follows_nmt(self):
        master = self.master
        self.assertFalse(master.heard(0x700))
        master.write(0x1017, 0, 2, 20)
        master.heartbeat_of(cia402.PRE_OPERATIONAL)
        for command, state in (
            (cia402.START, cia402.OPERATIONAL),
            (cia402.STOP, cia402.STOPPED),
            (cia402.PRE_OPERATIONAL_COMMAND, cia402.PRE_OPERATIONAL),
        ):
            master.nmt(command, 0)  # of all nodes
            master.heartbeat_of(state)
        master.nmt(cia402.START, NODE + 1)
        master.nmt(cia402.STOP)
        master.heartbeat_of(cia402.STOPPED)
        master.frames.clear()
        master.send(0x600 + NODE, [0x40, 0x01, 0x10, 0, 0, 0, 0, 0])  # SDO is not served while stopped
        for _ in range(3):
            master.heartbeat_of(cia402.STOPPED)
        self.assertFalse(any(identifier == 0x580 + NODE for identifier, _ in master.frames))
        master.nmt(cia402.RESET_COMMUNICATION)
        master.heartbeat_of(cia402.BOOT_UP)
        self.assertEqual(master.read_number(0x1017), 0)

    def test_it_follows_a_ramp_of_targets_one_at_each_sync(self):
        start = self.run_drive()
        positions = []
        for step in range(100):
            target = start + 20 * step
            state, position = self.master.step(0x0F, target)
            self.assertEqual(state, "operation enabled")
            self.assertLessEqual(position, target + 20)
            positions.append(position)
        self.assertTrue(all(b >= a - 2 for a, b in zip(positions, positions[1:])))
        self.master.move(start + 2000)
        self.assertTrue(self.master.statusword & 1 << 12, "the drive says that it follows")
        # It has settled but for a count or two.
        self.assertAlmostEqual(struct.unpack("<i", self.master.read(0x6064))[0], self.master.sync()[1], delta=2)
        self.master.move(start)

    def test_it_pushes_with_a_target_torque_and_tells_what_it_exerts(self):
        master = self.master
        self.assertTrue(master.read_number(0x6502) & 1 << 9)
        self.assertGreater(master.read_number(0x6076), 0)
        master.set_up(target=0x60710010, mode=10)
        self.assertEqual(master.read_number(0x6061), 10)
        master.start()
        start = master.sync()[1]
        for word, state in ((0x06, "ready to switch on"), (0x07, "switched on"), (0x0F, "operation enabled")):
            self.assertEqual(master.push(word, 0)[0], state)
        bench.wait_until(lambda: master.push(0x0F, 300)[1] > start + 200, "a motion towards higher positions")
        self.assertTrue(master.statusword & 1 << 12, "the drive says that it follows")
        self.assertGreater(struct.unpack("<h", master.read(0x6077))[0], 0)
        bench.wait_until(lambda: master.push(0x0F, -300)[1] < start - 200, "one towards lower positions")
        state, held = master.push(0x00, -300)
        self.assertEqual(state, "switch on disabled")
        for _ in range(20):
            self.assertEqual(master.push(0x00, -300)[1], held)

    def test_a_sync_counter_makes_no_difference_and_without_sync_no_position_comes(self):
        self.run_drive()
        for counter in range(1, 5):
            self.assertEqual(self.master.sync([counter])[0], "operation enabled")
        self.master.forget()
        self.master.target(0x0F, self.master.sync()[1])
        self.assertFalse(self.master.heard(0x180))

    def test_a_target_that_is_not_synchronous_is_taken_at_once(self):
        self.master.set_up(receive_type=255)
        self.master.start()
        for word, state in ((0x06, "ready to switch on"), (0x07, "switched on"), (0x00, "switch on disabled")):
            self.master.target(word, 0)
            self.assertEqual(cia402.state_of(self.master.read_number(0x6041)), state)

    def test_its_states_follow_a_controlword_over_sdo_too(self):
        for word, state in (
            (0x06, "ready to switch on"),
            (0x0F, "switched on"),
            (0x0F, "operation enabled"),
            (0x07, "switched on"),
            (0x06, "ready to switch on"),
            (0x02, "switch on disabled"),
            (0x07, "switch on disabled"),
        ):
            self.master.write(0x6040, 0, 2, word)
            self.assertEqual(cia402.state_of(self.master.read_number(0x6041)), state, f"after {word:02X}")

    def test_a_quick_stop_holds_and_can_be_left_both_ways(self):
        start = self.run_drive()
        self.assertEqual(self.master.step(0x02, start)[0], "quick stop active")
        held = self.master.sync()[1]
        for _ in range(20):
            state, position = self.master.step(0x02, start + 1000)
            self.assertEqual((state, position), ("quick stop active", held))
        self.assertEqual(self.master.step(0x0F, held)[0], "operation enabled")
        self.assertEqual(self.master.step(0x02, held)[0], "quick stop active")
        self.assertEqual(self.master.step(0x00, held)[0], "switch on disabled")

    def test_a_fault_is_told_three_ways_and_cleared_by_a_rising_edge_alone(self):
        self.run_drive()
        self.robot.plant.write_line("fault right emcy 0x4310")
        self.assertEqual(self.emergency(), (0x4310, 0x09))  # generic, temperature
        self.wait_for_state("fault")
        self.assertEqual(self.master.read_number(0x1001), 0x09)
        self.assertEqual(self.master.read_number(0x603F), 0x4310)
        position = self.master.sync()[1]
        self.assertEqual(self.master.step(0x0F, position)[0], "fault")
        self.assertEqual(self.master.step(0x80, position)[0], "switch on disabled")
        self.assertEqual(self.emergency(), (0, 0))
        self.assertEqual(self.master.read_number(0x1001), 0)
        self.assertEqual(self.master.read_number(0x603F), 0)
        self.robot.plant.write_line("fault right emcy 0x4310")
        self.emergency()
        self.wait_for_state("fault", 0x80)  # the bit has been set since the last fault
        self.assertEqual(self.master.step(0x80, position)[0], "fault")
        self.master.step(0x00, position)
        self.assertEqual(self.master.step(0x80, position)[0], "switch on disabled")

    def test_a_drive_that_cannot_follow_leaves_its_window(self):
        self.master.write(0x6065, 0, 4, 50)
        start = self.run_drive()
        self.robot.plant.write_line("stuck right")
        self.addCleanup(self.robot.plant.write_line, "clear")
        bench.wait_until(lambda: self.master.step(0x0F, start + 2000)[0] == "fault", "the fault of a stuck drive")
        self.assertEqual(self.emergency()[0], 0x8611)

    def test_a_target_beyond_its_soft_limits_is_cut_and_said_so(self):
        start = self.run_drive()
        self.master.write(0x607D, 1, 4, start - 100)
        self.master.write(0x607D, 2, 4, start + 100)
        bench.wait_until(lambda: abs(self.master.step(0x0F, start + 5000)[1] - start - 100) <= 2, "the limit")
        self.assertTrue(self.master.statusword & 1 << 11)
        self.master.move(start)
        self.assertFalse(self.master.statusword & 1 << 11)

    def test_it_stops_by_itself_when_the_masters_heartbeat_ends(self):
        self.master.write(0x1016, 1, 4, cia402.MASTER << 16 | 100)
        self.run_drive()
        self.assertFalse(self.master.heard(0x080))  # the watch begins with the first heartbeat
        self.master.send(0x700 + cia402.MASTER, [cia402.OPERATIONAL])
        self.assertEqual(self.emergency(), (0x8130, 0x11))
        self.master.heartbeat_of(cia402.PRE_OPERATIONAL)
        bench.wait_until(lambda: cia402.state_of(self.master.read_number(0x6041)) == "fault", "the fault")

    def test_a_target_that_is_too_short_is_told_and_not_taken(self):
        position = self.run_drive()
        self.master.send(0x200 + NODE, [0x00, 0x00])
        self.assertEqual(self.emergency()[0], 0x8210)
        self.assertEqual(self.master.sync(), ("operation enabled", position))

    def test_what_is_not_for_it_changes_nothing(self):
        self.run_drive()
        self.master.forget()
        for identifier, data, more in (
            (0x700 + NODE, b"", {"is_remote_frame": True}),  # node guarding
            (0x180 + NODE, b"", {"is_remote_frame": True}),  # a TPDO asked for
            (0x7E5, [0x04, 0x01, 0, 0, 0, 0, 0, 0], {}),  # LSS
            (0x100, [0, 0, 0, 0, 0, 0], {}),  # TIME
            (0x000, [cia402.STOP], {}),  # NMT that is too short
            (0x000, [0x55, NODE], {}),  # of no known command
            (0x000, [cia402.STOP, NODE], {"is_extended_id": True}),
            (0x080, b"", {"is_extended_id": True}),
            (0x200 + NODE, [0] * 6, {"is_extended_id": True}),
            (0x600 + NODE, [0x40, 0x01, 0x10, 0], {}),  # SDO that is too short
            (0x600 + NODE, [0x80, 0x01, 0x10, 0, 0, 0, 4, 5], {}),  # SDO that the client gives up
            (0x600 + NODE + 1, [0x40, 0x01, 0x10, 0, 0, 0, 0, 0], {}),  # to another
        ):
            self.master.send(identifier, data, **more)
            for base in (0x080, 0x180, 0x580):
                self.assertFalse(self.master.heard(base), f"{identifier:03X} {list(data)} {more} was answered")
        self.assertEqual(self.master.sync()[0], "operation enabled")


if __name__ == "__main__":
    bench.main()
