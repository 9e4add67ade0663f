// The WebSocket to the server: comes back by itself, and shows the token.

import { decodeFrame } from './frames.js';

const FIRST_WAIT_MS = 300;
const LONGEST_WAIT_MS = 5000;
const WRONG_TOKEN = 4401;
const TOKEN_KEY = 'vogmap.token';

/** The token of the address (#token=...), kept for this tab and taken out of the address bar. */
function initialToken() {
  const token = new URLSearchParams(location.hash.slice(1)).get('token');
  if (token === null) return sessionStorage.getItem(TOKEN_KEY) ?? '';
  sessionStorage.setItem(TOKEN_KEY, token);
  history.replaceState(null, '', location.pathname + location.search);
  return token;
}

export class Connection extends EventTarget {
  /** `onFrame(frame)` gets all frames, JSON ones as their objects with `kind` for `k`. */
  constructor(onFrame) {
    super();
    this.onFrame = onFrame;
    this.state = 'connecting';
    this.counts = { frames: 0, bytes: 0, reconnects: 0 };
    this.wait_ms = FIRST_WAIT_MS;
    this.token = initialToken();
    this.open();
  }

  open() {
    const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
    this.socket = new WebSocket(`${scheme}://${location.host}/live`);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onopen = () => this.send({ k: 'hello', token: this.token });
    this.socket.onmessage = (event) => this.receive(event.data);
    this.socket.onclose = (event) => this.closed(event.code);
  }

  receive(data) {
    this.counts.frames += 1;
    if (typeof data === 'string') {
      this.counts.bytes += data.length;
      const { k: kind, ...frame } = JSON.parse(data);
      if (kind === 'welcome') {
        this.wait_ms = FIRST_WAIT_MS;
        this.setState('open');
      }
      this.onFrame({ kind, ...frame });
    } else {
      this.counts.bytes += data.byteLength;
      const frame = decodeFrame(data);
      if (frame) this.onFrame(frame);
    }
  }

  closed(code) {
    if (code === WRONG_TOKEN) {
      this.setState('locked');
      return;
    }
    this.setState('closed');
    this.counts.reconnects += 1;
    setTimeout(() => this.open(), this.wait_ms);
    this.wait_ms = Math.min(2 * this.wait_ms, LONGEST_WAIT_MS);
  }

  setState(state) {
    this.state = state;
    this.dispatchEvent(new Event('state'));
  }

  send(message) {
    if (this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  /** After the server refused the old token. */
  useToken(token) {
    this.token = token;
    sessionStorage.setItem(TOKEN_KEY, token);
    this.setState('connecting');
    this.open();
  }
}
