"""Operates a soft robot that tendrild controls, from Python.

    with Robot("/run/tendril/diamond.sock") as robot:
        robot.acquire()
        robot.target({"tip.z": 0.13}, speed=0.02)
        for state in robot.states(rate=50):
            print(state["model"], state["measured"])

docs/control-protocol.md describes commands and states. All values are in SI units. Needs Python 3.11 and nothing else.
"""

import json
import socket
import time
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

PROTOCOL = 1

Coordinates = Mapping[str, float]
State = dict[str, Any]


class Refused(Exception):
    """The daemon has refused a request. code: a word for programs; the text is a sentence for people."""

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code


class ControlLost(Exception):
    """Another client has taken the control away."""


class Robot:
    """A connection to a running daemon. Not for several threads at once.

    path: of the daemon's socket
    timeout: s that an answer may take
    """

    def __init__(self, path: str | Path, timeout: float = 5.0) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(timeout)
        try:
            self._socket.connect(str(path))
            self._lines = self._socket.makefile("r", encoding="utf-8", newline="\n")
            self.greeting: dict[str, Any] = self._read()
        except OSError as error:
            self._socket.close()
            raise ConnectionError(f"no daemon at {path}: {error.strerror or error}") from error
        if self.greeting.get("version") != PROTOCOL:
            self._socket.close()
            raise ConnectionError(f"{path}: whoever listens there does not speak version {PROTOCOL} of the protocol")
        self._last_id = 0
        self._events: deque[dict[str, Any]] = deque()

    def __enter__(self) -> "Robot":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Ends the connection; the daemon then takes the control back, and the robot stays at its last target."""
        self._lines.close()
        self._socket.close()

    @property
    def name(self) -> str:
        return self.greeting["robot"]

    @property
    def coordinates(self) -> list[str]:
        """Of all effectors, such as "tip.x" (m) or "chamber.volume" (m³)."""
        return self.greeting["coordinates"]

    def status(self) -> State:
        return self._ask("status")["state"]

    def acquire(self, steal: bool = False) -> None:
        """Takes the control, which commands that move the robot need. steal: from whoever has it."""
        self._ask("acquire", steal=steal)

    def release(self) -> None:
        self._ask("release")

    def target(
        self,
        position: Coordinates,
        *,
        velocity: Coordinates | None = None,
        within: float | None = None,
        speed: float | None = None,
    ) -> None:
        """Sends the effectors to a position in a straight line, and returns at once.

        position: coordinates that are not named stay where they are wanted
        within: s until the position is reached
        velocity: with which to go on from there until the next target, at most for the target age limit
        speed: m/s, instead of within
        """
        more = {"velocity": velocity, "in": within, "speed": speed}
        self._ask("target", position=position, **{key: value for key, value in more.items() if value is not None})

    def stream(self, positions: Iterable[Coordinates], rate: float) -> None:
        """Sends positions one after the other, rate of them a second; returns after the last one.

        Each is to be reached when the one after the next is sent: one that is late by less than a period is not felt.
        """
        begin = time.monotonic()
        for k, position in enumerate(positions):
            time.sleep(max(0.0, begin + k / rate - time.monotonic()))
            self.target(position, within=2 / rate)

    def play(self) -> None:
        """Follows the path of the robot file from its beginning."""
        self._ask("play")

    def pause(self) -> None:
        self._ask("pause")

    def resume(self) -> None:
        self._ask("resume")

    def hold(self) -> None:
        """Stays where the effectors are wanted now."""
        self._ask("hold")

    def set_path_rate(self, rate: float) -> None:
        """rate: how fast time passes on the path, 0 to 1"""
        self._ask("set", path_rate=rate)

    def disable(self) -> None:
        """Brings the robot to a halt and disables its drives; the daemon goes on watching them."""
        self._ask("disable")

    def enable(self) -> None:
        """Enables the drives again, where they stand. The robot holds there once its state is in phase "run"."""
        self._ask("enable")

    def reset(self) -> None:
        """After a fault, in phase "standby": takes note of it and enables the drives again, as enable() does."""
        self._ask("reset")

    def stop(self) -> None:
        """Ends the run; the drives are disabled."""
        self._ask("stop")

    def states(self, rate: float = 10.0) -> Iterator[State]:
        """States as they come, rate of them a second, until the daemon ends or the iterator is left."""
        self._ask("subscribe", rate=rate)
        try:
            while True:
                message = self._next()
                if message.get("event") == "control_lost":
                    raise ControlLost(message["to"])
                if "state" in message:
                    yield message["state"]
        finally:
            self._ask("subscribe", rate=0)

    def _ask(self, command: str, **more: Any) -> dict[str, Any]:
        self._last_id += 1
        request = {"id": self._last_id, "version": PROTOCOL, "command": command, **more}
        self._socket.sendall(json.dumps(request, allow_nan=False).encode() + b"\n")
        while (answer := self._read()).get("id") != self._last_id or "ok" not in answer:
            if "event" in answer:
                self._events.append(answer)  # states that come in between are not missed
        if not answer["ok"]:
            raise Refused(answer["error"]["code"], answer["error"]["message"])
        return answer

    def _next(self) -> dict[str, Any]:
        if self._events:
            return self._events.popleft()
        while "ok" in (message := self._read()):
            pass
        return message

    def _read(self) -> dict[str, Any]:
        line = self._lines.readline()
        if not line.endswith("\n"):
            raise ConnectionError("the daemon has ended")
        return json.loads(line)
