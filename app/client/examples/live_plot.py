#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Draws the error of a running robot and the displacements of its actuators, as they come.

Only watches, so it runs beside whatever operates the robot. Needs python3-matplotlib and python3-tk. The simulated robot
needs no hardware:

    tendril-plant config/diamond.yaml --bus local:/tmp/diamond.bus &
    tendrild config/diamond.yaml --bus local:/tmp/diamond.bus --allow-non-rt --socket /tmp/diamond.sock &
    app/client/examples/live_plot.py /tmp/diamond.sock
"""

import argparse
import sys
import threading
from collections import deque
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt

sys.path.append(str(Path(__file__).resolve().parents[1]))  # where tendril.py lies
from tendril import Robot, State

RATE = 50.0  # of states, Hz
PERIOD = 0.1  # of drawing, s


class History:
    """The last states of a robot, read in a thread of their own, since drawing is slower than they come.

    length: s that are kept
    """

    def __init__(self, robot: Robot, length: float) -> None:
        self.name = robot.name
        self.states: deque[State] = deque(maxlen=max(2, int(length * RATE)))
        self.ended = ""  # why no more states come
        threading.Thread(target=self._read, args=[robot], daemon=True).start()

    def _read(self, robot: Robot) -> None:
        try:
            for state in robot.states(RATE):
                self.states.append(state)
        except OSError as problem:
            self.ended = str(problem)

    def lines(self) -> tuple[list[float], dict[str, list[float]], dict[str, list[float]]]:
        """Times, s, 0 is now; errors by coordinate, mm or ml; displacements by actuator, SI units.

        An error is that of the sensor where one measures the coordinate, else that of the model.
        """
        states = [state for state in self.states.copy() if state["target"]]
        times = [state["time"] - states[-1]["time"] for state in states]
        errors: dict[str, list[float]] = {}
        actuators: dict[str, list[float]] = {}
        for state in states:
            for name, target in state["target"].items():
                measured = (state["measured"].get(name) or {}).get("value")
                unit = 1e6 if name.endswith(".volume") else 1e3
                label = f"{name}, {'model' if name not in state['measured'] else 'measured'}"
                actual = measured if name in state["measured"] else state["model"][name]
                errors.setdefault(label, []).append(float("nan") if actual is None else unit * (actual - target))
            for name, actuator in state["actuators"].items():
                actuators.setdefault(name, []).append(actuator["displacement"])
        return times, errors, actuators


def title_of(history: History) -> str:
    if history.ended:
        return history.ended
    if not history.states:
        return f"{history.name} says nothing yet"
    state = history.states[-1]
    fault = state.get("fault")
    words = [fault["what"], fault["do"]] if fault else state["faults"]
    return ": ".join([f"{history.name}, {state['phase']}, {state['mode']}", *words])


def draw(figure: Any, history: History) -> None:
    """Draws the history anew: errors above, actuators below."""
    times, errors, actuators = history.lines()
    figure.suptitle(title_of(history))
    above, below = figure.axes
    for axes, lines, label in ((above, errors, "error (mm or ml)"), (below, actuators, "displacement (m or m³)")):
        axes.clear()
        for name, values in lines.items():
            axes.plot(times, values, label=name)
        axes.set_ylabel(label)
        axes.grid(True)
        if lines:
            axes.legend(loc="upper left")
    below.set_xlabel("time (s)")


def main() -> None:
    parser = argparse.ArgumentParser(description="Draws the error and the actuators of a running robot as they come.")
    parser.add_argument("socket", help="the same as tendrild was given")
    parser.add_argument("--length", type=float, default=20.0, metavar="S", help="that is shown (default: 20)")
    options = parser.parse_args()
    if plt.get_backend().lower() == "agg":
        sys.exit("live_plot: there is no window to draw in; is DISPLAY set, and python3-tk installed?")
    with Robot(options.socket) as robot:
        history = History(robot, options.length)
        figure, _ = plt.subplots(2, sharex=True, figsize=(9, 6))
        while plt.fignum_exists(figure.number):
            draw(figure, history)
            plt.pause(PERIOD)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
    except ConnectionError as problem:
        sys.exit(f"live_plot: {problem}")
