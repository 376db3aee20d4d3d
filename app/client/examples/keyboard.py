#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Moves a robot with the keys of a terminal, and shows where it is and what is wrong.

The simulated robot needs no hardware:

    tendril-plant config/diamond.yaml --bus local:/tmp/diamond.bus &
    tendrild config/diamond.yaml --bus local:/tmp/diamond.bus --allow-non-rt --socket /tmp/diamond.sock &
    app/client/examples/keyboard.py /tmp/diamond.sock
"""

import argparse
import curses
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1]))  # where tendril.py lies
from tendril import ControlLost, Refused, Robot, State

MOVES = {
    curses.KEY_RIGHT: ("x", 1), curses.KEY_LEFT: ("x", -1),
    curses.KEY_UP: ("y", 1), curses.KEY_DOWN: ("y", -1),
    curses.KEY_PPAGE: ("z", 1), curses.KEY_NPAGE: ("z", -1),
}  # fmt: skip
HELP = "arrows x y   page up/down z   space hold   t take the control   r reset a fault   q quit"


def people_read(name: str, value: float | None) -> str:
    """Millimetres for a position, millilitres for a volume."""
    if value is None:
        return "-"
    return f"{1e6 * value:.2f} ml" if name.endswith(".volume") else f"{1e3 * value:.2f} mm"


def screen_of(robot: str, state: State) -> list[str]:
    """The lines that show a state."""
    lines = [f"{robot}   phase {state['phase']}   mode {state['mode']}   control: {state['control'] or 'nobody'}", ""]
    lines.append(f"{'':20}{'target':>13}{'model':>13}{'measured':>13}")
    for name, target in (state["target"] or {}).items():
        measured = (state["measured"].get(name) or {}).get("value")
        values = (target, state["model"][name], measured)
        lines.append(f"{name:20}" + "".join(f"{people_read(name, value):>13}" for value in values))
    fault = state.get("fault")
    if fault:
        lines += ["", f"fault: {fault['what']}", f"do: {fault['do']}"]
    return lines + [f"now: {words}" for words in state["faults"]]


class Keyboard:
    """What the keys do to one effector. Needs no terminal.

    step: m a key press
    speed: m/s
    """

    def __init__(self, robot: Robot, effector: str, step: float, speed: float) -> None:
        self.robot, self.effector, self.step, self.speed = robot, effector, step, speed
        self.goal: dict[str, float] = {}  # where the keys have asked the effector to be

    def press(self, key: int) -> str:
        """Does what a key says. Returns what to tell the operator."""
        try:
            if key in MOVES:
                return self.move(*MOVES[key])
            if key == ord(" "):
                self.goal = {}
                self.robot.hold()
                return "the robot holds"
            if key == ord("t"):
                self.goal = {}
                self.robot.acquire(steal=True)
                return "the control is yours"
            if key == ord("r"):
                reset = getattr(self.robot, "reset", None)
                if reset is None:
                    return "this version has no reset"
                reset()
                return "the fault is reset"
        except Refused as refusal:
            self.goal = {}
            return str(refusal)
        return ""

    def move(self, axis: str, direction: int) -> str:
        name = f"{self.effector}.{axis}"
        if name not in self.robot.coordinates:
            return f"{name} is not controlled; this robot has {', '.join(self.robot.coordinates)}"
        if name not in self.goal:
            target = self.robot.status()["target"]
            if target is None:
                return "the drives do not follow yet"
            self.goal[name] = target[name]
        goal = {name: self.goal[name] + direction * self.step}
        self.robot.target(goal, speed=self.speed)
        self.goal |= goal
        return f"{name} to {people_read(name, goal[name])}"


def operate(screen: "curses.window", robot: Robot, keyboard: Keyboard) -> None:
    message = keyboard.press(ord(" "))
    screen.timeout(50)  # ms that a key is waited for
    while (key := screen.getch()) != ord("q"):
        message = keyboard.press(key) or message
        lines = [*screen_of(robot.name, robot.status()), "", message, "", HELP]
        screen.erase()
        height, width = screen.getmaxyx()
        for row, line in enumerate(lines[: height - 1]):
            screen.addnstr(row, 0, line, width - 1)
        screen.refresh()


def main() -> None:
    parser = argparse.ArgumentParser(description="Moves a robot with the keys of a terminal.", epilog=HELP)
    parser.add_argument("socket", help="the same as tendrild was given")
    parser.add_argument("--effector", help="that the keys move (default: the first)")
    parser.add_argument("--step", type=float, default=1.0, metavar="MM", help="of a key press (default: 1)")
    parser.add_argument("--speed", type=float, default=20.0, metavar="MM_S", help="of the target (default: 20)")
    options = parser.parse_args()
    with Robot(options.socket) as robot:
        robot.acquire()
        effector = options.effector or robot.coordinates[0].rpartition(".")[0]
        curses.wrapper(operate, robot, Keyboard(robot, effector, 1e-3 * options.step, 1e-3 * options.speed))


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass  # the robot stays at its last target
    except (ConnectionError, ControlLost, Refused, curses.error) as problem:
        sys.exit(f"keyboard: {problem}")
