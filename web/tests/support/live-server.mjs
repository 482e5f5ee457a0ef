// SPDX-License-Identifier: Apache-2.0
// A stand-in for the live server that says what a test tells it to, and can vanish and come back.
import { createServer } from 'node:http';

export class LiveServer {
  /** `files`: {page, surface: JSON text}. Bound to a free port of loopback. */
  constructor(files) {
    Object.assign(this, { files, listeners: new Set(), sockets: new Set(), requests: [], posted: [], port: 0 });
  }

  async start() {
    this.server = createServer((request, response) => this.#answer(request, response));
    this.server.on('connection', (socket) => { this.sockets.add(socket); socket.on('close', () => this.sockets.delete(socket)); });
    await new Promise((resolve) => this.server.listen(this.port, '127.0.0.1', resolve));
    this.port = this.server.address().port;
    return `http://127.0.0.1:${this.port}/`;
  }

  /** Ends at once, as a killed program does; start() brings it back on the same port. */
  async stop() {
    const closed = new Promise((resolve) => this.server.close(resolve));
    for (const socket of this.sockets) socket.destroy();
    this.listeners.clear();
    await closed;
  }

  /** Tells all listeners. `values`: JSON of /surface/values. */
  set(state, values) {
    this.state = state;
    if (values) this.values = JSON.stringify(values);
    for (const response of this.listeners) this.#send(response);
  }

  #send(response) {
    response.write(`event: state\nid: ${this.state.revision}\ndata: ${JSON.stringify(this.state)}\n\n`);
  }

  #answer(request, response) {
    const url = new URL(request.url, 'http://localhost');
    this.requests.push(`${request.method} ${url.pathname}`);
    if (this.token && url.searchParams.get('token') !== this.token) return this.#json(response, 401, { error: 'the token is missing or wrong' });
    if (request.method === 'GET') return this.#get(url.pathname, response);
    const known = request.method === 'DELETE' ? url.pathname.startsWith('/scans/') : /^\/(scans|result$)/.test(url.pathname);
    this.posted.push(`${request.method} ${decodeURIComponent(url.pathname)}${url.searchParams.get('name') ? ` ${url.searchParams.get('name')}` : ''}`);
    request.resume();
    request.on('end', () => this.#json(response, known ? 202 : 404, known ? {} : { error: 'there is no such thing' }));
  }

  #get(path, response) {
    if (path === '/') return response.writeHead(200, { 'content-type': 'text/html; charset=utf-8' }).end(this.files.page);
    if (path === '/surface') return this.#text(response, 200, this.files.surface);
    if (path === '/surface/values') return this.#text(response, 200, this.values);
    if (path === '/state') return this.#json(response, 200, this.state);
    if (path !== '/events') return this.#json(response, 404, { error: `there is no ${path}` });
    response.writeHead(200, { 'content-type': 'text/event-stream', 'cache-control': 'no-store' });
    this.listeners.add(response);
    response.on('close', () => this.listeners.delete(response));
    this.#send(response);
  }

  #json(response, status, value) {
    this.#text(response, status, JSON.stringify(value));
  }

  #text(response, status, text) {
    response.writeHead(status, { 'content-type': 'application/json' }).end(text);
  }
}
