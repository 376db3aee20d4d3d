#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The log of a real run holds what its report does, as we read it and as the npm package @mcap/core does; also where the
daemon was killed, and where the file was cut off at any byte.

usage: log_test.py TENDRILD PLANT CLASS
"""

import csv
import faulthandler
import json
import os
import random
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "tests/peers"), str(ROOT / "tools")]
from bench import NO_PYTHON, PATIENCE_S, Program, finger, skip, wait_until

try:
    from run_report import log_run, mcap
    from run_report.run import ReportError
except ImportError as problem:
    skip(f"Python's {problem.name} is not installed; tools/setup installs it")

DAEMON, PLANT = sys.argv[1:3]
MODULES = ROOT / "build/peers/node_modules"
# Digits after the point in trace.csv, and how exact the log is itself.
DIGITS = {"_m": 7, "_N": 5, "_s": 6, "_us": 2, "_m3": 11, "_Pa": 2}


class Run:
    """A finger that is controlled for a short time, with log and report; gone with the test or class that made it."""

    def __init__(self, case, *more):
        folder = tempfile.TemporaryDirectory(prefix="tendril-log-")
        self.folder = Path(folder.name)
        self.log, self.report = self.folder / "finger.mcap", self.folder / "report"
        robot, bus = self.folder / "finger.yaml", f"local:{self.folder}/bus"
        robot.write_text(finger())
        self.plant = Program([PLANT, robot, "--bus", bus], self.folder / "plant.log")
        words = [DAEMON, robot, "--bus", bus, "--allow-non-rt", "--log", self.log, "--report", self.report, *more]
        for clean_up in (folder.cleanup, self.plant.__exit__):
            case(clean_up)
        self.plant.wait_for("ready")
        self.daemon = Program(words, self.folder / "daemon.log", env={**os.environ, "PYTHONHOME": NO_PYTHON})
        case(self.daemon.__exit__)

    def messages(self):
        return list(mcap.Log(self.log).messages())


class EndedRun(unittest.TestCase):
    """One run that has ended as asked, for all tests of a class."""

    @classmethod
    def setUpClass(cls):
        cls.run_ = Run(cls.addClassCleanup, "--duration", "3")
        if cls.run_.daemon.exit_code() != 0:
            raise AssertionError(cls.run_.daemon.said())


def chunks_of(data):
    """(end, messages) of each whole chunk, and where it begins, read from the bytes alone."""
    at, found = len(mcap.MAGIC), []
    while at < len(data) - len(mcap.MAGIC):
        opcode, size = struct.unpack_from("<BQ", data, at)
        body = data[at + 9:at + 9 + size]
        if opcode == mcap.CHUNK:
            size_inside, = struct.unpack_from("<Q", body, 16)
            inside = mcap.decompressed(body[8 + 8 + 8 + 4 + 4 + len("zstd") + 8:], size_inside)
            place = messages = 0
            while place < len(inside):
                messages += inside[place] == mcap.MESSAGE
                place += 9 + struct.unpack_from("<Q", inside, place + 1)[0]
            found.append((at, at + 9 + size, messages))
        at += 9 + size
    return found


class LogTest(EndedRun):
    """As our own reader reads it."""

    def unpacked(self):
        folder = self.run_.folder / "unpacked"
        log_run.unpack(self.run_.log, folder)
        return folder

    def test_every_row_of_the_trace_is_in_it(self):
        ours, theirs = (list(csv.reader((folder / "trace.csv").open())) for folder in (self.unpacked(), self.run_.report))
        self.assertEqual(ours[0], theirs[0])
        self.assertEqual(len(ours), len(theirs))
        self.assertGreater(len(ours), 300)
        for our_row, their_row in zip(ours[1:], theirs[1:]):
            for column, our, their in zip(ours[0], our_row, their_row):
                if column in ("phase", "qp_status") or not their:
                    self.assertEqual(our, their, column)
                    continue
                digits = DIGITS.get(column[column.rindex("_"):], 0)
                rounding = 0.51 * 10**-digits + 1e-8 * abs(float(their))
                self.assertAlmostEqual(float(our), float(their), delta=rounding, msg=column)

    def test_its_figures_are_those_of_the_summary(self):
        ours, theirs = (json.loads((folder / "summary.json").read_text()) for folder in (self.unpacked(), self.run_.report))
        for key in ("following_error", "target_to_model_mm"):  # are in no topic: they follow from the trace
            theirs.pop(key)
        if theirs["rt"]["heap_calls"] < 0:  # a sanitizer's build cannot count them
            theirs["rt"]["heap_calls"] = ours["rt"]["heap_calls"]
        self.assertEqual(set(ours), set(theirs))
        for key, value in theirs.items():
            self.compare(key, ours[key], value)

    def compare(self, key, our, their):
        if isinstance(their, dict):
            self.assertEqual(set(our), set(their), key)
            for inner in their:
                self.compare(f"{key}.{inner}", our[inner], their[inner])
        elif isinstance(their, float):
            # Its percentiles come from a histogram, exact to 1/512.
            self.assertAlmostEqual(our, their, delta=abs(their) / 500 + 1e-6, msg=key)
        else:
            self.assertEqual(our, their, key)

    def test_targets_snapshots_lines_and_the_end_are_in_it(self):
        messages = self.run_.messages()
        of = {topic: [m for m in messages if m.topic == topic] for topic in {m.topic for m in messages}}
        states = of["/state"]
        self.assertTrue(all(a.log_ns < b.log_ns for a, b in zip(states, states[1:])))
        self.assertEqual([m.data["cycles"] for m in states][-1], sum(1 + m.data["missed"] for m in states))
        sent = [m.data["position"]["tip"] for m in of["/targets"]]
        self.assertGreater(len({json.dumps(position) for position in sent}), 10)
        self.assertEqual({m.data["mode"] for m in of["/targets"]}, {"path"})
        used = [m.data["sequence"] for m in of["/snapshots"]]
        self.assertEqual(used, sorted(set(used)))
        self.assertEqual(set(used), {m.data["snapshot"]["sequence"] for m in states} - {0})
        said = [m.data["message"] for m in of["/log"]]
        for line in ("phase: run", "drives disabled"):
            self.assertIn(line, said)
        for line in said:
            self.assertIn(line, self.run_.daemon.said())
        self.assertEqual([m.data["stop_reason"] for m in of["/end"]], [""])
        self.assertEqual(of["/status"][-1].data["log_dropped"], 0)
        for sample in of["/sensors/camera"]:
            self.assertLessEqual(sample.publish_ns, sample.log_ns + 10**9 / 100)

    def test_a_log_that_is_cut_off_is_read_up_to_its_last_whole_chunk(self):
        data, chunks = self.run_.log.read_bytes(), chunks_of(self.run_.log.read_bytes())
        self.assertGreater(len(chunks), 4)
        cut = self.run_.folder / "cut.mcap"
        for size in cuts(data, chunks):
            cut.write_bytes(data[:size])
            log = mcap.Log(cut)
            self.assertEqual(sum(1 for _ in log.messages()), sum(n for _, end, n in chunks if end <= size), size)
            self.assertEqual(log.complete, size > len(data) - 9)

    def test_a_report_of_a_log_that_is_cut_off_says_so(self):
        data, chunks = self.run_.log.read_bytes(), chunks_of(self.run_.log.read_bytes())
        cut = self.run_.folder / "cut.mcap"
        cut.write_bytes(data[:chunks[-1][0] + 100])
        log_run.unpack(cut, self.run_.folder / "of-cut")
        summary = json.loads((self.run_.folder / "of-cut/summary.json").read_text())
        self.assertEqual(summary["warnings"], ["the log ends before the run does"])
        self.assertEqual(summary["faults"], [])

    def test_what_is_no_log_is_refused_in_a_sentence(self):
        damaged = bytearray(self.run_.log.read_bytes())
        damaged[chunks_of(damaged)[1][0] + 200] ^= 1
        for content, said in ((b"", "is no MCAP file"), (b"robot: finger\n", "is no MCAP file"),
                              (mcap.MAGIC, "holds no message"), (bytes(damaged), "damaged at byte")):
            other = self.run_.folder / "other.mcap"
            other.write_bytes(content)
            with self.assertRaises(ReportError) as refusal:
                log_run.unpack(other, self.run_.folder / "of-other")
            self.assertIn(said, str(refusal.exception))

    def test_the_daemon_says_how_much_it_wrote(self):
        said = re.search(r"finger.mcap: (\d+) messages", self.run_.daemon.said())
        self.assertEqual(int(said[1]), len(self.run_.messages()))


class KilledTest(unittest.TestCase):
    def test_a_daemon_that_is_killed_leaves_what_it_had_written_and_the_next_one_keeps_it(self):
        run = Run(self.addCleanup)
        run.daemon.wait_for("phase: run")

        def running():
            return run.log.exists() and [m for m in run.messages() if m.topic == "/state" and m.data["phase"] in log_run.RUNNING]

        before = wait_until(running, "cycles of the run in the log, while it goes on", [run.daemon])
        run.daemon.process.kill()
        run.daemon.process.wait()
        after = run.messages()
        self.assertLessEqual({m.log_ns for m in before}, {m.log_ns for m in after})
        words = [word for word in run.daemon.process.args if word != "--report" and word != str(run.report)]
        with Program([*words, "--duration", "0.1"], run.folder / "next.log") as following:
            self.assertEqual(following.exit_code(), 0, following.said())
        self.assertEqual(list(mcap.Log(run.log.with_name("finger.1.mcap")).messages()), after)


def cuts(data, chunks):
    """Where to cut: at and beside the ends of all chunks, and at a hundred places that chance gives."""
    seed = random.randrange(2**32)
    print(f"seed {seed}")
    chance = random.Random(seed)
    edges = {place + beside for start, end, _ in chunks for place in (start, end) for beside in (-1, 0, 1)}
    return sorted(edges | {chance.randrange(8, len(data)) for _ in range(100)} | {len(data)})


class NpmTest(EndedRun):
    """As the npm package @mcap/core reads it."""

    @classmethod
    def setUpClass(cls):
        if not (MODULES / "@mcap/core").exists() or not shutil.which("node"):
            skip(f"the npm package @mcap/core is not in {MODULES.parent}; tools/setup --tests installs it")
        super().setUpClass()

    def node(self, *words):
        words = ["node", ROOT / "tests/app/mcap/mcap_core.js", *map(str, words)]
        ran = subprocess.run(words, capture_output=True, text=True, env={**os.environ, "NODE_PATH": str(MODULES)}, check=False)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        return [json.loads(line) for line in ran.stdout.splitlines()]

    def test_index_and_checksums_lead_to_every_message_that_we_read(self):
        file, *messages = self.node("index", self.run_.log)
        topics = {channel["id"]: channel["topic"] for channel in file["channels"]}
        ours = Counter((m.topic, m.log_ns, m.publish_ns, json.dumps(m.data)) for m in self.run_.messages())
        theirs = Counter((topics[m["channelId"]], int(m["logTime"]), int(m["publishTime"]), json.dumps(json.loads(m["data"])))
                         for m in messages)
        self.assertEqual(ours, theirs)
        statistics = file["statistics"]
        self.assertEqual(int(statistics["messageCount"]), len(messages))
        self.assertEqual(statistics["chunkCount"], len(file["chunks"]))
        self.assertEqual({topics[i]: int(n) for i, n in statistics["channelMessageCounts"]},
                         dict(Counter(topics[m["channelId"]] for m in messages)))
        self.assertEqual(dict(dict(file["metadata"])["run"])["robot"], "finger")
        data = self.run_.log.read_bytes()
        self.assertEqual(file["dataSectionCrc"], mcap.zlib.crc32(data[:int(file["dataEndOffset"])]))
        for topic in set(topics.values()):
            sequences = [m["sequence"] for m in messages if topics[m["channelId"]] == topic]
            self.assertEqual(sorted(sequences), list(range(len(sequences))), topic)

    def test_messages_are_what_their_schemas_say(self):
        try:
            import jsonschema
        except ImportError:
            self.skipTest("Python's jsonschema is not installed; tools/setup --tests installs it")
        file, *messages = self.node("index", self.run_.log)

        def closed(schema):  # a name that the schema lacks is a mistake
            if schema.get("type") != "object":
                return {"type": [schema["type"], "null"]}
            return {"type": "object", "additionalProperties": False,
                    "properties": {name: closed(inner) for name, inner in schema["properties"].items()}}

        schemas = {schema["id"]: jsonschema.Draft202012Validator(closed(json.loads(schema["data"])))
                   for schema in file["schemas"]}
        of_channel = {channel["id"]: schemas[channel["schemaId"]] for channel in file["channels"]}
        for message in messages[::7] + messages[-50:]:
            of_channel[message["channelId"]].validate(json.loads(message["data"]))

    def test_a_file_that_is_cut_at_any_byte_is_read_up_to_its_last_whole_chunk(self):
        data, chunks = self.run_.log.read_bytes(), chunks_of(self.run_.log.read_bytes())
        sizes = cuts(data, chunks)
        found, = self.node("cut", self.run_.log, *sizes)
        self.assertEqual(found, [sum(n for _, end, n in chunks if end <= size) for size in sizes])


if __name__ == "__main__":
    faulthandler.dump_traceback_later(5 * PATIENCE_S, exit=True)  # says where a test hangs
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
