#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tendril-view towards browsers that are friendly or not, with a daemon that is a few lines of Python."""

import contextlib
import faulthandler
import http.client
import json
import re
import socket
import socketserver
import subprocess
import sys
import tempfile
import threading
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT / "tests/peers"), str(Path(__file__).parent)]
from bench import PATIENCE_S, Program, wait_until
from web_socket import Refused, WebSocket

VIEW = sys.argv.pop(1)
TOKEN = "a-token-for-tests"
GREETING = {"tendril": "0", "version": 1, "robot": "fake", "rate": 600.0, "coordinates": ["tip.x"]}


class Daemon:
    """Answers every command with what it was asked; "subscribe" also sends states without end, as fast as they are read.
    It ends with the object."""

    def __init__(self, path):
        self.heard = heard = []
        self.clients = clients = []

        class Handler(socketserver.StreamRequestHandler):
            def handle(self):
                clients.append(self.request)
                self.tell(GREETING)
                with contextlib.suppress(OSError):
                    for line in self.rfile:
                        request = json.loads(line)
                        heard.append(request)
                        self.tell({"id": request.get("id"), "ok": True, "asked": request["command"]})
                        while request["command"] == "subscribe":
                            self.tell({"state": {"text": 5000 * "x"}})

            def tell(self, message):
                self.wfile.write(json.dumps(message).encode() + b"\n")

        class Server(socketserver.ThreadingUnixStreamServer):
            daemon_threads = True

        self._server = Server(str(path), Handler)
        self._path = path
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.05,))
        self._thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()
        for client in self.clients:
            with contextlib.suppress(OSError):
                client.shutdown(socket.SHUT_RDWR)
        self._path.unlink()


class ViewTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.stack = contextlib.ExitStack()
        cls.folder = Path(cls.stack.enter_context(tempfile.TemporaryDirectory(prefix="tendril-view-")))
        cls.path = cls.folder / "robot.sock"
        words = [VIEW, "--socket", cls.path, "--listen", "127.0.0.1:0", "--token", TOKEN]
        cls.view = cls.stack.enter_context(Program(words, cls.folder / "view.log"))
        cls.view.wait_for(f"#token={TOKEN}")
        cls.port = int(re.search(r"http://127[.]0[.]0[.]1:(\d+)/#", cls.view.said())[1])

    @classmethod
    def tearDownClass(cls):
        cls.stack.close()

    def get(self, path, method="GET", body=None, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        self.addCleanup(connection.close)
        connection.request(method, path, body, headers)
        answer = connection.getresponse()
        return answer, answer.read()

    def page(self, token=None, **headers):
        page = self.enterContext(WebSocket(self.port, timeout=PATIENCE_S, **headers))
        if token:
            page.send({"token": token})
        return page

    def meet(self, token=None):
        """A page that the daemon has greeted, and what it was told of its token; the two come in any order."""
        page, view, greeted = self.page(token), None, False
        while not greeted or (token and view is None):
            message = page.read()
            greeted = greeted or message == GREETING
            view = message.get("view", view)
        return page, view

    def test_the_page_comes_with_headers_that_keep_other_content_out(self):
        answer, text = self.get("/")
        self.assertEqual(answer.status, 200)
        self.assertEqual(answer.headers["Content-Type"], "text/html; charset=utf-8")
        policy = answer.headers["Content-Security-Policy"]
        self.assertIn("default-src 'none'", policy)
        self.assertIn("frame-ancestors 'none'", policy)
        self.assertNotIn("unsafe", policy)
        self.assertEqual(answer.headers["X-Content-Type-Options"], "nosniff")
        for name in re.findall(r'(?:src|href)="([^"]+)"', text.decode()):
            found, _ = self.get("/" + name)
            self.assertEqual(found.status, 200, name)
        self.assertEqual(self.get("/main.js")[0].headers["Content-Type"], "text/javascript; charset=utf-8")
        self.assertEqual(self.get("/?from=bookmark")[0].status, 200)

    def test_every_module_that_the_page_imports_is_there(self):
        waiting, seen = ["main.js"], set()
        while waiting:
            name = waiting.pop()
            if name in seen:
                continue
            seen.add(name)
            answer, text = self.get("/" + name)
            if answer.status == 404 and name in ("three.module.js", "OrbitControls.js"):
                continue  # built without npm
            self.assertEqual(answer.status, 200, name)
            waiting += re.findall(r'(?:from|import\() ?["\']\./([\w.]+)["\']', text.decode())
        self.assertIn("scene.js", seen)

    def test_a_head_has_no_body_and_other_methods_are_refused(self):
        answer, text = self.get("/", "HEAD")
        self.assertEqual((answer.status, text), (200, b""))
        self.assertGreater(int(answer.headers["Content-Length"]), 100)
        answer, _ = self.get("/", "DELETE")
        self.assertEqual((answer.status, answer.headers["Allow"]), (405, "GET, HEAD"))

    def test_what_is_not_there_is_not_found_wherever_it_leads(self):
        for path in ("/none", "/../access.h", "/..%2faccess.h", "/page/index.html", "//index.html", "/.", "/main.js/", "/etc/passwd"):
            self.assertEqual(self.get(path)[0].status, 404, path)

    def test_a_name_as_host_is_refused_since_it_may_have_been_rebound(self):
        for host in ("evil.example", f"evil.example:{self.port}", f"127.0.0.1.evil.example:{self.port}"):
            self.assertEqual(self.get("/", Host=host)[0].status, 421, host)
            with self.assertRaises(Refused) as refusal:
                WebSocket(self.port, Host=host)
            self.assertEqual(refusal.exception.args, (421,))
        self.assertEqual(self.get("/", Host=f"localhost:{self.port}")[0].status, 200)

    def test_a_page_of_another_origin_may_not_even_watch(self):
        for origin in ("http://evil.example", "null", f"http://localhost:{self.port}"):
            with self.assertRaises(Refused) as refusal:
                WebSocket(self.port, Origin=origin)
            self.assertEqual(refusal.exception.args, (403,))
        self.page(Origin=f"http://127.0.0.1:{self.port}")

    def test_noise_ends_its_connection_and_nothing_else(self):
        for noise in (b"\x16\x03\x01\x02\x00\x01", b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 5000, b"\r\n\r\n\r\n", b"GET\r\n\r\n",
                      b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999\r\n\r\n"):
            with socket.create_connection(("127.0.0.1", self.port), PATIENCE_S) as client:
                with contextlib.suppress(OSError):
                    client.sendall(noise)
                    client.shutdown(socket.SHUT_WR)
                    while client.recv(4096):
                        pass
        self.assertEqual(self.get("/")[0].status, 200)

    def test_without_the_token_a_page_watches_and_moves_nothing(self):
        with Daemon(self.path) as daemon:
            for token in (None, "a wrong one", TOKEN[:-1]):
                page, view = self.meet(token)
                if token:
                    self.assertEqual(view["control"], False)
                page.send({"id": 1, "command": "geometry"})
                self.assertEqual(page.read(), {"id": 1, "ok": True, "asked": "geometry"})
                for request in ({"command": "acquire"}, {"command": "stop"}, {"command": ["status"]}, {}, {"command": "dance"}):
                    page.send({"id": 2, **request})
                    self.assertEqual(page.read()["error"]["code"], "no_token", request)
                page.send(b'{"command": "status", "command": "stop"}')  # the last one counts, here and there
                self.assertEqual(page.read()["error"]["code"], "no_token")
            self.assertEqual({request["command"] for request in daemon.heard}, {"geometry"})

    def test_with_the_token_a_page_says_what_it_likes_to_the_daemon(self):
        with Daemon(self.path) as daemon:
            page, view = self.meet(TOKEN)
            self.assertEqual(view, {"control": True})
            request = {"id": [1, {"a": "b"}], "command": "target", "position": {"tip.x": 0.01}}
            page.send(request)
            self.assertEqual(page.read()["id"], request["id"])
            self.assertEqual(daemon.heard, [request])
            for wrong in (b"{", b"[1]", b"1", 40 * b"[" + 40 * b"]"):
                page.send(wrong)
                self.assertEqual(page.read()["error"]["code"], "bad_json")

    def test_a_message_that_is_too_long_ends_its_page(self):
        page = self.page(TOKEN)
        with contextlib.suppress(OSError):
            page.send(70_000 * b"x")
        with contextlib.suppress(OSError):
            while page.read() is not None:
                pass
        self.assertEqual(self.get("/")[0].status, 200)

    def test_a_daemon_that_comes_and_goes_is_found_again(self):
        page = self.page()
        view = page.until("view")
        self.assertIs(view["daemon"], False)
        self.assertIn(f"no daemon at {self.path}", view["message"])
        page.send({"id": 1, "command": "status"})
        self.assertEqual(page.until("error")["code"], "no_daemon")
        for _ in range(2):
            with Daemon(self.path):
                while page.read() != GREETING:
                    pass
            self.assertIs(page.until("view")["daemon"], False)

    def test_ten_pages_watch_and_one_that_does_not_read_holds_up_none(self):
        with Daemon(self.path) as daemon:
            deaf = self.page()
            pages = [self.page() for _ in range(10)]
            for page in [deaf, *pages]:
                page.until("tendril")  # the daemon's greeting: before it there is nobody to ask
                page.send({"command": "subscribe"})
            for page in pages:
                for _ in range(200):
                    page.until("state")
            self.assertGreaterEqual(len(daemon.clients), 11)  # one each
        resident_kb = int(re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{self.view.process.pid}/status").read_text())[1])
        self.assertLess(resident_kb, 200_000)  # what is not read does not pile up

    def test_pages_have_a_limit_and_their_place_is_free_again(self):
        pages = []
        def full():
            try:
                pages.append(WebSocket(self.port))
            except Refused as refusal:
                return refusal.args == (503,)
            return False
        wait_until(full, "the limit of pages", [self.view])
        self.assertLessEqual(len(pages), 16)
        self.assertEqual(self.get("/")[0].status, 200)
        for page in pages:
            page.close()
        wait_until(lambda: not full(), "a free place", [self.view])
        pages[-1].close()

    def refusal(self, *words):
        ended = subprocess.run([VIEW, *map(str, words)], capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        return ended.returncode, ended.stderr

    def test_what_cannot_be_served_is_said(self):
        code, said = self.refusal("--socket", self.path, "--listen", f"127.0.0.1:{self.port}")
        self.assertEqual(code, 3)
        self.assertIn("another program has the port", said)
        for listen in ("8765", "localhost:1", "127.0.0.1:99999"):
            code, said = self.refusal("--socket", self.path, "--listen", listen)
            self.assertEqual(code, 3)
            self.assertIn("such as 127.0.0.1:8765", said)
        code, said = self.refusal("--socket", self.path, "--token", "short")
        self.assertEqual(code, 3)
        self.assertIn("at least 12 letters", said)
        self.assertEqual(self.refusal("--walk")[0], 2)

    def test_a_token_is_made_where_none_is_given_and_the_program_ends_when_told(self):
        tokens = set()
        for _ in range(2):
            with Program([VIEW, "--socket", self.path, "--listen", "127.0.0.1:0"], self.folder / "other.log") as view:
                view.wait_for("#token=")
                tokens.add(re.search(r"#token=([0-9a-f]{32})\n", view.said())[1])
                self.assertEqual(view.terminate(), 0)
        self.assertEqual(len(tokens), 2)


if __name__ == "__main__":
    faulthandler.dump_traceback_later(5 * PATIENCE_S, exit=True)  # says where a test hangs
    unittest.main(verbosity=2)
