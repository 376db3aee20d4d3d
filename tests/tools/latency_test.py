#!/usr/bin/python3
"""What tendril-latency promises to who calls it. No figure is judged: only that it is there, and what follows."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = sys.argv.pop(1)
ROBOT = ROOT / "config/finger.yaml"
PATIENCE_S = 120


def start(*arguments):
    # Tests run without the rights of real time, too.
    return subprocess.Popen([PROGRAM, "--allow-non-rt", *map(str, arguments)], stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True)


def finish(process):
    out, err = process.communicate(timeout=PATIENCE_S)
    return process.returncode, out, err


def run(*arguments):
    return finish(start(*arguments))


def wait_for_progress(process):
    """Until it measures."""
    while " cycles " not in (line := process.stderr.readline()):
        if not line:
            raise AssertionError(f"it has ended, with {process.wait()}")


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
            (("--timer", "--limit", "solve:99:1"), "--timer has no stage solve"),
            (("--timer", "--load", "noise"), "noise"),
            (("--timer", "--rate", "0"), "--rate"),
            (("--timer", "--priority", "99"), "--priority"),
            (("--timer", "--bus", "vcan0"), "--timer has no bus"),
            ((ROBOT, "--bus", "can77"), "found 'can77', expected a virtual CAN interface"),
            (("no-such-robot.yaml",), "no-such-robot.yaml"),
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
        heard = Path("/sys/class/net/vcan0/statistics/tx_packets")
        before = int(heard.read_text())
        code, out, err = run("--rate", 50, "--duration", 2, "--bus", "vcan0", "--json", ROBOT)
        self.assertEqual(code, 0, err)
        found = json.loads(out)
        self.assertEqual((found["bus"], found["problems"]), ("vcan0", []))
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
                if load == "unmap":
                    self.assertIn("load", names(f"/proc/{process.pid}/task").values())
                else:
                    self.assertIn(workers[load], names("/proc").values())
                process.send_signal(signal.SIGINT)
                code, out, err = finish(process)
                self.assertEqual(code, 0, err)
                self.assertEqual(json.loads(out)["load"], [load])

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
