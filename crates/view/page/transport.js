// Requests and answers: over HTTP, from the records of an exported page, or through a notebook.

/** A request without a result: `refusal` has its sentence and messages with lines. */
export class Refused extends Error {
  constructor(refusal, status) {
    super(refusal.error || "no result");
    this.refusal = refusal;
    this.superseded = Boolean(refusal.superseded) || status === 409;
  }
}

/** An answer: the entries of its head, and arrays of 32-bit numbers by name. */
export function decoded(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const arrays = {};
  for (const [name, [first, count]] of Object.entries(head.arrays || {})) {
    arrays[name] = new Float32Array(buffer, 4 + length + 4 * first, count);
  }
  return { ...head, arrays };
}

/** Requests over HTTP to the server of the page. */
export class Transport {
  constructor(base = "") {
    this.base = base;
    this.live = true;
  }

  async ask(channel, state, ask, signal) {
    let response;
    try {
      response = await fetch(this.base + "ask", {
        method: "POST",
        headers: { "content-type": "application/json" },
        body: JSON.stringify({ channel, state, ask }),
        signal,
      });
    } catch (error) {
      if (error.name === "AbortError") throw new Refused({ error: "superseded", superseded: true });
      throw new Refused({ error: "the bench has ended: start bimorph view again and reload this page", lost: true });
    }
    if (!response.ok) {
      const text = await response.text();
      let refusal = { error: text.trim() };
      try { refusal = JSON.parse(text); } catch { /* a plain text */ }
      throw new Refused(refusal, response.status);
    }
    const buffer = await response.arrayBuffer();
    return ask.kind === "export" ? new TextDecoder().decode(buffer) : decoded(buffer);
  }

  /** Calls `heard(event, data)` for events of the server. */
  events(heard) {
    const source = new EventSource(this.base + "events");
    for (const name of ["progress", "file"]) source.addEventListener(name, event => heard(name, JSON.parse(event.data)));
  }
}

/** Answers that are inside the page. */
export class RecordedTransport {
  constructor(recorded) {
    this.records = recorded.records;
    this.live = false;
  }

  async ask(channel) {
    const record = this.records[channel];
    if (!record) throw new Refused({ error: "this page was exported without this analysis" });
    if (record.refusal) throw new Refused(record.refusal);
    const bytes = Uint8Array.from(atob(record.answer), c => c.charCodeAt(0));
    return decoded(bytes.buffer);
  }

  events() {}
}

/** Requests through the kernel of a notebook. */
export class WidgetTransport {
  constructor(model) {
    this.model = model;
    this.live = true;
    this.next = 1;
    this.open = new Map();
    model.on("msg:custom", (content, buffers) => {
      const waiting = this.open.get(content.id);
      if (!waiting) return;
      this.open.delete(content.id);
      const view = buffers && buffers[0];
      const bytes = view ? new Uint8Array(view.buffer, view.byteOffset, view.byteLength).slice().buffer : new ArrayBuffer(0);
      const text = () => new TextDecoder().decode(bytes);
      if (content.status === 200) waiting.done(waiting.kind === "export" ? text() : decoded(bytes));
      else {
        let refusal = { error: text().trim() || "the bench has ended" };
        try { refusal = JSON.parse(text()); } catch { /* a plain text */ }
        waiting.failed(new Refused(refusal, content.status));
      }
    });
  }

  ask(channel, state, ask, signal) {
    return new Promise((done, failed) => {
      const id = this.next++;
      this.open.set(id, { done, failed, kind: ask.kind });
      signal?.addEventListener("abort", () => {
        this.open.delete(id);
        failed(new Refused({ error: "superseded", superseded: true }));
      });
      this.model.send({ id, body: JSON.stringify({ channel, state, ask }) });
    });
  }

  events() {}
}

/** A request that runs longer than this is stopped by the next one of its channel [ms]; a shorter one is awaited, so that a moving slider shows pictures. */
const PATIENCE = 100;

/** The newest request of one channel: of requests that come while one runs, the last is sent. */
export class Latest {
  constructor(transport, channel) {
    this.transport = transport;
    this.channel = channel;
    this.running = null;
    this.waiting = null;
  }

  /** The answer, or null where a newer request took its place. */
  ask(state, ask) {
    return new Promise((done, failed) => {
      this.waiting?.done(null);
      this.waiting = { state, ask, done, failed };
      if (!this.running) this.start();
      else if (performance.now() - this.running.since > PATIENCE) this.running.abort.abort();
      else setTimeout(() => {
        if (this.waiting && this.running && performance.now() - this.running.since > PATIENCE) this.running.abort.abort();
      }, PATIENCE + 5);
    });
  }

  /** Stops the running request. */
  stop() {
    this.waiting?.done(null);
    this.waiting = null;
    this.running?.abort.abort();
  }

  async start() {
    const { state, ask, done, failed } = this.waiting;
    this.waiting = null;
    const abort = new AbortController();
    this.running = { since: performance.now(), abort };
    try {
      done(await this.transport.ask(this.channel, state, ask, abort.signal));
    } catch (error) {
      if (error.superseded) done(null);
      else failed(error);
    }
    this.running = null;
    if (this.waiting) this.start();
  }
}
