# SPDX-License-Identifier: Apache-2.0
"""A WebSocket client for tests: text messages only. [RFC 6455]"""

import base64
import hashlib
import json
import os
import socket
import struct


class Refused(Exception):
    """The server did not upgrade; its first argument is the HTTP status."""


class WebSocket:
    """headers: further ones of the request, such as Origin"""

    def __init__(self, port, path="/live", timeout=60, **headers):
        self._socket = socket.create_connection(("127.0.0.1", port), timeout)
        key = base64.b64encode(os.urandom(16)).decode()
        lines = {"Host": f"127.0.0.1:{port}", "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Key": key,
                 "Sec-WebSocket-Version": "13", **headers}
        request = f"GET {path} HTTP/1.1\r\n" + "".join(f"{name}: {value}\r\n" for name, value in lines.items()) + "\r\n"
        self._socket.sendall(request.encode())
        self._stream = self._socket.makefile("rb")
        status = int(self._stream.readline().split()[1])
        answer = {}
        while line := self._stream.readline().strip():
            name, value = line.decode().split(":", 1)
            answer[name.lower()] = value.strip()
        if status != 101:
            self.close()
            raise Refused(status)
        accept = hashlib.sha1(f"{key}258EAFA5-E914-47DA-95CA-C5AB0DC85B11".encode()).digest()
        assert answer["sec-websocket-accept"] == base64.b64encode(accept).decode()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self._stream.close()  # it holds the connection too
        self._socket.close()

    def send(self, message):
        data = message if isinstance(message, bytes) else json.dumps(message).encode()
        mask = os.urandom(4)
        size = bytes([128 | len(data)]) if len(data) < 126 else \
            struct.pack("!BH", 128 | 126, len(data)) if len(data) < 65536 else struct.pack("!BQ", 128 | 127, len(data))
        self._socket.sendall(b"\x81" + size + mask + bytes(byte ^ mask[k % 4] for k, byte in enumerate(data)))

    def read(self):
        """The next message; None once the server has closed."""
        text = b""
        while True:
            head = self._stream.read(2)
            if len(head) < 2 or head[0] & 15 == 8:
                return None
            size = head[1] & 127
            if size > 125:
                size = int.from_bytes(self._stream.read(2 if size == 126 else 8), "big")
            data = self._stream.read(size)
            if head[0] & 15 == 9:
                continue  # a ping
            text += data
            if head[0] & 128:
                return json.loads(text)

    def until(self, key):
        """The content of the next message that has a key."""
        while key not in (message := self.read()):
            pass
        return message[key]
