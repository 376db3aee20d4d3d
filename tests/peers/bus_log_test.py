#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""A run from start to stop, as candump logs it and canmatrix reads it with the DBC that tendrild prints.

Alone on the bus, and while cangen floods it.
"""

import collections
import contextlib
import csv
import json
import unittest

import bench
import bus_log
import cia402

DRIVES = ("right", "left")
RATE_HZ = 100
STROKE_MM = (-3, 6)
TOP_SPEED_MM_S = 30
TRACE_MM = 1e-4  # the resolution of trace.csv
TRACE_N = 1e-5  # likewise of efforts
RADIUS_MM = 5
MOVED_MM = 0.3  # so far at least is an axis to go in a run
PULLED_NM = 1e-4  # so much more a cable
CYCLES = 50  # of its motion, at least
# So many targets are waited for: the first few may be from before the cycles that follow targets.
WAITED_FOR = 2 * CYCLES
COUNT_MM = 2 * 3.141592653589793 * RADIUS_MM / 65536
RATED_NM = 0.02


class Run:
    """What a run has left: entries of the bus log, rows of the trace while targets were followed, the summary."""

    def __init__(self, robot, log, flooded=False):
        self.foreign = collections.Counter()
        self.entries = log.entries(robot.dbc(), self.is_foreign if flooded else lambda *_: False)
        with open(robot.report / "trace.csv") as file:
            self.rows = [row for row in csv.DictReader(file) if row["phase"] in ("approach", "run")]
        self.summary = json.loads((robot.report / "summary.json").read_text())

    def is_foreign(self, identifier, data):
        kind = "remote" if data.startswith("R") else "extended" if len(identifier) > 3 else identifier
        self.foreign[kind] += 1
        return kind in ("remote", "extended", bench.STRANGER)

    def of(self, name):
        return [entry for entry in self.entries if entry.name == name]

    def signals(self, name, signal):
        return [entry.signals[signal] for entry in self.of(name)]

    def trace_mm(self, column):
        return [1e3 * float(row[column]) for row in self.rows]


def spans_of(protocol, torques=()):
    """What a run is to show: the signals of the targets, and by how much they are to change.

    torques: the drives that are told torques, not positions
    """
    message = {"canopen": "RPDO", "odrive": "input"}[protocol]
    return {
        (f"Drive_{drive}_{message}", "target_torque" if drive in torques else "target_position"): (
            PULLED_NM if drive in torques else MOVED_MM
        )
        for drive in DRIVES
    }


def run_until_enough(robot, watch, enough=lambda: True):
    """Lets the daemon run until the bus has shown enough, however long that takes, and ends it with SIGTERM.

    enough: says whether what else is needed has come
    Returns its exit code and what it said.
    """
    with robot.start_daemon() as daemon:
        bench.wait_until(
            lambda: daemon.ended() or (watch.enough() and enough()),
            lambda: f"a motion of each target; so far: {watch.text()}",
            [robot.plant or daemon, daemon],
        )
        code = daemon.exit_code() if daemon.ended() else daemon.terminate()
        return code, daemon.said()


def wait_for_rest(log, protocol):
    """Until each drive has told with a heartbeat that it was left as it was found."""
    for node in (1, 2):
        if protocol == "canopen":
            bench.wait_until(lambda: log.last(f"70{node}") == "7F", f"node {node} pre-operational")
        else:
            heartbeat = f"{node << 5 | 1:03X}"
            bench.wait_until(lambda: (log.last(heartbeat) or "")[8:10] == "01", f"axis {node} idle")


def run_with_plant(protocol, flooded=False, changes=(), torques=()):
    """A run of daemon and simulated robot.

    flooded: while others talk
    changes: of the robot file, as for bench.finger
    torques: the drives that are told torques
    """
    with contextlib.ExitStack() as stack:
        robot = stack.enter_context(bench.Bench(bench.finger(protocol, changes)))
        log = stack.enter_context(bus_log.BusLog(robot.folder))
        if flooded:
            stack.enter_context(robot.flood(gap_ms=10 if bench.PATIENCE_S > 60 else 1))  # less where emulated
        robot.start_plant()
        watch = stack.enter_context(bus_log.Watch(robot.dbc(), spans_of(protocol, torques), WAITED_FOR))

        def others_were_heard():
            return not flooded or min(log.count_foreign(bench.STRANGER).values()) > 2 * CYCLES

        code, said = run_until_enough(robot, watch, others_were_heard)
        if code == 0:
            wait_for_rest(log, protocol)
        assert robot.plant.terminate() == 0, robot.plant.said()
        # In an emulated machine, which takes seconds for a step, drives are silent for longer than they may be.
        if code != 0 and robot.share_of_steps_missed() > 50:
            bench.skip(f"the machine is too slow to simulate the finger: {said}")
        assert code == 0, said
        return Run(robot, log, flooded)


class BusTest(unittest.TestCase):
    def check_summary(self, run):
        self.assertEqual(run.summary["faults"], [])
        # The controller's queue overflows where nobody reads for a third of a second: that is a stall of the machine,
        # and in an emulated one may come before the first cycle, where nothing tells of it.
        if bench.PATIENCE_S <= 60 and max(run.summary["wakeup_us"]["max"], run.summary["cycle_us"]["max"]) < 1e5:
            self.assertEqual(run.summary["bus_dropped"], 0)
        self.assertGreaterEqual(len(run.rows), CYCLES)

    def check_targets(self, run, drive, targets, resolution):
        """The targets on the bus are those of the trace, one a cycle, and keep to the actuator's limits."""
        close = resolution / 2 + TRACE_MM / 2 + 1e-9
        self.check_carried(drive, targets, run.trace_mm(f"command_{drive}_m"), close)
        self.assertTrue(all(STROKE_MM[0] <= target <= STROKE_MM[1] for target in targets))
        steps = [abs(b - a) for a, b in zip(targets, targets[1:])]
        self.assertLessEqual(max(steps), TOP_SPEED_MM_S / RATE_HZ + 2 * close)
        self.assertGreater(max(targets) - min(targets), MOVED_MM, "it did not move")

    def check_torques(self, run, drive, torques, resolution):
        """The torques on the bus are those of the efforts in the trace, one a cycle."""
        traced = [1e-3 * RADIUS_MM * float(row[f"effort_{drive}_N"]) for row in run.rows]
        self.check_carried(drive, torques, traced, resolution / 2 + 1e-3 * RADIUS_MM * TRACE_N / 2 + 1e-9)
        self.assertGreater(max(torques) - min(torques), PULLED_NM, "it never pulled more")

    def check_carried(self, drive, targets, traced, close):
        def begins_at(start):
            return all(abs(target - value) <= close for target, value in zip(targets[start:], traced))

        starts = range(len(targets) - len(traced) + 1)
        self.assertTrue(any(begins_at(start) for start in starts), f"{drive}: the trace is not what the bus carried")

    def check_positions(self, run, drive, positions):
        """The positions of the trace are those of the bus, in order; a cycle may see several, or none that is new."""
        at = 0
        for value in run.trace_mm(f"displacement_{drive}_m"):
            while at < len(positions) and abs(positions[at] - value) > TRACE_MM / 2 + 1e-9:
                at += 1
            self.assertLess(at, len(positions), f"{drive}: {value} mm was not on the bus")


class Cia402BusTest(BusTest):
    @classmethod
    def setUpClass(cls):
        cls.run_ = run_with_plant("canopen")

    def test_trace_and_bus_agree(self):
        self.check_summary(self.run_)
        for drive in DRIVES:
            targets = self.run_.signals(f"Drive_{drive}_RPDO", "target_position")
            self.check_targets(self.run_, drive, targets, COUNT_MM)
            self.check_positions(self.run_, drive, self.run_.signals(f"Drive_{drive}_TPDO", "actual_position"))

    def test_each_sync_follows_one_target_and_brings_one_position_of_each_drive(self):
        for node, drive in enumerate(DRIVES, start=1):
            operational = False
            targets = syncs = unanswered = 0
            for entry in self.run_.entries:
                if entry.name == "NMT" and entry.signals["node"] == node:
                    operational = entry.signals["command"] == cia402.START
                elif entry.name == "SYNC" and operational:
                    syncs += 1
                    unanswered += 1
                elif entry.name == f"Drive_{drive}_TPDO":
                    unanswered -= 1
                    self.assertGreaterEqual(unanswered, 0, "a position that no SYNC asked for")
                elif entry.name == f"Drive_{drive}_RPDO":
                    targets += 1
                    self.assertLessEqual(targets, syncs, "two targets in a cycle")
            self.assertEqual(unanswered, 0)
            self.assertGreaterEqual(targets, len(self.run_.rows))

    def test_sync_keeps_to_the_rate(self):
        # A late cycle leaves a gap and is not made up for: from any SYNC to any later one it takes the periods between
        # them, or one less where the first was late. The log's clock may be set right meanwhile, by 2 % at most.
        syncs = self.run_.of("SYNC")
        latest_s = float("-inf")
        for i, entry in enumerate(syncs):
            late_s = 1.02 * (entry.time_s - syncs[0].time_s) - i / RATE_HZ
            latest_s = max(latest_s, late_s)
            self.assertGreater(late_s, latest_s - 1 / RATE_HZ - 1e-4, "late cycles were made up for")
        self.assertGreaterEqual(len(syncs), CYCLES)

    def test_a_drive_is_enabled_and_disabled_step_by_step_and_without_a_jump(self):
        for drive in DRIVES:
            words = cia402.without_repeats(self.run_.signals(f"Drive_{drive}_RPDO", "controlword"))
            self.assertEqual([0x00, 0x06, 0x07, 0x0F, 0x07, 0x06, 0x00], words)
            states = cia402.without_repeats(
                cia402.state_of(word) for word in self.run_.signals(f"Drive_{drive}_TPDO", "statusword")
            )
            up = ["switch on disabled", "ready to switch on", "switched on", "operation enabled"]
            self.assertEqual(up + up[-2::-1], states)
            position = None
            for entry in self.run_.entries:
                if entry.name == f"Drive_{drive}_TPDO":
                    position = entry.signals["actual_position"]
                elif entry.name == f"Drive_{drive}_RPDO" and entry.signals["controlword"] == 0x0F:
                    self.assertEqual(position, entry.signals["target_position"])
                    break

    def test_a_drive_is_set_up_in_pre_operational_and_left_there(self):
        for drive in DRIVES:
            states = cia402.without_repeats(self.run_.signals(f"Drive_{drive}_heartbeat", "nmt_state"))
            self.assertEqual([0, 127, 5, 127], states)
            answers = self.run_.signals(f"Drive_{drive}_SDO_answer", "command")
            self.assertEqual(len(answers), len(self.run_.of(f"Drive_{drive}_SDO_request")))
            self.assertNotIn(0x80, answers, "an SDO transfer was aborted")
            self.assertEqual([], self.run_.of(f"Drive_{drive}_EMCY"))
        self.assertEqual({5}, set(self.run_.signals("Tendril_heartbeat", "nmt_state")))


class FloodTest(Cia402BusTest):
    """The same while others talk: data frames, remote frames of any identifier, ours among them, and extended ones."""

    @classmethod
    def setUpClass(cls):
        cls.run_ = run_with_plant("canopen", flooded=True)

    def test_all_kinds_of_foreign_frames_were_there(self):
        for kind in ("remote", "extended", bench.STRANGER):
            self.assertGreater(self.run_.foreign[kind], CYCLES, kind)
        self.assertLess(self.run_.summary["bus_load"], 0.2)  # which counts our frames only


class OdriveBusTest(BusTest):
    @classmethod
    def setUpClass(cls):
        cls.run_ = run_with_plant("odrive")

    def test_trace_and_bus_agree(self):
        self.check_summary(self.run_)
        for drive in DRIVES:
            targets = self.run_.signals(f"Drive_{drive}_input", "target_position")
            self.check_targets(self.run_, drive, targets, 1e-6)
            self.check_positions(self.run_, drive, self.run_.signals(f"Drive_{drive}_estimates", "position"))

    def test_an_axis_is_closed_loop_only_between_its_two_orders_and_without_an_error(self):
        for drive in DRIVES:
            orders = self.run_.signals(f"Drive_{drive}_state", "requested_state")
            self.assertEqual([8, 1], cia402.without_repeats(orders))
            states = cia402.without_repeats(self.run_.signals(f"Drive_{drive}_heartbeat", "axis_state"))
            self.assertEqual([1, 8, 1], states)
            self.assertEqual({0}, set(self.run_.signals(f"Drive_{drive}_heartbeat", "axis_error")))
            self.assertEqual({(3, 1)}, {tuple(e.signals.values()) for e in self.run_.of(f"Drive_{drive}_mode")})

    def test_the_first_target_is_where_the_axis_stands(self):
        for drive in DRIVES:
            position = None
            for entry in self.run_.entries:
                if entry.name == f"Drive_{drive}_estimates":
                    position = entry.signals["position"]
                elif entry.name == f"Drive_{drive}_input":
                    self.assertAlmostEqual(position, entry.signals["target_position"], 6)
                    break


class EffortBusTest(BusTest):
    """One axis follows efforts, the other displacements."""

    def run_on(self, protocol, drive):
        return run_with_plant(protocol, torques=["left"], changes=[
            ("node: 2, ", f"node: 2, {drive}, "),
            ("stroke: -3 6 mm", "stroke: -30 60 mm")])  # an axis on efforts turns on while its controller stalls

    def test_cia402_torques_are_the_efforts_of_the_trace(self):
        run = self.run_on("canopen", f"setpoint: effort, rated_torque: {RATED_NM} Nm")
        self.check_summary(run)
        self.check_torques(run, "left", run.signals("Drive_left_RPDO", "target_torque"), 1e-3 * RATED_NM)
        self.check_targets(run, "right", run.signals("Drive_right_RPDO", "target_position"), COUNT_MM)

    def test_odrive_torques_are_the_efforts_of_the_trace(self):
        run = self.run_on("odrive", "setpoint: effort")
        self.check_summary(run)
        self.check_torques(run, "left", run.signals("Drive_left_input", "target_torque"), 1e-9)
        self.check_targets(run, "right", run.signals("Drive_right_input", "target_position"), 1e-6)
        self.assertEqual({(1, 1)}, {tuple(entry.signals.values()) for entry in run.of("Drive_left_mode")})
        self.assertEqual({(3, 1)}, {tuple(entry.signals.values()) for entry in run.of("Drive_right_mode")})


if __name__ == "__main__":
    bench.main()
