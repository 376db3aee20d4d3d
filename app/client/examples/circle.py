#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""usage: circle.py SOCKET [TURNS]

Leads a robot along a circle of 4 mm radius, ten times or TURNS times; along a line if it has one coordinate only.

The simulated robot needs no hardware:

    tendril-plant config/diamond.yaml --bus local:/tmp/diamond.bus &
    tendrild config/diamond.yaml --bus local:/tmp/diamond.bus --allow-non-rt --socket /tmp/diamond.sock &
    app/client/examples/circle.py /tmp/diamond.sock 10
"""

import math
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1]))  # where tendril.py lies
from tendril import ControlLost, Refused, Robot


def main(path: str, turns: int = 10, seconds: float = 4.0, rate: int = 100) -> None:
    with Robot(path) as robot:
        robot.acquire()
        robot.hold()  # stay here, whatever you did
        start = next(robot.states())["target"]
        axes = [name for name in robot.coordinates if not name.endswith(".volume")][:2]

        def circle(angle: float) -> dict[str, float]:
            way = (0.004 * math.sin(angle), 0.004 * (1 - math.cos(angle)))
            return {name: start[name] + step for name, step in zip(axes, way)}

        samples = int(turns * seconds * rate)
        robot.stream((circle(2 * math.pi * turns * k / samples) for k in range(samples + 1)), rate)


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    try:
        main(sys.argv[1], *map(int, sys.argv[2:]))
    except KeyboardInterrupt:
        pass  # the robot stays at its last target
    except (ConnectionError, ControlLost, Refused) as problem:
        sys.exit(f"circle: {problem}")
