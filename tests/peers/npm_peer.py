# SPDX-License-Identifier: Apache-2.0
"""Programs on the npm package canopen, a CANopen stack of others for Node.js, on the bus."""

import contextlib
import os
import re
import shutil
import subprocess
import threading

import bench

try:
    import can
except ImportError:
    bench.skip("python3-can is not installed; tools/setup --tests installs it")

MODULES = bench.ROOT / "build/peers/node_modules"
if not (MODULES / "canopen").exists() or not shutil.which("node"):
    bench.skip(f"the npm package canopen is not in {MODULES.parent}; tools/setup --tests installs it")
# What such a program hears, by identifier and mask: NMT, SYNC, our heartbeat, RPDO 1, SDO. The kernel keeps all else
# away, as the filters of a node would.
HEARD = ((0x000, 0x7FF), (0x080, 0x7FF), (0x77F, 0x7FF), (0x200, 0x780), (0x580, 0x780), (0x600, 0x780))


def data_sheet(node):
    """The EDS of the simulated drive as one for a node: the package knows no $NODEID."""
    words = [bench.Program.PLANT, bench.ROOT / "config/finger.yaml", "--eds"]
    text = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    return re.sub(r"\$NODEID\+0x([0-9A-F]+)", lambda found: hex(int(found[1], 16) + node), text)


class NpmProgram(bench.Program):
    """A script of this folder. Its standard input and output carry frames, lines "ID#DATA"; its log is what it says on
    standard error."""

    def __init__(self, script, arguments, log):
        inward, outward = os.pipe()
        filters = [{"can_id": identifier, "can_mask": mask, "extended": False} for identifier, mask in HEARD]
        self._bus = can.Bus(interface="socketcan", channel=bench.INTERFACE, can_filters=filters)
        self._quit = threading.Event()
        words = ["node", bench.ROOT / "tests/peers" / script, *arguments]
        super().__init__(words, log, stdout=outward, env={**os.environ, "NODE_PATH": str(MODULES)})
        os.close(outward)
        self._threads = [
            threading.Thread(target=self._to_bus, args=(os.fdopen(inward),), daemon=True),
            threading.Thread(target=self._from_bus, daemon=True),
        ]
        for thread in self._threads:
            thread.start()

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
            if message is not None and not message.is_remote_frame:
                with contextlib.suppress(BrokenPipeError):  # it has just ended
                    self.write_line(f"{message.arbitration_id:X}#{message.data.hex()}")
