#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A ROS 2 node for a robot that tendrild controls. docs/ros2.md describes its topics, services and action.

The simulated robot needs no hardware:

    tendril-plant config/diamond.yaml --bus local:/tmp/diamond.bus &
    tendrild config/diamond.yaml --bus local:/tmp/diamond.bus --allow-non-rt --socket /tmp/diamond.sock &
    . /opt/ros/humble/setup.sh
    app/client/examples/ros2_bridge.py --ros-args -p socket:=/tmp/diamond.sock
"""

import math
import re
import sys
import threading
import time
from bisect import bisect_right
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from builtin_interfaces.msg import Time
from control_msgs.action import FollowJointTrajectory
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, PointStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectoryPoint

sys.path.append(str(Path(__file__).resolve().parents[1]))  # where tendril.py lies
from tendril import Refused, Robot, State

RATE = 50.0  # of states and of the targets of a trajectory, Hz
STREAM_PERIOD = 0.05  # s in which a streamed target is reached
TARGET_AGE = 0.5  # s; an older target is not followed
PATIENCE = 1.0  # s that the daemon's answer, or a goal's tolerance, is waited for
SERVICES = ("hold", "resume", "reset", "stop", "enable", "disable")

Result = FollowJointTrajectory.Result
T = TypeVar("T")


class Ended(Exception):
    """A trajectory has ended before its end. code: of FollowJointTrajectory; None where it was cancelled"""

    def __init__(self, code: int | None, text: str) -> None:
        super().__init__(text)
        self.code = code


def seconds(duration: Any) -> float:
    return float(duration.sec + 1e-9 * duration.nanosec)


def actual(state: State, name: str) -> float:
    """Where a coordinate is: by its sensor where there is one, else by the model."""
    measured = state["measured"].get(name)
    return float(measured["value"] if measured else state["model"][name])


class Way:
    """The trajectory of a goal, linear between its points. Raises Ended where it is none.

    names: of its coordinates
    start: where they are wanted now; the way begins there unless its first point is of time 0
    """

    def __init__(self, trajectory: Any, start: dict[str, float]) -> None:
        self.names = list(trajectory.joint_names)
        unknown = [name for name in self.names if name not in start]
        if unknown or not self.names:
            raise Ended(Result.INVALID_JOINTS, f"joint_names are some of {', '.join(start)}; not {unknown}")
        self.times = [seconds(point.time_from_start) for point in trajectory.points]
        self.points = [list(point.positions) for point in trajectory.points]
        if not self.points:
            raise Ended(Result.INVALID_GOAL, "the trajectory has no points")
        for k, point in enumerate(self.points):
            if len(point) != len(self.names) or not all(map(math.isfinite, point)):
                raise Ended(Result.INVALID_GOAL, f"point {k} needs {len(self.names)} finite positions")
            if self.times[k] < 0 or (k > 0 and self.times[k] <= self.times[k - 1]):
                raise Ended(Result.INVALID_GOAL, f"time_from_start of point {k} is not after the one before")
        self.times.insert(0, 0.0)
        self.points.insert(0, [start[name] for name in self.names])

    def at(self, t: float) -> dict[str, float]:
        k = bisect_right(self.times, t)
        if k == len(self.times):
            return dict(zip(self.names, self.points[-1]))
        share = (t - self.times[k - 1]) / (self.times[k] - self.times[k - 1])
        return {name: a + share * (b - a) for name, a, b in zip(self.names, self.points[k - 1], self.points[k])}


class Bridge:
    """What the node does, apart from rclpy: node needs only what rclpy.node.Node has.

    frame: in which the robot file has its coordinates
    speed: m/s at which a streamed target that is far away is approached
    qos: of the streamed targets
    """

    def __init__(self, node: Any, socket: str, frame: str, speed: float, qos: Any) -> None:
        self.node, self.socket, self.frame, self.speed, self.qos = node, socket, frame, speed, qos
        self.log = node.get_logger()
        self.state: State | None = None
        self.problem = ""  # why there is no state
        self.name = "robot"
        self._robot: Robot | None = None
        self._lock = threading.Lock()  # of the connection
        self._mover: object = None  # whoever has asked last for a motion; an older trajectory then ends
        self._publishers: dict[str, Any] = {}
        self._subscriptions: dict[str, Any] = {}
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        for name in SERVICES:
            node.create_service(Trigger, f"~/{name}", partial(self.serve, name))
        node.create_timer(1 / RATE, self.poll)
        node.create_timer(1.0, self.diagnose)

    def close(self) -> None:
        """Ends the connection; the robot stays at its last target."""
        self._mover = None
        with self._lock:
            if self._robot:
                self._robot.close()
            self._robot, self.problem = None, "the bridge ends"

    # The connection

    def _lose(self, problem: Exception) -> None:
        if self._robot:
            self._robot.close()
        self._robot, self.state = None, None
        if str(problem) != self.problem:
            self.log.error(f"{problem}; connects again when it can")
        self.problem = str(problem)

    def _ask(self, question: Callable[[Robot], T], mover: object = None) -> T:
        """Asks the daemon, and takes the control where that is needed and free.

        mover: the trajectory that asks; raises Ended where another motion was asked for since it began
        """
        with self._lock:
            if mover and self._mover is not mover:
                raise Ended(Result.INVALID_GOAL, "another motion was asked for")
            if self._robot is None:
                raise ConnectionError(self.problem or f"not yet connected to {self.socket}")
            try:
                try:
                    return question(self._robot)
                except Refused as refusal:
                    if refusal.code != "no_control":
                        raise
                self._robot.acquire()
                return question(self._robot)
            except ConnectionError as problem:
                self._lose(problem)
                raise

    def poll(self) -> None:
        """Publishes a state; connects where there is no connection."""
        try:
            with self._lock:
                if self._robot is None:
                    self._robot = Robot(self.socket, timeout=PATIENCE)
                    self.name, self.problem = self._robot.name, ""
                    self.log.info(f"connected to {self.name} at {self.socket}")
                    self._subscribe(self._robot.coordinates)
            self.state = self._ask(Robot.status)
        except ConnectionError as problem:
            with self._lock:
                self._lose(problem)
            return
        self._publish(self.state)

    def _subscribe(self, coordinates: list[str]) -> None:
        for effector in dict.fromkeys(name.rpartition(".")[0] for name in coordinates if not name.endswith(".volume")):
            if effector not in self._subscriptions:
                self._subscriptions[effector] = self.node.create_subscription(
                    PointStamped, f"~/{topic(effector)}/target", partial(self.follow_target, effector), self.qos)  # fmt: skip

    # States

    def _stamp(self, instant: float) -> Any:
        """ROS time of an instant of the daemon's clock, s of CLOCK_MONOTONIC."""
        ns = self.node.get_clock().now().nanoseconds - round(1e9 * (time.monotonic() - instant))
        return Time(sec=ns // 10**9, nanosec=ns % 10**9)

    def _send(self, name: str, message: Any) -> None:
        if name not in self._publishers:
            self._publishers[name] = self.node.create_publisher(type(message), name, 10)
        self._publishers[name].publish(message)

    def _publish(self, state: State) -> None:
        header = Header(stamp=self._stamp(state["time"]), frame_id=self.frame)
        actuators = state["actuators"]
        self._send("~/actuators", JointState(
            header=header, name=list(actuators),
            position=[float(actuator["displacement"]) for actuator in actuators.values()],
            effort=[float(actuator["effort"]) for actuator in actuators.values()]))  # fmt: skip
        if state["model"] is None:
            return
        names = list(state["model"])
        self._send("~/effectors", JointState(header=header, name=names, position=[float(state["model"][n]) for n in names]))
        values = {name: sample["value"] for name, sample in state["measured"].items() if sample}
        for effector in self._subscriptions:
            for what, source in (("target_now", state["target"]), ("model", state["model"]), ("measured", values)):
                x, y, z = (float(source.get(f"{effector}.{axis}", math.nan)) for axis in "xyz")
                if not (math.isnan(x) and math.isnan(y) and math.isnan(z)):
                    point = PointStamped(header=header, point=Point(x=x, y=y, z=z))
                    self._send(f"~/{topic(effector)}/{what}", point)

    def diagnose(self) -> None:
        """Publishes whether the robot is well, and what to do where it is not."""
        status = DiagnosticStatus(name=f"tendril: {self.name}", hardware_id=self.name)
        state = self.state
        if state is None:
            status.level, status.message = DiagnosticStatus.ERROR, self.problem or "not yet connected"
        else:
            fault = state.get("fault")
            values = {key: state[key] for key in ("phase", "mode", "control", "cycles", "late_cycles", "snapshot_age")}
            if fault:
                status.level, status.message = DiagnosticStatus.ERROR, f"{fault['what']}; {fault['do']}"
                values |= {f"fault {key}": value for key, value in fault.items()}
            elif state["faults"] or state["phase"] in ("stop", "disable", "stopped"):
                status.level, status.message = DiagnosticStatus.WARN, "; ".join([state["phase"], *state["faults"]])
            else:
                status.level, status.message = DiagnosticStatus.OK, state["phase"]
            status.values = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        header = Header(stamp=self._stamp(time.monotonic()))
        self._diagnostics.publish(DiagnosticArray(header=header, status=[status]))

    # Motion

    def serve(self, name: str, _: Any, response: Any) -> Any:
        """One of SERVICES. A trajectory that runs ends."""
        self._mover = None
        try:
            method = getattr(Robot, name, None)
            if method is None:
                raise Refused("unknown_command", f"tendril.py has no {name}")
            self._ask(method)
            response.success, response.message = True, name
        except (ConnectionError, Refused) as problem:
            response.success, response.message = False, str(problem)
        return response

    def follow_target(self, effector: str, message: Any) -> None:
        """A streamed target. One that cannot be followed is told, and the robot stays at the last one."""
        age = self.node.get_clock().now().nanoseconds * 1e-9 - seconds(message.header.stamp)
        state = self.state
        start = (state["target"] if state else None) or {}
        position = {f"{effector}.{axis}": getattr(message.point, axis) for axis in "xyz" if f"{effector}.{axis}" in start}
        problem = ""
        if not position:
            problem = self.problem or "the drives do not follow yet"
        elif message.header.frame_id not in ("", self.frame):
            problem = f"frame_id is {self.frame}, not {message.header.frame_id}; tf2 transforms"
        elif not all(map(math.isfinite, position.values())):
            problem = f"{position} is not finite"
        elif seconds(message.header.stamp) and age > TARGET_AGE:
            problem = f"its stamp is {age:.1f} s old; are the clocks of the machines the same?"
        else:
            self._mover = None
            way = math.dist(position.values(), [start[name] for name in position])
            try:
                self._ask(lambda robot: robot.target(position, within=max(STREAM_PERIOD, way / self.speed)))
            except (ConnectionError, Refused) as refusal:
                problem = str(refusal)
        if problem:
            self.log.warning(f"target of {effector}: {problem}", throttle_duration_sec=1.0)

    def follow(self, goal: Any) -> Any:
        """Follows a trajectory of effector coordinates; the execute callback of FollowJointTrajectory."""
        self._mover = mover = object()
        try:
            self._follow(goal, mover)
        except Ended as end:
            if end.code is None:
                goal.canceled()
                return Result(error_code=Result.SUCCESSFUL, error_string=str(end))
            goal.abort()
            return Result(error_code=end.code, error_string=str(end))
        except (ConnectionError, Refused) as problem:
            goal.abort()
            return Result(error_code=Result.INVALID_GOAL, error_string=str(problem))
        goal.succeed()
        return Result(error_code=Result.SUCCESSFUL)

    def _follow(self, goal: Any, mover: object) -> None:
        request = goal.request
        start = self._state(goal, mover)["target"]
        way = Way(request.trajectory, start)
        first, last = way.at(0.0), way.at(math.inf)
        self._ask(lambda robot: robot.target(first), mover)  # at the daemon's speed, since the way says none
        self._arrive(goal, mover, first)
        begin, t = time.monotonic(), 0.0
        while t < way.times[-1] + 2 / RATE:
            t = time.monotonic() - begin
            ahead = way.at(t + 2 / RATE)
            self._ask(lambda robot: robot.target(ahead, within=2 / RATE), mover)
            state = self._state(goal, mover)
            desired = way.at(t)
            self._feed_back(goal, state, desired, t)
            self._demand(Result.PATH_TOLERANCE_VIOLATED, request.path_tolerance, state, desired)
            time.sleep(1 / RATE)
        self._arrive(goal, mover, last)
        end = time.monotonic() + (seconds(request.goal_time_tolerance) or PATIENCE)
        while True:
            try:
                return self._demand(Result.GOAL_TOLERANCE_VIOLATED, request.goal_tolerance, self._state(goal, mover), last)
            except Ended:
                if time.monotonic() > end:
                    raise
            time.sleep(1 / RATE)

    def _arrive(self, goal: Any, mover: object, position: dict[str, float]) -> None:
        """Waits until the target is at a position."""
        while any(abs(self._state(goal, mover)["target"][name] - value) > 1e-9 for name, value in position.items()):
            time.sleep(1 / RATE)

    def _state(self, goal: Any, mover: object) -> State:
        """The state now. Raises Ended where the trajectory must end."""
        if goal.is_cancel_requested:
            self._ask(Robot.hold, mover)
            raise Ended(None, "cancelled; the robot holds")
        state = self._ask(Robot.status, mover)
        if state["phase"] != "run":
            fault = state.get("fault")
            words = [fault["what"], fault["do"]] if fault else state["faults"]
            raise Ended(Result.INVALID_GOAL, "; ".join([f"the robot is in phase {state['phase']}", *words]))
        return state

    def _demand(self, code: int, tolerances: Any, state: State, desired: dict[str, float]) -> None:
        """Raises Ended, and holds, where the robot is out of a tolerance; 0 and below mean none."""
        for tolerance in tolerances:
            if tolerance.position > 0 and tolerance.name in desired:
                error = abs(actual(state, tolerance.name) - desired[tolerance.name])
                if error > tolerance.position:
                    if code == Result.PATH_TOLERANCE_VIOLATED:
                        self._ask(Robot.hold)
                    raise Ended(code, f"{tolerance.name} is off by {error:.6f}; its tolerance is {tolerance.position:.6f}")

    def _feed_back(self, goal: Any, state: State, desired: dict[str, float], t: float) -> None:
        where = {name: actual(state, name) for name in desired}
        error = [desired[name] - where[name] for name in desired]

        def point(values: Any) -> Any:
            result = JointTrajectoryPoint(positions=list(values))
            result.time_from_start.sec, result.time_from_start.nanosec = int(t), int(1e9 * (t % 1))
            return result

        goal.publish_feedback(FollowJointTrajectory.Feedback(
            header=Header(stamp=self._stamp(state["time"]), frame_id=self.frame), joint_names=list(desired),
            desired=point(desired.values()), actual=point(where.values()), error=point(error)))  # fmt: skip


def topic(effector: str) -> str:
    """The name of an effector as ROS allows it: letters, digits and _, no digit first."""
    return re.sub(r"^(?=\d)", "e", effector.replace("-", "_"))


def main() -> None:
    import rclpy
    from rclpy.action import ActionServer, CancelResponse
    from rclpy.callback_groups import ReentrantCallbackGroup
    from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
    from rclpy.node import Node
    from rclpy.qos import QoSProfile, ReliabilityPolicy

    rclpy.init()
    node = Node("tendril")
    socket = node.declare_parameter("socket", "/run/tendril/diamond.sock").value
    frame = node.declare_parameter("frame", "base_link").value
    speed = node.declare_parameter("speed", 0.05).value
    # Only the newest target counts; best effort takes it from a publisher of any reliability.
    bridge = Bridge(node, socket, frame, speed, QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
    server = ActionServer(
        node, FollowJointTrajectory, "~/follow_joint_trajectory", bridge.follow,
        callback_group=ReentrantCallbackGroup(), cancel_callback=lambda _: CancelResponse.ACCEPT)  # fmt: skip
    executor = MultiThreadedExecutor(num_threads=4)  # a trajectory keeps one; the rest goes on beside it
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        bridge.close()
        server.destroy()
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
