# SPDX-License-Identifier: Apache-2.0
"""The bus as candump of can-utils logs it, and as a DBC describes it to canmatrix: neither is Tendril's."""

import re
import shutil
import warnings
from dataclasses import dataclass

import bench

try:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of canmatrix' own source
        import can
        import canmatrix.formats
except ImportError as error:
    bench.skip(f"{error.name} is not installed; tools/setup --tests installs it")
if not shutil.which("candump"):
    bench.skip("can-utils are not installed; tools/setup --tests installs them")

LINE = re.compile(r"\((\d+\.\d+)\) \S+ ([0-9A-F]+)#(R?[0-9A-F]*)")
MARK = "1FFFFF"


def load(dbc):
    return next(iter(canmatrix.formats.loads(dbc, import_type="dbc", dbcImportEncoding="utf8").values()))


class Watch:
    """Follows signals on the bus from now on, so that a run can be ended once it has shown enough. Use with `with`.

    spans: for each signal, named by its frame and its name, by how much it is to change
    cycles: so many frames of each are to come after the first in which it has changed
    """

    def __init__(self, dbc, spans, cycles):
        matrix = load(dbc)
        self._frames = {matrix.frame_by_name(frame).arbitration_id.id: frame for frame, _ in spans}
        self._matrix, self._spans, self._cycles = matrix, spans, cycles
        self._seen = {name: [] for name in spans}  # least, greatest, number since the first change
        filters = [{"can_id": identifier, "can_mask": 0x7FF, "extended": False} for identifier in self._frames]
        self._bus = can.Bus(interface="socketcan", channel=bench.INTERFACE, can_filters=filters)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._bus.shutdown()

    def enough(self):
        while message := self._bus.recv(0):
            if not message.is_remote_frame:  # those are others' questions
                self._take_in(message)
        return all(
            seen and seen[1] - seen[0] > self._spans[name] and seen[2] >= self._cycles
            for name, seen in self._seen.items()
        )

    def _take_in(self, message):
        frame = self._frames.get(message.arbitration_id)
        if frame is None:  # it came before the kernel had our filters
            return
        signals = self._matrix.frame_by_name(frame).decode(bytes(message.data))
        for (of, name), seen in self._seen.items():
            if of != frame:
                continue
            value = float(signals[name].phys_value)
            if not seen:
                seen[:] = [value, value, 0]
            seen[:] = [min(seen[0], value), max(seen[1], value), seen[2]]
            seen[2] += seen[1] > seen[0]

    def text(self):
        """How far it has come, for people: least, greatest and number of frames of each."""
        return ", ".join(f"{frame}.{name}: {seen}" for (frame, name), seen in self._seen.items())


@dataclass
class Entry:
    """A frame of the log. `name` and `signals` are what the DBC makes of it."""

    time_s: float
    text: str
    name: str
    signals: dict


class BusLog:
    """Logs all frames from now on, until `entries` are asked for. Use with `with`."""

    def __init__(self, folder):
        self._marks = 0
        self._candump = bench.Program(["candump", "-L", "-d", "-r", 1 << 22, bench.INTERFACE], folder / "candump.log")
        self._bus = can.Bus(interface="socketcan", channel=bench.INTERFACE, receive_own_messages=False)
        self._mark()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._bus.shutdown()
        self._candump.__exit__()

    def _mark(self):
        """Sends a frame of the test's own until the log has it: what came before it is then there too."""
        self._marks += 1
        mark = can.Message(arbitration_id=int(MARK, 16) * 256 + self._marks, is_extended_id=True)

        def logged():
            self._bus.send(mark)
            return f"{mark.arbitration_id:08X}#" in self._candump.said()

        bench.wait_until(logged, "a frame in the log of candump")

    def last(self, identifier):
        """The data of the last frame of an identifier, as candump writes both; nothing where there is none."""
        said = self._candump.said()
        _, found, rest = said[:said.rfind("\n") + 1].rpartition(f" {identifier}#")  # it may be writing the next
        return rest.partition("\n")[0] if found else None

    def count_foreign(self, stranger):
        """How many frames others have sent so far, by kind: the stranger's, remote ones, extended ones."""
        said = self._candump.said()
        extended = len(re.findall(r" [0-9A-F]{8}#", said)) - said.count(f" {MARK}")
        return {stranger: said.count(f" {stranger}#"), "remote": said.count("#R"), "extended": extended}

    def count(self, identifier):
        """How many frames of an identifier there are so far."""
        return self._candump.said().count(f" {identifier}#")

    def entries(self, dbc, is_foreign=lambda identifier, data: False):
        """The frames so far, each described.

        is_foreign: says of a frame, as candump writes its identifier and data, whether it is to be left out
        Raises AssertionError for a frame that the DBC does not know.
        """
        self._mark()
        matrix = load(dbc)
        entries = []
        said = self._candump.said()
        for line in said[:said.rindex("\n")].splitlines():  # it may be writing the next
            found = LINE.fullmatch(line)
            if line.startswith("DROPCOUNT"):  # its queue holds a second of a flood, and more
                bench.skip(f"the machine is too slow to log the bus: {line}")
            if not found:
                raise AssertionError(f"candump says: {line}")
            time_s, identifier, data = found.groups()
            if identifier.startswith(MARK) or is_foreign(identifier, data):
                continue
            frame = matrix.frame_by_id(canmatrix.ArbitrationId(int(identifier, 16), extended=len(identifier) > 3))
            if frame is None or 2 * frame.size != len(data):
                raise AssertionError(f"the DBC does not describe {identifier}#{data}")
            signals = {name: float(value.phys_value) for name, value in frame.decode(bytes.fromhex(data)).items()}
            entries.append(Entry(float(time_s), f"{identifier}#{data}", frame.name, signals))
        return entries
