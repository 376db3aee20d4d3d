#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The daemon with drives that are not Tendril's: a CiA 402 servo on the npm package canopen (cia402_drive.js)."""

import contextlib
import re

import bench
import bus_log
from bus_log_test import COUNT_MM, WAITED_FOR, BusTest, Run, run_until_enough, spans_of
from npm_peer import NpmProgram, data_sheet

NODES = {1: "right", 2: "left"}
FLOOD_GAP_MS = 10


class NpmDrives(NpmProgram):
    """The drives of the finger, ready to be talked to once made."""

    def __init__(self, folder):
        arguments = []
        for node in NODES:
            eds = folder / f"{node}.eds"
            eds.write_text(data_sheet(node))
            arguments += [eds, node]
        super().__init__("cia402_drive.js", arguments, folder / "drives.log")
        for node in NODES:
            self.wait_for(f"node {node}: NMT 7f")

    def states(self, node):
        """The power states of a drive, as it entered them."""
        lines = re.findall(rf"^node {node}: (.*)$", self.said(), re.MULTILINE)
        return [line for line in lines if not line.startswith("NMT")]


class NpmDriveTest(BusTest):
    def test_the_daemon_enables_moves_and_releases_them_while_others_talk(self):
        with contextlib.ExitStack() as stack:
            robot = stack.enter_context(bench.Bench(bench.finger()))
            log = stack.enter_context(bus_log.BusLog(robot.folder))
            stack.enter_context(robot.flood(FLOOD_GAP_MS))
            drives = stack.enter_context(NpmDrives(robot.folder))
            watch = stack.enter_context(bus_log.Watch(robot.dbc(), spans_of("canopen"), WAITED_FOR))
            code, said = run_until_enough(robot, watch)
            self.assertEqual(code, 0, said)
            run = Run(robot, log, flooded=True)
            states = {node: drives.states(node) for node in NODES}
        self.check_summary(run)
        up = ["switch on disabled", "ready to switch on", "switched on", "operation enabled"]
        for node, drive in NODES.items():
            self.assertEqual(states[node], up + up[-2::-1])
            self.check_targets(run, drive, run.signals(f"Drive_{drive}_RPDO", "target_position"), COUNT_MM)
            self.check_positions(run, drive, run.signals(f"Drive_{drive}_TPDO", "actual_position"))

    def test_a_fault_of_one_stops_the_robot_with_its_reason(self):
        with contextlib.ExitStack() as stack:
            robot = stack.enter_context(bench.Bench(bench.finger()))
            drives = stack.enter_context(NpmDrives(robot.folder))
            daemon = stack.enter_context(robot.start_daemon())
            daemon.wait_for("phase: run")
            drives.write_line("fault 2 0x4310")
            self.assertEqual(daemon.exit_code(), 1)
            self.assertIn("'left' (node 2): drive fault: drive too hot (EMCY 4310)", daemon.said())
            bench.wait_until(lambda: drives.states(1)[-1] == "switch on disabled", "the other drive's end")


if __name__ == "__main__":
    bench.main()
