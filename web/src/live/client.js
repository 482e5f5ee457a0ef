// SPDX-License-Identifier: Apache-2.0
// The connection to the server: states as they come, a lost connection noticed, and everything caught up after it.

const kSilence = 20000;  // ms without an event after which the server is asked whether it lives
const kRetry = 2000;

export class LiveClient {
  /** `on.state(state)`, `on.connection('connecting' | 'open' | 'lost')`. */
  constructor(on, token = new URLSearchParams(location.search).get('token')) {
    Object.assign(this, { on, token, revision: -1, events_seen: 0 });
  }

  url(path, query = {}) {
    const all = new URLSearchParams({ ...query, ...(this.token ? { token: this.token } : {}) });
    return `${path}${`${all}` ? '?' : ''}${all}`;
  }

  start() {
    this.#set_connection('connecting');
    this.#open();
    addEventListener('online', () => this.#ask());
    document.addEventListener('visibilitychange', () => { if (!document.hidden) this.#ask(); });
  }

  #open() {
    this.source?.close();
    this.source = new EventSource(this.url('/events'));
    this.source.addEventListener('open', () => { this.revision = -1; });
    this.source.addEventListener('state', (event) => {
      ++this.events_seen;
      this.#take(JSON.parse(event.data));
    });
    // The browser tries again by itself unless the answer was an error; we ask meanwhile, which is faster.
    this.source.addEventListener('error', () => this.#lost());
  }

  #take(state) {
    this.#set_connection('open');
    clearTimeout(this.watch);
    this.watch = setTimeout(() => this.#ask(), kSilence);
    if (state.revision === this.revision) return;
    this.revision = state.revision;
    this.on.state(state);
  }

  #lost() {
    this.#set_connection('lost');
    clearTimeout(this.watch);
    this.watch = setTimeout(() => this.#ask(), kRetry);
  }

  /** Asks for the state; a dead event stream is opened anew once there is an answer. */
  async #ask() {
    const before = this.events_seen;
    try {
      const state = await (await this.#fetch('/state')).json();
      if (this.source.readyState === EventSource.CLOSED) this.#open();
      // An event that came while we asked is newer than the answer.
      if (this.events_seen === before) this.#take(state);
    } catch {
      this.#lost();
    }
  }

  async #fetch(path, { query, timeout = 8000, ...options } = {}) {
    const response = await fetch(this.url(path, query), { ...options, cache: 'no-store', signal: AbortSignal.timeout(timeout) });
    if (response.ok) return response;
    const text = await response.text();
    let message = `the server answered ${response.status}`;
    try { message = JSON.parse(text).error ?? message; } catch { /* not JSON: the number says enough */ }
    throw new Error(message);
  }

  #set_connection(connection) {
    if (connection === this.connection) return;
    this.connection = connection;
    this.on.connection(connection);
  }

  surface = async () => (await this.#fetch('/surface', { timeout: 60000 })).json();
  values = async (revision) => (await this.#fetch('/surface/values', { query: { revision }, timeout: 30000 })).json();
  remove = (file) => this.#fetch(`/scans/${encodeURIComponent(file)}`, { method: 'DELETE' });
  restore = (file) => this.#fetch(`/scans/${encodeURIComponent(file)}/restore`, { method: 'POST' });
  write_result = () => this.#fetch('/result', { method: 'POST' });
  add = (file) => this.#fetch('/scans', { method: 'POST', query: { name: file.name }, body: file, timeout: 600000 });
}

/** Calls `fetch_newest(wanted)` so that one request runs at a time and the last wanted number is always reached. */
export class Newest {
  constructor(fetch_newest) {
    this.fetch_newest = fetch_newest;
  }

  /** What was reached says nothing any more: another program may answer, which counts anew. */
  forget() {
    this.reached = undefined;
  }

  async want(number) {
    this.wanted = number;
    if (this.running) return;
    this.running = true;
    for (let tries = 0; this.reached !== this.wanted;) {
      const aim = this.wanted;
      try {
        await this.fetch_newest(aim);
        this.reached = aim;
        tries = 0;
      } catch {
        if (++tries > 30) break;
        await new Promise((resolve) => setTimeout(resolve, Math.min(5000, 300 * tries)));
      }
    }
    this.running = false;
  }
}
