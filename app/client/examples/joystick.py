#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Moves a robot with a joystick or gamepad. It moves only while a button is pressed, by default the left shoulder button.

Reads the events of Linux itself; `ls /dev/input/js*` shows the devices, and your user must be in their group. The simulated
robot needs no hardware:

    tendril-plant config/diamond.yaml --bus local:/tmp/diamond.bus &
    tendrild config/diamond.yaml --bus local:/tmp/diamond.bus --allow-non-rt --socket /tmp/diamond.sock &
    app/client/examples/joystick.py /tmp/diamond.sock
"""

import argparse
import os
import struct
import sys
import time
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1]))  # where tendril.py lies
from tendril import ControlLost, Refused, Robot

EVENT = struct.Struct("=IhBB")  # struct js_event of <linux/joystick.h>: time in ms, value, type, number
BUTTON, AXIS, INITIAL = 0x01, 0x02, 0x80
DEAD_ZONE = 0.1  # of an axis, since no stick returns exactly to its middle
RATE = 50.0  # of targets, Hz


class Stick:
    """What a joystick's events add up to."""

    def __init__(self) -> None:
        self.axes: dict[int, float] = {}  # -1 to 1
        self.buttons: dict[int, bool] = {}

    def take(self, events: bytes) -> None:
        """Takes whole events, 8 bytes each. The first ones of a device tell how it is (INITIAL)."""
        for _, value, kind, number in EVENT.iter_unpack(events):
            if kind & ~INITIAL == AXIS:
                self.axes[number] = max(-1.0, value / 32767)
            elif kind & ~INITIAL == BUTTON:
                self.buttons[number] = value != 0

    def axis(self, number: int) -> float:
        """Where an axis is beyond the dead zone, -1 to 1."""
        value = self.axes.get(number, 0.0)
        beyond = max(0.0, abs(value) - DEAD_ZONE) / (1 - DEAD_ZONE)
        return beyond if value > 0 else -beyond

    def read(self, device: int) -> None:
        """Takes all that a device has told, without waiting. Raises OSError where it is unplugged."""
        try:
            while events := os.read(device, 64 * EVENT.size):
                self.take(events)
        except BlockingIOError:
            pass


class Drive:
    """Turns a stick into targets: an axis is a speed.

    axes: number of the axis, and 1 or -1, for each coordinate
    button: that must be pressed
    speed: m/s at full deflection
    """

    def __init__(self, robot: Robot, axes: dict[str, tuple[int, int]], button: int, speed: float) -> None:
        self.robot, self.axes, self.button, self.speed = robot, axes, button, speed
        self.goal: dict[str, float] | None = None  # the last target; None: the robot shall stay

    def step(self, stick: Stick) -> str:
        """Sends the target of one period. Returns why the robot does not follow, if so."""
        if not stick.buttons.get(self.button):
            self.goal = None
            self.robot.status()  # tells where the daemon has ended
            return ""
        if self.goal is None:
            target = self.robot.status()["target"]
            if target is None:
                return "the drives do not follow yet"
            self.goal = {name: target[name] for name in self.axes}
        way = self.speed / RATE
        goal = {name: self.goal[name] + sign * way * stick.axis(axis) for name, (axis, sign) in self.axes.items()}
        try:
            self.robot.target(goal, within=2 / RATE)
            self.goal = goal
        except Refused as refusal:
            if refusal.code != "outside_workspace":
                raise
            return str(refusal)
        return ""


def operate(drive: Drive, device: int) -> None:
    stick, told = Stick(), ""
    while True:
        stick.read(device)
        message = drive.step(stick)
        if message and message != told:
            print(message)
        told = message
        time.sleep(1 / RATE)


def main() -> None:
    parser = argparse.ArgumentParser(description="Moves a robot with a joystick or gamepad.")
    parser.add_argument("socket", help="the same as tendrild was given")
    parser.add_argument("--device", default="/dev/input/js0", help="(default: /dev/input/js0)")
    parser.add_argument("--axes", type=int, nargs=3, default=[0, 1, 4], metavar="N", help="for x, y, z (default: 0 1 4)")
    parser.add_argument("--button", type=int, default=4, metavar="N", help="that must be pressed (default: 4)")
    parser.add_argument("--speed", type=float, default=30.0, metavar="MM_S", help="at full deflection (default: 30)")
    options = parser.parse_args()
    try:
        device = os.open(options.device, os.O_RDONLY | os.O_NONBLOCK)
    except OSError as error:
        sys.exit(f"joystick: {options.device}: {error.strerror}; ls /dev/input/js* shows the devices")
    with Robot(options.socket) as robot:
        effector = robot.coordinates[0].rpartition(".")[0]
        # Forward is up on a stick, and counts down.
        all_axes = {f"{effector}.{axis}": (options.axes[k], -1 if k else 1) for k, axis in enumerate("xyz")}
        axes = {name: way for name, way in all_axes.items() if name in robot.coordinates}
        if not axes:
            sys.exit(f"joystick: {effector} is no point")
        robot.acquire()
        robot.hold()
        print(f"hold button {options.button} and move the stick")
        try:
            operate(Drive(robot, axes, options.button, 1e-3 * options.speed), device)
        except OSError as error:
            if isinstance(error, ConnectionError):
                raise
            sys.exit(f"joystick: {options.device} is gone: {error.strerror}")  # the robot stays


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass  # the robot stays at its last target
    except (ConnectionError, ControlLost, Refused) as problem:
        sys.exit(f"joystick: {problem}")
