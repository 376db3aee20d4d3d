#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The DBC that `tendrild --dbc` prints is what config/ ships, and another program reads our frames with it."""

import configparser
import subprocess
import sys
import tempfile
import unittest
import warnings
from pathlib import Path

try:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of canmatrix' own source
        import canmatrix.formats
except ImportError:
    print("skipped: python3-canmatrix is not installed")
    sys.exit(0)

ROOT = Path(__file__).resolve().parents[2]
DAEMON = sys.argv.pop(1)
PLANT = sys.argv.pop(1)


def printed_dbc(robot):
    return subprocess.run([DAEMON, "--dbc", robot], capture_output=True, text=True, check=True).stdout


def dbc_of(robot):
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        file.write(robot)
        file.flush()
        return printed_dbc(file.name)


def load(text):
    return next(iter(canmatrix.formats.loads(text, import_type="dbc", dbcImportEncoding="utf8").values()))


def decode(matrix, text):
    """What canmatrix reads of a frame in cansend's notation, by signal."""
    identifier, data = text.split("#")
    frame = matrix.frame_by_id(canmatrix.ArbitrationId(int(identifier, 16), extended=len(identifier) > 3))
    assert frame is not None and frame.size == len(data) // 2, f"{text} is not in the DBC"
    return {name: float(signal.phys_value) for name, signal in frame.decode(bytes.fromhex(data)).items()}


class DbcTest(unittest.TestCase):
    def check(self, matrix, text, expected):
        found = decode(matrix, text)
        self.assertEqual(found.keys(), expected.keys(), text)
        for name, value in expected.items():
            self.assertAlmostEqual(found[name], value, 6, f"{text}: {name}")

    def test_the_shipped_dbc_is_up_to_date(self):
        command = "tendrild --dbc config/diamond.yaml > config/diamond.dbc"
        self.assertEqual(
            (ROOT / "config/diamond.dbc").read_text(), printed_dbc(ROOT / "config/diamond.yaml"), f"run: {command}"
        )

    def test_canmatrix_reads_the_frames_of_cia402_drives(self):
        # The bytes are those that the codecs' own tests expect of them.
        matrix = load((ROOT / "config/diamond.dbc").read_text())
        mm = 2 * 3.141592653589793 * 10 / 65536
        self.check(matrix, "202#0F0010270000", {"controlword": 15, "target_position": 10000 * mm})
        self.check(matrix, "182#3702F0D8FFFF", {"statusword": 0x237, "actual_position": -10000 * mm})
        self.check(matrix, "602#2F60600008000000", {"command": 0x2F, "index": 0x6060, "subindex": 0, "data": 8})
        self.check(matrix, "1F0#E80318FCD430FA00", {"tip_x": 10, "tip_y": -10, "tip_z": 125, "age": 2.5})
        self.check(matrix, "000#0102", {"command": 1, "node": 2})
        self.check(matrix, "77F#05", {"nmt_state": 5})
        self.check(matrix, "080#", {})

    def test_canmatrix_reads_the_frames_of_sensors(self):
        matrix = load(printed_dbc(ROOT / "config/bender.yaml"))
        self.check(matrix, "1F1#2710", {"pump_pressure": 20})
        matrix = load(printed_dbc(ROOT / "config/finger.yaml"))
        self.check(matrix, "1F1#E803F0D8", {"right_tension": 0.1, "left_tension": -1})
        frame = matrix.frame_by_id(canmatrix.ArbitrationId(0x1F1, extended=False))
        self.assertEqual((frame.name, [signal.unit for signal in frame.signals]), ("Sensor_load_cells", ["N", "N"]))

    def test_canmatrix_reads_a_sensor_whose_identifier_has_29_bits(self):
        text = (ROOT / "config/finger.yaml").read_text().replace("id: 0x1F1", "id: 0x18FF50E5\n    extended: true")
        matrix = load(dbc_of(text.replace("file: finger.msh", f"file: {ROOT}/config/finger.msh")))
        self.check(matrix, "18FF50E5#E803F0D8", {"right_tension": 0.1, "left_tension": -1})

    def test_canmatrix_reads_the_floats_of_odrive_axes(self):
        text = (ROOT / "config/diamond.yaml").read_text()
        text = text.replace("counts_per_turn: 65536", "reference: absolute")
        text = text.replace("  master_node: 127\n", "  protocol: odrive\n")
        text = text.replace("heartbeat: 50 ms", "heartbeat: 100 ms").replace("timeout: 150 ms", "timeout: 250 ms")
        text = text.replace("file: diamond.msh", f"file: {ROOT}/config/diamond.msh")
        matrix = load(dbc_of(text))
        turn = 2 * 3.141592653589793 * 10
        self.check(matrix, "029#0000003F000000C0", {"position": 0.5 * turn, "velocity": -2 * turn})


class EdsTest(unittest.TestCase):
    def test_the_shipped_eds_is_up_to_date_and_lists_every_object(self):
        robot = ROOT / "config/diamond.yaml"
        printed = subprocess.run([PLANT, robot, "--eds"], capture_output=True, text=True, check=True).stdout
        shipped = (ROOT / "config/tendril-drive.eds").read_text()
        self.assertEqual(shipped, printed, "run: tendril-plant config/diamond.yaml --eds > config/tendril-drive.eds")
        eds = configparser.ConfigParser()
        eds.read_string(shipped)
        kinds = ("MandatoryObjects", "OptionalObjects")
        listed = [value[2:] for kind in kinds for key, value in eds[kind].items() if key != "supportedobjects"]
        self.assertEqual(sum(eds[kind].getint("SupportedObjects") for kind in kinds), len(listed))
        for index in listed:
            subs = [section for section in eds.sections() if section.startswith(index + "sub")]
            self.assertEqual(len(subs), eds[index].getint("SubNumber", 0), index)
        self.assertEqual(eds["6064"]["DataType"], "0x0004")
        self.assertEqual(eds["60C2sub2"]["DefaultValue"], "-3")
        mappable = [section for section in eds.sections() if eds[section].get("PDOMapping") == "1"]
        self.assertEqual(mappable, ["1001", "603F", "6040", "6041", "6060", "6061", "6064", "6071", "6077", "607A", "60B0",
                                    "60B1", "60B2"])
        composite = [section for section in eds.sections() if "SubNumber" in eds[section]]
        composites = {section: int(eds[section]["ObjectType"], 0) for section in composite}
        arrays = [index for index, kind in composites.items() if kind == 8]
        self.assertEqual(arrays, ["1003", "1016", "607D", "6099"])  # of one type, by CiA 301 and 402
        self.assertEqual(set(composites.values()), {8, 9})
        # What CiA 306 wants of every sheet.
        for section, keys in (
            ("FileInfo", "FileName FileVersion FileRevision EDSVersion Description CreatedBy"),
            ("DeviceInfo", "VendorName VendorNumber ProductName ProductNumber RevisionNumber OrderCode"),
            ("DeviceInfo", " ".join(f"BaudRate_{kbit}" for kbit in (10, 20, 50, 125, 250, 500, 800, 1000))),
            ("DeviceInfo", "SimpleBootUpMaster SimpleBootUpSlave Granularity DynamicChannelsSupported GroupMessaging"),
            ("DeviceInfo", "NrOfRXPDO NrOfTXPDO LSS_Supported"),
            ("DummyUsage", " ".join(f"Dummy000{kind}" for kind in range(1, 8))),
        ):
            for key in keys.split():
                self.assertIn(key, eds[section])
        self.assertEqual(eds["1400sub1"]["DefaultValue"], "$NODEID+0x80000200")


if __name__ == "__main__":
    unittest.main()
