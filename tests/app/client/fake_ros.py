# SPDX-License-Identifier: Apache-2.0
"""What the bridge needs of ROS 2, without ROS 2: messages that are as strict as the real ones, a node, a goal.

The real message classes assert the type of each value and know no other field than their own; so do these.
"""

import sys
import threading
import time
import types


class Message:
    FIELDS = {}  # name: type, or [type] for a sequence

    def __init__(self, **values):
        for name, kind in self.FIELDS.items():
            object.__setattr__(self, name, [] if isinstance(kind, list) else b"\x00" if kind is bytes else kind())
        for name, value in values.items():
            setattr(self, name, value)

    def __setattr__(self, name, value):
        kind = self.FIELDS[name]  # KeyError: there is no such field
        for element in value if isinstance(kind, list) else [value]:
            wanted = kind[0] if isinstance(kind, list) else kind
            if type(element) is not wanted:
                raise AssertionError(f"{type(self).__name__}.{name} is of {wanted.__name__}, not {element!r}")
        if kind is bytes and len(value) != 1:
            raise AssertionError(f"{type(self).__name__}.{name} is one byte")
        object.__setattr__(self, name, value)


def kind(class_name, constants=(), /, **fields):
    return type(class_name, (Message,), {"FIELDS": fields, **dict(constants)})


Time = kind("Time", sec=int, nanosec=int)
Duration = kind("Duration", sec=int, nanosec=int)
Header = kind("Header", stamp=Time, frame_id=str)
Point = kind("Point", x=float, y=float, z=float)
PointStamped = kind("PointStamped", header=Header, point=Point)
JointState = kind("JointState", header=Header, name=[str], position=[float], velocity=[float], effort=[float])
KeyValue = kind("KeyValue", key=str, value=str)
DiagnosticStatus = kind(
    "DiagnosticStatus", {"OK": b"\x00", "WARN": b"\x01", "ERROR": b"\x02", "STALE": b"\x03"},
    level=bytes, name=str, message=str, hardware_id=str, values=[KeyValue])  # fmt: skip
DiagnosticArray = kind("DiagnosticArray", header=Header, status=[DiagnosticStatus])
JointTrajectoryPoint = kind(
    "JointTrajectoryPoint", positions=[float], velocities=[float], accelerations=[float], effort=[float], time_from_start=Duration)
JointTrajectory = kind("JointTrajectory", header=Header, joint_names=[str], points=[JointTrajectoryPoint])
JointTolerance = kind("JointTolerance", name=str, position=float, velocity=float, acceleration=float)


class FollowJointTrajectory:
    Goal = kind("Goal", trajectory=JointTrajectory, path_tolerance=[JointTolerance], goal_tolerance=[JointTolerance],
                goal_time_tolerance=Duration)  # fmt: skip
    Result = kind("Result", {"SUCCESSFUL": 0, "INVALID_GOAL": -1, "INVALID_JOINTS": -2, "OLD_HEADER_TIMESTAMP": -3,
                             "PATH_TOLERANCE_VIOLATED": -4, "GOAL_TOLERANCE_VIOLATED": -5},
                  error_code=int, error_string=str)  # fmt: skip
    Feedback = kind("Feedback", header=Header, joint_names=[str], desired=JointTrajectoryPoint, actual=JointTrajectoryPoint,
                    error=JointTrajectoryPoint)  # fmt: skip


class Trigger:
    Request = kind("Request")
    Response = kind("Response", success=bool, message=str)


def install():
    """Lets the bridge import its messages."""
    for name, classes in {
        "builtin_interfaces.msg": [Time], "control_msgs.action": [FollowJointTrajectory],
        "diagnostic_msgs.msg": [DiagnosticArray, DiagnosticStatus, KeyValue], "geometry_msgs.msg": [Point, PointStamped],
        "sensor_msgs.msg": [JointState], "std_msgs.msg": [Header], "std_srvs.srv": [Trigger],
        "trajectory_msgs.msg": [JointTrajectoryPoint],
    }.items():  # fmt: skip
        module = types.ModuleType(name)
        module.__dict__.update({each.__name__: each for each in classes})
        sys.modules[name] = module
        sys.modules[name.partition(".")[0]] = types.ModuleType(name.partition(".")[0])


class FakeNode:
    """Keeps what is published, by topic, and what is logged."""

    def __init__(self):
        self.published, self.subscriptions, self.services, self.timers = {}, {}, {}, []
        self.logged = []

    def get_logger(self):
        return self

    def info(self, text):
        self.logged.append(("info", text))

    def warning(self, text, throttle_duration_sec=None):
        self.logged.append(("warning", text))

    def error(self, text):
        self.logged.append(("error", text))

    def get_clock(self):
        return self

    def now(self):
        return types.SimpleNamespace(nanoseconds=time.time_ns())

    def create_publisher(self, message_type, name, qos):
        messages = self.published.setdefault(name, [])

        def publish(message):
            if type(message) is not message_type:
                raise TypeError(f"{name} is of {message_type}")
            messages.append(message)

        return types.SimpleNamespace(publish=publish)

    def create_subscription(self, message_type, name, callback, qos):
        self.subscriptions[name] = (message_type, callback, qos)
        return callback

    def create_service(self, service_type, name, callback):
        self.services[name] = lambda: callback(service_type.Request(), service_type.Response())

    def create_timer(self, period, callback):
        self.timers.append(callback)


class FakeGoal:
    """The handle of a goal. canceled() needs a request to cancel, and there is one end, as in rclpy."""

    def __init__(self, request):
        self.request = request
        self.is_cancel_requested = False
        self.feedback, self.end = [], None
        self.began = threading.Event()

    def publish_feedback(self, feedback):
        if type(feedback) is not FollowJointTrajectory.Feedback:
            raise TypeError
        self.feedback.append(feedback)
        self.began.set()

    def _finish(self, how):
        if self.end:
            raise AssertionError(f"{how} after {self.end}")
        self.end = how

    def succeed(self):
        self._finish("succeeded")

    def abort(self):
        self._finish("aborted")

    def canceled(self):
        if not self.is_cancel_requested:
            raise AssertionError("nobody has asked to cancel")
        self._finish("canceled")
