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

    def entries(self, dbc, is_foreign=lambda identifier, data: False):
        """The frames so far, each described.

        is_foreign: says of a frame, as candump writes its identifier and data, whether it is to be left out
        Raises AssertionError for a frame that the DBC does not know.
        """
        self._mark()
        matrix = next(iter(canmatrix.formats.loads(dbc, import_type="dbc", dbcImportEncoding="utf8").values()))
        entries = []
        said = self._candump.said()
        for line in said[:said.rindex("\n")].splitlines():  # it may be writing the next
            found = LINE.fullmatch(line)
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
