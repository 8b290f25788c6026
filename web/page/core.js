// Requests to the module in its thread.

/** The module is compiled once; every thread gets the compiled code. */
let compiled = null;
const compile = async () => WebAssembly.compile(await (await fetch("edo_smc_web.wasm")).arrayBuffer());

/** Thread with the module. A request of a kind replaces the waiting one of the same kind: a stale answer is dropped. */
export class Core {
  #worker = null;
  #next = 1;
  #waiting = new Map();
  #running = null;

  /** Returns the answer to a request, or `null` if a newer request of this kind replaced it. */
  ask(kind, request) {
    return new Promise((resolve) => {
      this.#waiting.get(kind)?.resolve(null);
      this.#waiting.delete(kind);
      this.#waiting.set(kind, { request, resolve, kind });
      this.#send();
    });
  }

  /** Stops a computation that takes long. */
  stop() {
    if (!this.#running) return;
    this.#worker.terminate();
    this.#worker = null;
    this.#running.resolve(null);
    this.#running = null;
    for (const { resolve } of this.#waiting.values()) resolve(null);
    this.#waiting.clear();
  }

  #send() {
    if (this.#running || this.#waiting.size === 0) return;
    const [kind, job] = this.#waiting.entries().next().value;
    this.#waiting.delete(kind);
    this.#running = { ...job, id: this.#next++ };
    this.#started().postMessage({ id: this.#running.id, request: job.request });
  }

  #started() {
    if (this.#worker) return this.#worker;
    this.#worker = new Worker("worker.js");
    compiled ??= compile();
    const worker = this.#worker;
    compiled.then(
      (module) => worker.postMessage({ module }),
      (error) => worker.postMessage({ broken: String(error) }),
    );
    this.#worker.onmessage = ({ data: { id, answer } }) => {
      if (this.#running?.id !== id) return;
      const { resolve, kind } = this.#running;
      this.#running = null;
      // The answer to an older request of this kind has no reader, but is better than none while a slider moves.
      resolve({ ...answer, isStale: this.#waiting.has(kind) });
      this.#send();
    };
    return this.#worker;
  }
}
