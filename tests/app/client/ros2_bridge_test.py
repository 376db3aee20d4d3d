#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 bridge between a node and a daemon that are both of the test: there is no ROS 2 in Debian."""

import array
import math
import threading
import time
import unittest

import fake_ros
from fake_daemon import OFFSET_M, PATIENCE_S, FakeDaemon, wait_until

fake_ros.install()
import ros2_bridge
from fake_ros import DiagnosticStatus, FakeGoal, FakeNode, FollowJointTrajectory, Header, JointTolerance, Point, PointStamped, Time

ros2_bridge.PATIENCE = PATIENCE_S  # for answers; a test for whose goal it matters sets it
Result = FollowJointTrajectory.Result
QOS = object()


def point_of(values, t):
    duration = fake_ros.Duration(sec=int(t), nanosec=round(1e9 * (t % 1)))
    point = fake_ros.JointTrajectoryPoint(time_from_start=duration)
    object.__setattr__(point, "positions", array.array("d", values))  # as a real message has them
    return point


def goal_of(names, *points, **more):
    trajectory = fake_ros.JointTrajectory(joint_names=names, points=[point_of(values, t) for t, values in points])
    return FakeGoal(FollowJointTrajectory.Goal(trajectory=trajectory, **more))


def tolerance(name, position):
    return JointTolerance(name=name, position=position)


class BridgeTest(unittest.TestCase):
    def setUp(self):
        self.daemon = self.enterContext(FakeDaemon())
        self.node = FakeNode()
        self.bridge = self.bridge_to(self.daemon)
        self.bridge.poll()

    def bridge_to(self, daemon):
        bridge = ros2_bridge.Bridge(self.node, str(daemon.path), "base_link", 0.05, QOS)
        self.addCleanup(bridge.close)
        return bridge

    def asked(self, command):
        return [request for request in self.daemon.requests if request["command"] == command]

    def last(self, name):
        return self.node.published[name][-1]

    def diagnosis(self):
        self.bridge.diagnose()
        (status,) = self.last("/diagnostics").status
        return status

    def stream(self, x, y, z, frame="base_link", stamp=None):
        message_type, callback, qos = self.node.subscriptions["~/tip/target"]
        self.assertIs(qos, QOS)
        header = Header(frame_id=frame, stamp=stamp or Time())
        callback(message_type(header=header, point=Point(x=x, y=y, z=z)))

    def follow(self, goal):
        """Follows a goal in a thread. Returns a function that waits for its end and gives the result."""
        results = []
        thread = threading.Thread(target=lambda: results.append(self.bridge.follow(goal)))
        thread.start()

        def result():
            thread.join(PATIENCE_S)
            return results[0]

        return result


class StateTest(BridgeTest):
    def test_a_state_becomes_points_and_joint_states(self):
        self.stream(0.01, 0.02, 0.03)
        wait_until(lambda: self.daemon.target()["tip.z"] == 0.03, "the target to be reached")
        before = time.time()
        self.bridge.poll()
        for name, shift in (("target_now", 0), ("model", 0), ("measured", OFFSET_M)):
            message = self.last(f"~/tip/{name}")
            self.assertEqual(message.header.frame_id, "base_link")
            for axis, value in zip("xyz", (0.01, 0.02, 0.03)):
                self.assertAlmostEqual(getattr(message.point, axis), value + shift)
        actuators = self.last("~/actuators")
        self.assertEqual((actuators.name, actuators.position, actuators.effort), (["north"], [0.001], [3.0]))
        stamp = actuators.header.stamp.sec + 1e-9 * actuators.header.stamp.nanosec
        self.assertGreater(stamp, before - 1e-3)  # of the ROS clock, though the daemon's is another one
        self.assertLess(stamp, time.time() + 1e-3)
        effectors = self.last("~/effectors")
        self.assertEqual(effectors.name, ["tip.x", "tip.y", "tip.z"])
        self.assertEqual(effectors.position, [0.01, 0.02, 0.03])

    def test_what_is_not_controlled_is_nan_and_a_volume_is_no_point(self):
        daemon = self.enterContext(FakeDaemon(["1-tip.x", "chamber.volume"]))
        self.bridge_to(daemon).poll()
        point = self.last("~/e1_tip/model").point
        self.assertEqual(point.x, 0.0)
        self.assertTrue(math.isnan(point.y) and math.isnan(point.z))
        self.assertEqual(self.last("~/effectors").name, ["1-tip.x", "chamber.volume"])
        self.assertNotIn("~/chamber/model", self.node.published)

    def test_before_the_run_there_are_no_effectors(self):
        self.node.published.clear()
        self.daemon.phase = "enable"
        self.bridge_to(self.daemon).poll()
        self.assertEqual(len(self.last("~/actuators").name), 1)
        self.assertNotIn("~/tip/model", self.node.published)

    def test_diagnostics_tell_the_fault_and_what_to_do(self):
        self.assertEqual((self.diagnosis().level, self.diagnosis().message), (DiagnosticStatus.OK, "run"))
        self.daemon.faults = ["late"]
        self.bridge.poll()
        self.assertEqual((self.diagnosis().level, self.diagnosis().message), (DiagnosticStatus.WARN, "run; late"))
        self.daemon.more = {"fault": {"what": "silent drive", "since": 1.5, "do": "look at its cable"}}
        self.bridge.poll()
        status = self.diagnosis()
        self.assertEqual((status.level, status.message), (DiagnosticStatus.ERROR, "silent drive; look at its cable"))
        self.assertEqual(status.hardware_id, "fake")
        self.assertIn(("fault do", "look at its cable"), [(value.key, value.value) for value in status.values])

    def test_a_daemon_that_ends_is_told_once_and_waited_for(self):
        self.daemon.end()
        for _ in range(3):
            self.bridge.poll()
        self.assertEqual(self.diagnosis().level, DiagnosticStatus.ERROR)
        self.assertIn("no daemon at", self.diagnosis().message)
        self.assertLessEqual(len([text for level, text in self.node.logged if level == "error"]), 2)
        self.stream(0.01, 0.0, 0.0)
        self.assertIn("no daemon at", self.node.logged[-1][1])
        after = self.enterContext(FakeDaemon())
        self.bridge.socket = str(after.path)
        self.bridge.poll()
        self.assertEqual(self.diagnosis().level, DiagnosticStatus.OK)


class MotionTest(BridgeTest):
    def test_a_streamed_target_takes_the_control_and_no_more_speed_than_allowed(self):
        self.stream(0.001, 0.0, 0.0)
        self.assertEqual(len(self.asked("acquire")), 1)
        near = self.asked("target")[-1]
        self.assertEqual((near["position"]["tip.x"], near["in"]), (0.001, ros2_bridge.STREAM_PERIOD))
        self.stream(0.0, 0.08, 0.0)
        self.assertAlmostEqual(self.asked("target")[-1]["in"], 0.08 / 0.05)

    def test_a_target_that_cannot_be_followed_is_told(self):
        now = time.time()
        for words, target in (
            ("frame_id is base_link, not world", {"frame": "world"}),
            ("its stamp is ", {"stamp": Time(sec=int(now) - 2, nanosec=0)}),
            ("not finite", {"x": math.nan}),
            ("outside control.workspace", {"x": 1.0}),
        ):
            count = len(self.node.logged)
            self.stream(**{"x": 0.0, "y": 0.0, "z": 0.0} | target)
            self.assertEqual(len(self.node.logged), count + 1, words)
            self.assertIn(words, self.node.logged[-1][1])
        self.stream(0.0, 0.0, 0.0, stamp=Time(sec=int(time.time()) + 1, nanosec=0))
        self.assertEqual(len(self.node.logged), count + 1)

    def test_services_answer_with_what_the_daemon_says(self):
        response = self.node.services["~/hold"]()
        self.assertEqual((response.success, response.message), (True, "hold"))
        self.assertEqual(len(self.asked("hold")), 2)  # refused, since without the control, then done
        self.assertTrue(self.node.services["~/resume"]().success)
        if not hasattr(ros2_bridge.Robot, "reset"):
            self.assertEqual(self.node.services["~/reset"]().message, "tendril.py has no reset")
        self.assertTrue(self.node.services["~/stop"]().success)
        response = self.node.services["~/hold"]()
        self.assertEqual((response.success, response.message), (False, "the robot does not follow"))

    def test_a_trajectory_is_followed_to_its_end(self):
        names = ["tip.z", "tip.x"]
        goal = goal_of(names, (0.3, [0.0, 0.01]), (0.6, [0.02, 0.01]), goal_tolerance=[tolerance("tip.z", 2 * OFFSET_M)])
        result = self.follow(goal)()
        self.assertEqual((goal.end, result.error_code, result.error_string), ("succeeded", Result.SUCCESSFUL, ""))
        self.assertEqual(self.daemon.target(), {"tip.x": 0.01, "tip.y": 0.0, "tip.z": 0.02})
        for target in self.asked("target")[1:]:  # first along x, then along z
            x, z = target["position"]["tip.x"], target["position"]["tip.z"]
            self.assertTrue(z == 0 or abs(x - 0.01) < 1e-12, target)
        for feedback in goal.feedback:
            self.assertEqual(feedback.joint_names, names)
            for desired, actual, error in zip(feedback.desired.positions, feedback.actual.positions, feedback.error.positions):
                self.assertAlmostEqual(error, desired - actual)
            self.assertGreaterEqual(feedback.actual.positions[0], OFFSET_M - 1e-12)  # the sensor's

    def test_a_trajectory_that_begins_at_time_0_waits_until_the_robot_is_at_its_beginning(self):
        goal = goal_of(["tip.x"], (0.0, [0.005]), (0.1, [0.006]))
        self.assertEqual(self.follow(goal)().error_code, Result.SUCCESSFUL)
        approach, first = self.asked("target")[1:3]  # after the one that was refused for want of the control
        self.assertEqual(approach["position"], {"tip.x": 0.005})
        self.assertNotIn("in", approach)
        self.assertGreaterEqual(first["position"]["tip.x"], 0.005)

    def test_a_trajectory_that_is_none_is_aborted_with_the_reason(self):
        for code, words, goal in (
            (Result.INVALID_JOINTS, "some of tip.x, tip.y, tip.z; not ['knee']", goal_of(["knee"], (1, [0.0]))),
            (Result.INVALID_JOINTS, "some of tip.x", goal_of([], (1, []))),
            (Result.INVALID_GOAL, "no points", goal_of(["tip.x"])),
            (Result.INVALID_GOAL, "point 0 needs 1 finite", goal_of(["tip.x"], (1, [0.0, 0.0]))),
            (Result.INVALID_GOAL, "point 0 needs 1 finite", goal_of(["tip.x"], (1, [math.inf]))),
            (Result.INVALID_GOAL, "of point 1 is not after", goal_of(["tip.x"], (1, [0.0]), (1, [0.1]))),
            (Result.INVALID_GOAL, "outside control.workspace", goal_of(["tip.x"], (0, [5.0]))),
        ):
            result = self.bridge.follow(goal)
            self.assertEqual((goal.end, result.error_code), ("aborted", code))
            self.assertIn(words, result.error_string)

    def test_a_trajectory_that_is_cancelled_holds_the_robot(self):
        goal = goal_of(["tip.x"], (600, [0.09]))
        result = self.follow(goal)
        goal.began.wait(PATIENCE_S)
        goal.is_cancel_requested = True
        result()
        self.assertEqual(goal.end, "canceled")
        self.assertEqual(self.daemon.mode, "hold")

    def test_whoever_asks_last_moves_the_robot(self):
        for other in (lambda: self.node.services["~/hold"](), lambda: self.stream(0.001, 0.0, 0.0),
                      lambda: self.bridge.follow(goal_of(["tip.y"], (0.05, [0.001])))):  # fmt: skip
            goal = goal_of(["tip.x"], (600, [0.09]))
            result = self.follow(goal)
            goal.began.wait(PATIENCE_S)
            other()
            count = len(self.asked("target"))
            self.assertEqual(result().error_string, "another motion was asked for")
            self.assertEqual(goal.end, "aborted")
            self.assertEqual(len(self.asked("target")), count)

    def test_a_robot_that_stops_or_ends_aborts_the_trajectory(self):
        goal = goal_of(["tip.x"], (600, [0.09]))
        result = self.follow(goal)
        goal.began.wait(PATIENCE_S)
        self.daemon.more = {"fault": {"what": "silent drive", "since": 1.5, "do": "look at its cable"}, "phase": "standby"}
        self.assertIn("silent drive; look at its cable", result().error_string)
        self.daemon.more = {}
        goal = goal_of(["tip.x"], (600, [0.09]))
        result = self.follow(goal)
        goal.began.wait(PATIENCE_S)
        self.daemon.end()
        self.assertIn("the daemon", result().error_string)
        self.assertEqual(goal.end, "aborted")

    def test_a_tolerance_is_demanded_where_the_goal_says_one(self):
        goal = goal_of(["tip.x"], (600, [0.09]), path_tolerance=[tolerance("tip.x", 0.5 * OFFSET_M)])
        result = self.bridge.follow(goal)
        self.assertEqual((goal.end, result.error_code), ("aborted", Result.PATH_TOLERANCE_VIOLATED))
        self.assertIn("tip.x is off by 0.0001", result.error_string)
        self.assertEqual(self.daemon.mode, "hold")
        brief = fake_ros.Duration(sec=0, nanosec=1)
        goal = goal_of(["tip.x"], (0.01, [0.0]), goal_tolerance=[tolerance("tip.x", 0.5 * OFFSET_M)], goal_time_tolerance=brief)
        self.assertEqual(self.bridge.follow(goal).error_code, Result.GOAL_TOLERANCE_VIOLATED)
        for none in (0.0, -1.0):
            goal = goal_of(["tip.x"], (0.01, [0.0]), path_tolerance=[tolerance("tip.x", none)])
            self.assertEqual(self.bridge.follow(goal).error_code, Result.SUCCESSFUL)


if __name__ == "__main__":
    unittest.main(verbosity=2)
