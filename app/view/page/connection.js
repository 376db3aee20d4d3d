// SPDX-License-Identifier: Apache-2.0
// The WebSocket to tendril-view. It speaks the daemon's control protocol (docs/control-protocol.md), and connects again
// by itself.

const kRetry_ms = 1000;

export class Connection extends EventTarget {
  #socket;
  #token;
  #lastId = 0;
  #waiting = new Map(); // by id: what becomes of its answer

  // Fires "greeting", "state", "surface", "event" and "view", each with the message's content, and "lost" with a
  // sentence.
  constructor(token) {
    super();
    this.#token = token;
    this.#open();
  }

  #open() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    this.#socket = new WebSocket(`${scheme}://${location.host}/live`);
    this.#socket.onopen = () => this.#token && this.#socket.send(JSON.stringify({ token: this.#token }));
    this.#socket.onmessage = ({ data }) => this.#hear(JSON.parse(data));
    this.#socket.onclose = () => {
      this.#lose("tendril-view does not answer");
      setTimeout(() => this.#open(), kRetry_ms);
    };
  }

  #hear(message) {
    if ("ok" in message) {
      const answer = this.#waiting.get(message.id);
      this.#waiting.delete(message.id);
      if (message.ok) answer?.resolve(message);
      else answer?.reject(new Error(message.error.message));
    } else if ("view" in message) {
      if (message.view.daemon === false) this.#lose(message.view.message);
      this.#tell("view", message.view);
    } else if ("tendril" in message) this.#tell("greeting", message);
    else if ("state" in message) this.#tell("state", message.state);
    else if ("surface" in message) this.#tell("surface", message.surface);
    else if ("event" in message) this.#tell("event", message);
  }

  #lose(why) {
    for (const answer of this.#waiting.values()) answer.reject(new Error(why));
    this.#waiting.clear();
    this.#tell("lost", why);
  }

  #tell(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  // The answer to a command; rejected, with the daemon's sentence, where it is refused.
  ask(command, more = {}) {
    return new Promise((resolve, reject) => {
      if (this.#socket.readyState !== WebSocket.OPEN) return reject(new Error("tendril-view does not answer"));
      const id = ++this.#lastId;
      this.#waiting.set(id, { resolve, reject });
      this.#socket.send(JSON.stringify({ id, command, ...more }));
    });
  }
}

// Positions of a surface message, mm: x, y, z of each point.
export function positions(surface) {
  const bytes = Uint8Array.from(atob(surface.positions), (letter) => letter.charCodeAt(0));
  const numbers = new DataView(bytes.buffer);
  const result = new Float32Array(bytes.length / 2);
  for (let k = 0; k < result.length; ++k)
    result[k] = 1000 * (surface.origin[k % 3] + surface.step * numbers.getUint16(2 * k, true));
  return result;
}
