#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What tendril-latency promises to who calls it. No figure is judged: only that it is there, and what follows."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))
from own_interface import own_interface

PROGRAM = sys.argv.pop(1)
PATIENCE_S = 60 * float(os.environ.get("TENDRIL_PATIENCE", 1))  # as tests/patience.h has it
FOLDER = tempfile.TemporaryDirectory(prefix="tendril-latency-")
ABSENT = Path(FOLDER.name) / "no-such-robot.yaml"


def patient_finger():
    """config/finger.yaml for a machine that stalls: drives that are silent meanwhile, and a model that is old, are no
    fault, and the QP's cap is not the machine's."""
    text = (ROOT / "config/finger.yaml").read_text()
    for old, new in (
        ("file: finger.msh", f"file: {ROOT}/config/finger.msh"),
        ("rate: 600 Hz", "rate: 600 Hz\n  iteration_cap: 32"),
        ("snapshot_age_limit: 500 ms", "snapshot_age_limit: 300 s"),
        ("target_age_limit: 500 ms", "target_age_limit: 300 s"),
        ("heartbeat_timeout: 150 ms", "heartbeat_timeout: 60 s\n  feedback_timeout: 60 s\n  sdo_timeout: 20 s\n"
            "  boot_timeout: 10 s\n  enable_timeout: 60 s\n  disable_timeout: 10 s"),
    ):
        if old not in text:
            raise AssertionError(f"config/finger.yaml has no '{old}'")
        text = text.replace(old, new)
    file = Path(FOLDER.name) / "finger.yaml"
    file.write_text(text)
    return file


ROBOT = patient_finger()


def start(*arguments):
    # Tests run without the rights of real time, too.
    process = subprocess.Popen([PROGRAM, "--allow-non-rt", *map(str, arguments)], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
    process.end_of_patience = threading.Timer(PATIENCE_S, process.kill)  # so that no reading waits for ever
    process.end_of_patience.daemon = True
    process.end_of_patience.start()
    return process


def finish(process):
    out, err = process.communicate()
    process.end_of_patience.cancel()
    if process.returncode == -signal.SIGKILL:
        raise AssertionError(f"{process.args} had not ended after {PATIENCE_S} s; it said: {out}{err}")
    return process.returncode, out, err


def run(*arguments):
    return finish(start(*arguments))


def wait_for_progress(process):
    """Until it measures."""
    said = ""
    while " cycles " not in (line := process.stderr.readline()):
        said += line
        if not line:
            raise AssertionError(f"{process.args} ended with {process.wait()}, or was ended after {PATIENCE_S} s, "
                                 f"before it measured; it said: {said}")


def names(folder):
    """Of all processes or threads in it, by their identifiers."""
    found = {}
    for entry in Path(folder).glob("[0-9]*"):
        try:
            found[int(entry.name)] = (entry / "comm").read_text().rstrip("\n")
        except OSError:
            pass  # it has just ended
    return found


def child_of(process, name):
    for pid, found in names("/proc").items():
        if found == name and int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1]) == process.pid:
            return pid
    raise AssertionError(f"{process.pid} has no child {name}")


class LatencyTest(unittest.TestCase):
    def test_wrong_arguments_are_explained_before_anything_runs(self):
        for arguments, said in (
            ((), "a robot file or --timer is needed"),
            ((ROBOT, "--timer"), "either a robot file or --timer, not both"),
            (("--timer", "--limit", "sleep:99:1"), "found 'sleep:99:1', expected STAGE:PERCENT:US"),
            (("--timer", "--limit", "wakeup:101:1"), "found 'wakeup:101:1'"),
            (("--timer", "--limit", "wakeup:99"), "found 'wakeup:99'"),
            (("--timer", "--limit", "wakeup:99:1,whole:99:1"), "found 'wakeup:99:1,whole:99:1'"),
            (("--timer", "--limit", "solve:99:1"), "--timer has no stage solve"),
            (("--timer", "--load", "noise"), "noise"),
            (("--timer", "--rate", "0"), "--rate"),
            (("--timer", "--priority", "99"), "--priority"),
            (("--timer", "--bus", "vcan0"), "--timer has no bus"),
            ((ROBOT, "--bus", "nosuchcan0"), "found 'nosuchcan0', expected a virtual CAN interface"),
            ((ABSENT,), ABSENT.name),
        ):
            with self.subTest(arguments=arguments):
                code, out, err = run(*arguments)
                self.assertEqual((code, out), (2, ""), err)
                self.assertIn(said, err)

    def test_a_cpu_that_is_not_there_is_refused(self):
        code, _, err = run("--timer", "--cpu", 1000)
        self.assertEqual(code, 3, err)
        self.assertIn("1000", err)

    def test_the_json_of_the_timer_names_the_machine_and_has_no_work(self):
        code, out, err = run("--timer", "--rate", 500, "--duration", 0.3, "--json")
        self.assertEqual(code, 0, err)
        found = json.loads(out)
        self.assertEqual(found["what"], "timer")
        self.assertEqual(set(found["stages"]), {"wakeup", "whole"})
        machine = found["machine"]
        self.assertEqual(machine["kernel"].split()[0], os.uname().release)
        self.assertEqual(machine["command_line"], Path("/proc/cmdline").read_text().rstrip("\n"))
        for key in ("preemption", "cpu", "cpus", "governor", "isolated_cpus", "virtual_machine"):
            self.assertIn(key, machine)

    def test_the_robot_s_cycle_has_all_stages_and_every_deadline(self):
        code, out, err = run("--rate", 200, "--duration", 0.5, "--json", "--limit", "whole:100:1e9", ROBOT)
        self.assertEqual(code, 0, err)
        found = json.loads(out)
        self.assertEqual(list(found["stages"]), ["wakeup", "read", "solve", "write", "whole"])
        self.assertEqual((found["rate_hz"], found["bus"], found["load"], found["problems"]), (200, "local", [], []))
        self.assertGreater(found["model_rate_hz"], 0)
        self.assertGreaterEqual(found["cycles"], 100)
        for stage in ("read", "solve", "write"):
            counted = sum(count for _, _, count in found["stages"][stage]["buckets"])
            self.assertEqual(counted, found["cycles"] - found["late"])
        self.assertRegex(found["scheduling"], r"^SCHED_(FIFO 80|OTHER 0)$")
        self.assertIn(found["heap_calls"], (0, None))  # sanitizers keep them from being counted
        if found["memory_locked"] and found["heap_calls"] == 0:
            self.assertEqual(found["page_faults"], 0)

    def test_the_bus_may_be_a_virtual_can_interface(self):
        if not Path("/sys/class/net/vcan0").exists():
            self.skipTest("no vcan0; tools/vcan brings one")
        interface = own_interface()
        heard = Path(f"/sys/class/net/{interface}/statistics/tx_packets")
        before = int(heard.read_text())
        code, out, err = run("--rate", 50, "--duration", 2, "--bus", interface, "--json", ROBOT)
        self.assertEqual(code, 0, err)
        found = json.loads(out)
        self.assertEqual((found["bus"], found["problems"]), (interface, []))
        # Each of the cycles that were worked off has sent a frame at least, and a drive has answered.
        self.assertGreater(int(heard.read_text()) - before, 2 * (found["cycles"] - found["late"]))

    def test_every_load_is_there_while_it_measures(self):
        workers = {"cpu": "stress-ng-cpu", "memory": "stress-ng-vm", "disk": "stress-ng-hdd", "faults": "stress-ng-fault"}
        known = re.search(r"--load TEXT:\{([a-z,]+)\}", run("--help")[1])[1].split(",")
        self.assertEqual(set(known), {"unmap", *workers})
        for load in known:
            with self.subTest(load=load):
                if load != "unmap" and shutil.which("stress-ng") is None:
                    self.skipTest("stress-ng is missing")
                process = start("--timer", "--load", load, "--json")
                wait_for_progress(process)
                worker, folder = ("load", f"/proc/{process.pid}/task") if load == "unmap" else (workers[load], "/proc")
                # stress-ng takes its time until it works.
                while worker not in names(folder).values() and process.poll() is None:
                    time.sleep(0.01)
                self.assertIn(worker, names(folder).values())
                process.send_signal(signal.SIGINT)
                code, out, err = finish(process)
                self.assertEqual(code, 0, err)
                self.assertEqual(json.loads(out)["load"], [load])

    def test_a_load_ends_with_a_program_that_is_killed(self):
        if shutil.which("stress-ng") is None:
            self.skipTest("stress-ng is missing")
        process = start("--timer", "--load", "cpu")
        wait_for_progress(process)
        load = child_of(process, "stress-ng")
        process.end_of_patience.cancel()
        process.kill()
        process.wait()  # not for the end of what it said: a load that goes on holds its pipes
        process.stdout.close()
        process.stderr.close()
        stat = Path(f"/proc/{load}/stat")
        end = time.monotonic() + PATIENCE_S
        while stat.exists() and stat.read_text().rpartition(")")[2].split()[0] != "Z":
            if time.monotonic() > end:
                os.killpg(load, signal.SIGKILL)
                self.fail("stress-ng went on")
            time.sleep(0.01)

    def test_a_load_that_dies_is_told_and_no_figure_lost(self):
        if shutil.which("stress-ng") is None:
            self.skipTest("stress-ng is missing")
        process = start("--timer", "--load", "cpu", "--json")
        wait_for_progress(process)
        os.kill(child_of(process, "stress-ng"), signal.SIGKILL)
        wait_for_progress(process)
        process.send_signal(signal.SIGINT)
        code, out, err = finish(process)
        self.assertEqual(code, 1, err)
        self.assertGreater(json.loads(out)["cycles"], 100)
        self.assertIn("stress-ng ended by itself", json.loads(out)["problems"][0])

    def test_a_report_that_cannot_be_written_is_refused_before_anything_is_measured(self):
        code, out, err = run("--timer", "--report", "/proc/no")
        self.assertEqual((code, out), (2, ""), err)
        self.assertIn("/proc/no", err)

    def test_a_limit_that_is_broken_gives_exit_code_1_and_one_that_is_met_does_not(self):
        code, out, err = run("--timer", "--duration", 0.2, "--limit", "wakeup:99.9:0")
        self.assertEqual(code, 1, err)
        self.assertIn("BROKEN  wakeup: 99.9 % within", out)
        code, out, err = run("--timer", "--duration", 0.2, "--limit", "wakeup:99.9:1e9", "--limit", "whole:100:1e9")
        self.assertEqual(code, 0, err)
        self.assertEqual(len(re.findall("^met ", out, re.MULTILINE)), 2)

    def test_ctrl_c_ends_a_run_with_results(self):
        for what in (("--timer",), (ROBOT, "--rate", 200)):
            with self.subTest(what=what):
                process = start(*what, "--json")
                wait_for_progress(process)
                process.send_signal(signal.SIGINT)
                code, out, err = finish(process)
                self.assertEqual(code, 0, err)
                self.assertGreater(json.loads(out)["cycles"], 100)

    def test_a_report_is_left_for_others(self):
        with tempfile.TemporaryDirectory() as folder:
            code, _, err = run(ROBOT, "--rate", 200, "--duration", 0.2, "--report", folder)
            self.assertEqual(code, 0, err)
            self.assertEqual(json.loads((Path(folder) / "latency.json").read_text())["rate_hz"], 200)
            if "no pictures" in err:
                self.skipTest("python3-matplotlib is missing")
            for name in ("latency.png", "latency.svg"):
                self.assertGreater((Path(folder) / name).stat().st_size, 1000)
            page = (Path(folder) / "report.html").read_text()
            self.assertIn(os.uname().release, page)
            self.assertNotRegex(page, r'(src|href)="(?!data:)')  # whole in itself


if __name__ == "__main__":
    sys.exit(unittest.main())
