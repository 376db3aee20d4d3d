#!/usr/bin/python3
"""The daemon with drives that are not Tendril's: a CiA 402 servo on the npm package canopen (cia402_drive.js)."""

import contextlib
import os
import re
import shutil
import subprocess
import threading

import bench
import bus_log
import can
from bus_log_test import COUNT_MM, BusTest, Run

NODES = {1: "right", 2: "left"}
PEERS = bench.ROOT / "build/peers"


class NpmDrives(bench.Program):
    """The drives on the bus; ready to be talked to once made. Their data sheet is the one that tendril-plant prints."""

    def __init__(self, folder):
        eds_of = [bench.Program.PLANT, bench.ROOT / "config/finger.yaml", "--eds"]
        sheet = subprocess.run(eds_of, capture_output=True, text=True, check=True).stdout
        words = ["node", bench.ROOT / "tests/peers/cia402_drive.js"]
        for node in NODES:
            eds = folder / f"{node}.eds"
            # The package knows no $NODEID.
            eds.write_text(re.sub(r"\$NODEID\+0x([0-9A-F]+)", lambda found: hex(int(found[1], 16) + node), sheet))
            words += [eds, node]
        inward, outward = os.pipe()
        self._bus = can.Bus(interface="socketcan", channel=bench.INTERFACE)
        self._quit = threading.Event()
        environment = {**os.environ, "NODE_PATH": str(PEERS / "node_modules")}
        super().__init__(words, folder / "drives.log", stdout=outward, env=environment)
        os.close(outward)
        self._threads = [
            threading.Thread(target=self._to_bus, args=(os.fdopen(inward),), daemon=True),
            threading.Thread(target=self._from_bus, daemon=True),
        ]
        for thread in self._threads:
            thread.start()
        for node in NODES:
            self.wait_for(f"node {node}: NMT 7f")

    def __exit__(self, *_):
        self.process.kill()
        self._quit.set()
        for thread in self._threads:
            thread.join()
        self._bus.shutdown()
        super().__exit__()

    def _to_bus(self, lines):
        with lines:
            for line in lines:
                identifier, data = line.strip().split("#")
                self._bus.send(
                    can.Message(arbitration_id=int(identifier, 16), data=bytes.fromhex(data), is_extended_id=False)
                )

    def _from_bus(self):
        while not self._quit.is_set():
            message = self._bus.recv(0.1)
            if message is not None and not message.is_extended_id:
                with contextlib.suppress(BrokenPipeError):  # the drives have just ended
                    self.write_line(f"{message.arbitration_id:X}#{message.data.hex()}")

    def states(self, node):
        """The power states of a drive, as it entered them."""
        lines = re.findall(rf"^node {node}: (.*)$", self.said(), re.MULTILINE)
        return [line for line in lines if not line.startswith("NMT")]


class NpmDriveTest(BusTest):
    def test_the_daemon_enables_moves_and_releases_them(self):
        with contextlib.ExitStack() as stack:
            robot = stack.enter_context(bench.Bench(bench.finger()))
            log = stack.enter_context(bus_log.BusLog(robot.folder))
            drives = stack.enter_context(NpmDrives(robot.folder))
            with robot.start_daemon("--duration", "1") as daemon:
                self.assertEqual(daemon.exit_code(), 0, daemon.said())
            run = Run(robot, log)
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
    if not (PEERS / "node_modules/canopen").exists() or not shutil.which("node"):
        bench.skip("the npm package canopen is not in build/peers; tools/setup --tests installs it")
    bench.main()
