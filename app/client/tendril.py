# SPDX-License-Identifier: Apache-2.0
"""Operates a soft robot that tendrild controls, from Python.

    with Robot("/run/tendril/diamond.sock") as robot:
        robot.acquire()
        robot.target({"tip.z": 0.13}, speed=0.02)
        for state in robot.states(rate=50):
            print(state["model"], state["measured"])

docs/control-protocol.md describes commands and states. All values are in SI units. Needs Python 3.10 and nothing else.
The folder examples beside this file shows more.
"""

import contextlib
import json
import socket
import time
from collections import deque
from collections.abc import Generator, Iterable, Mapping
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
    """Another client has taken the control away; the text names it."""


class Robot:
    """A connection to a running daemon. Not for several threads at once: each makes one of its own.

    path: of the daemon's socket
    timeout: s that an answer may take

    Every method raises ConnectionError once the daemon has ended or does not answer. The object is then of no more use: make a
    new one, and acquire again. The robot has stayed at its last target meanwhile.
    """

    def __init__(self, path: str | Path, timeout: float = 5.0) -> None:
        self._timeout = timeout
        self._received = b""
        self._last_id = 0
        self._events: deque[dict[str, Any]] = deque(maxlen=100)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._socket.settimeout(timeout)
        try:
            self._socket.connect(str(path))
            self.greeting = self._read()
            if self.greeting.get("version") != PROTOCOL:
                raise ConnectionError(f"whoever listens there does not speak version {PROTOCOL} of the protocol")
        except OSError as error:
            self._socket.close()
            raise ConnectionError(f"no daemon at {path}: {error.strerror or error}") from error

    def __enter__(self) -> "Robot":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Ends the connection; the daemon then takes the control back, and the robot stays at its last target."""
        self._socket.close()

    @property
    def name(self) -> str:
        return str(self.greeting["robot"])

    @property
    def coordinates(self) -> list[str]:
        """Of all effectors, such as "tip.x" (m) or "chamber.volume" (m³)."""
        return list(self.greeting["coordinates"])

    def status(self) -> State:
        """The state of the newest cycle."""
        return dict(self._ask("status")["state"])

    def acquire(self, steal: bool = False) -> None:
        """Takes the control, which commands that move the robot need. steal: from whoever has it."""
        self._ask("acquire", steal=steal)

    def release(self) -> None:
        """Gives the control back."""
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

    def go_to(self, position: Coordinates, *, within: float | None = None, speed: float | None = None) -> State:
        """As target(), but returns when the target has come there, with the state then.

        Raises Refused where the robot stops on the way, and ControlLost.
        """
        self.target(position, within=within, speed=speed)
        with contextlib.closing(self.states(rate=50)) as states:
            for state in states:
                if state["phase"] != "run":
                    fault = state.get("fault")
                    words = [fault["what"], fault["do"]] if fault else state["faults"]
                    raise Refused("not_running", "; ".join(["the robot stops", *words]))
                if all(abs(state["target"][name] - value) < 1e-9 for name, value in position.items()):
                    return state
        raise ConnectionError("the daemon has ended")

    def stream(self, positions: Iterable[Coordinates], rate: float) -> float:
        """Sends positions one after the other, rate of them a second; returns after the last one is sent.

        Each is to be reached two periods after its turn. One that is late by less than a period catches up. If one is later
        than that, it and all after it are put off: the robot goes the whole way, never faster than the positions say.
        Returns how long the stream was put off, s.
        """
        period, put_off = 1 / rate, 0.0
        turn = time.monotonic()
        for position in positions:
            time.sleep(max(0.0, turn - time.monotonic()))
            late = time.monotonic() - turn
            if late > period:
                turn, put_off, late = turn + late, put_off + late, 0.0
            self.target(position, within=2 * period - late)
            turn += period
        return put_off

    def play(self) -> None:
        """Follows the path of the robot file from its beginning."""
        self._ask("play")

    def pause(self) -> None:
        """Lets time on the path stand still."""
        self._ask("pause")

    def resume(self) -> None:
        """Goes on along the path."""
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
        """Ends the run, whoever has the control; the drives are disabled."""
        self._ask("stop")

    def states(self, rate: float = 10.0) -> Generator[State, None, None]:
        """States as they come, rate of them a second, until the iterator is left.

        Other requests may be made in between; states that come while one waits for its answer are missed.
        Raises ControlLost where this client had the control, and ConnectionError where the daemon ends.
        """
        if not rate > 0:
            raise ValueError(f"the rate of states is above 0, not {rate}")
        self._ask("subscribe", rate=rate)
        try:
            while True:
                self._socket.settimeout(self._timeout + 1 / rate)
                message = self._next()
                self._socket.settimeout(self._timeout)
                if message.get("event") == "control_lost":
                    raise ControlLost(f"{message['to']} has taken the control")
                if "state" in message:
                    yield message["state"]
        finally:
            with contextlib.suppress(OSError):  # what has failed first is what is told
                self._socket.settimeout(self._timeout)
                self._ask("subscribe", rate=0)

    def _ask(self, command: str, **more: Any) -> dict[str, Any]:
        self._last_id += 1
        request = {"id": self._last_id, "version": PROTOCOL, "command": command, **more}
        line = json.dumps(request, allow_nan=False).encode() + b"\n"
        try:
            self._socket.sendall(line)
        except OSError as error:
            raise self._failure(error) from error
        while (answer := self._read()).get("id") != self._last_id or "ok" not in answer:
            if "event" in answer:
                self._events.append(answer)
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
        while b"\n" not in self._received:
            try:
                piece = self._socket.recv(65536)
            except OSError as error:
                raise self._failure(error) from error
            if not piece:
                raise self._failure(ConnectionResetError())
            self._received += piece
        line, _, self._received = self._received.partition(b"\n")
        try:
            message = json.loads(line)
        except ValueError:  # of JSON or of UTF-8
            message = None
        if not isinstance(message, dict):
            raise ConnectionError(f"{line[:80]!r} is no message of a daemon")
        return message

    def _failure(self, error: OSError) -> ConnectionError:
        """What to raise for an error of the socket, which is closed, so that nothing waits for it again."""
        if self._socket.fileno() < 0:
            return ConnectionError("the connection is closed")
        self._socket.close()
        if isinstance(error, TimeoutError):
            return ConnectionError(f"no answer for {self._socket.gettimeout()} s")
        return ConnectionError("the daemon has ended" if isinstance(error, ConnectionError) else str(error))
