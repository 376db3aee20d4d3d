# SPDX-License-Identifier: Apache-2.0
"""A daemon that speaks the control protocol, without a robot: its effectors are where they are wanted.

Every message, in both directions, is held against docs/control-protocol.schema.json.
"""

import contextlib
import json
import socket
import socketserver
import sys
import tempfile
import threading
import time
from pathlib import Path

import jsonschema

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "app/client"), str(ROOT / "app/client/examples")]
SCHEMA = json.loads((ROOT / "docs/control-protocol.schema.json").read_text())
PATIENCE_S = 60
LIMIT_M = 0.1  # of the workspace, on both sides of 0
OFFSET_M = 1e-4  # of what the sensor sees from where the effector is wanted


def of_kind(kind, message):
    """The message, once it is one of that kind."""
    jsonschema.validate(message, {"$ref": f"#/$defs/{kind}", "$defs": SCHEMA["$defs"]})
    return message


def wait_until(question, what):
    end = time.monotonic() + PATIENCE_S
    while not (answer := question()):
        if time.monotonic() > end:
            raise AssertionError(f"waited in vain for {what}")
        time.sleep(0.005)
    return answer


class Connection(socketserver.StreamRequestHandler):
    def setup(self):
        super().setup()
        self.rate = 0.0
        self.sending = threading.Lock()

    def send(self, kind, message):
        of_kind(kind, message)
        if "state" in message:  # a daemon may say more than the schema of this version knows
            message["state"] |= self.server.more
        with self.sending:
            self.wfile.write(json.dumps(message).encode() + b"\n")

    def handle(self):
        daemon = self.server
        daemon.connections.append(self)
        try:
            self.send("greeting", {"tendril": "0.1.0", "version": 1, "robot": "fake", "rate": 600.0, "coordinates": daemon.coordinates})
            threading.Thread(target=self.push, daemon=True).start()
            for line in self.rfile:
                request = of_kind("request", json.loads(line))
                daemon.requests.append(request)
                if not daemon.silent:
                    self.answer(request)
        except OSError:  # the client has gone
            pass
        finally:
            daemon.connections.remove(self)
            if daemon.controller is self:
                daemon.controller = None

    def answer(self, request):
        error = self.server.serve(self, request)
        if error:
            code, sentence = error
            self.send("refusal", {"id": request["id"], "ok": False, "error": {"code": code, "message": sentence}})
        elif request["command"] == "status":
            self.send("answer", {"id": request["id"], "ok": True, "state": self.server.state()})
        else:
            self.send("answer", {"id": request["id"], "ok": True})
        if request["command"] == "subscribe":
            self.rate = request["rate"]  # after the answer, so that the client misses no state

    def push(self):
        with contextlib.suppress(OSError, ValueError):  # the client has gone
            while self in self.server.connections:
                if self.rate and not self.server.silent:
                    self.send("state_message", {"state": self.server.state()})
                time.sleep(1 / self.rate if self.rate else 0.005)


class FakeDaemon(socketserver.ThreadingUnixStreamServer):
    """Use with `with`. phase, faults and more, further keys of the state, may be set at any time.

    requests: all that were made, in their order
    silent: answers nothing any more
    """

    daemon_threads = True

    def __init__(self, coordinates=("tip.x", "tip.y", "tip.z")):
        self.folder = tempfile.TemporaryDirectory(prefix="tendril-fake-")
        self.path = Path(self.folder.name) / "fake.sock"
        self.coordinates = list(coordinates)
        self.requests, self.connections = [], []
        self.controller, self.silent = None, False
        self.phase, self.mode, self.faults, self.more = "run", "none", [], {}
        zero = dict.fromkeys(self.coordinates, 0.0)
        self.way = (zero, zero, 0.0, 0.0)  # start, goal, begin, duration
        super().__init__(str(self.path), Connection)

    def __enter__(self):
        self.thread = threading.Thread(target=self.serve_forever, args=[0.01])
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.end()
        self.folder.cleanup()

    def end(self):
        """As a daemon that has been killed."""
        if self.thread:
            self.shutdown()
            self.thread.join()
            self.thread = None
            self.server_close()
            self.path.unlink()
            for connection in list(self.connections):
                with contextlib.suppress(OSError):  # it may just have ended
                    connection.connection.shutdown(socket.SHUT_RDWR)

    def target(self):
        start, goal, begin, duration = self.way
        share = 1.0 if duration == 0 else min(1.0, (time.monotonic() - begin) / duration)
        return {name: goal[name] if share == 1 else start[name] + share * (goal[name] - start[name]) for name in goal}

    def state(self):
        target = None if self.phase in ("connect", "model", "enable") else self.target()
        measured = {name: {"value": value + OFFSET_M, "age": 0.01} for name, value in (target or {}).items()}
        control = self.controller and "somebody"
        return {
            "time": time.monotonic(), "phase": self.phase, "mode": self.mode, "path_rate": 1.0, "control": control,
            "target": target, "model": target, "measured": measured,
            "actuators": {"north": {"command": 0.002, "displacement": 0.001, "effort": 3.0, "power": "on"}},
            "qp": {"status": "solved", "iterations": 4}, "snapshot": 20, "snapshot_age": 0.002, "cycle_time": 5e-5,
            "cycles": 1000, "late_cycles": 1, "faults": self.faults, "fault": None,
        }

    def serve(self, client, request):
        """Does what a request says. Returns why not: code and sentence."""
        command = request["command"]
        if command == "acquire":
            if self.controller not in (None, client):
                if not request.get("steal"):
                    return "control_taken", "somebody has the control"
                self.controller.send("event", {"event": "control_lost", "to": "a thief"})
            self.controller = client
        elif command == "release":
            self.controller = None
        elif command not in ("status", "subscribe"):
            if self.controller is not client:
                return "no_control", "acquire the control first"
            if self.phase != "run":
                return "not_running", "the robot does not follow"
            if command == "target":
                if any(abs(value) > LIMIT_M for value in request["position"].values()):
                    return "outside_workspace", "outside control.workspace"
                start = self.target()
                length = sum((value - start[name]) ** 2 for name, value in request["position"].items()) ** 0.5
                duration = request.get("in", length / request.get("speed", 0.05))
                self.way = (start, start | request["position"], time.monotonic(), duration)
                self.mode = "target"
            elif command == "hold":
                self.way = (self.target(), self.target(), 0.0, 0.0)
                self.mode = "hold"
            elif command == "stop":
                self.phase = "stop"
        return None
