// The module of edo-smc in a thread of its own: a request in, an answer out.
"use strict";

/** The compiled module, which the page sends first. */
let arrived;
const module = new Promise((resolve, reject) => (arrived = { resolve, reject }));
let ready = null;

const started = async () => (await WebAssembly.instantiate(await module, {})).exports;

async function answered(request) {
  ready ??= started();
  const { memory, buffer, answer, address } = await ready;
  const bytes = new TextEncoder().encode(JSON.stringify(request));
  const at = buffer(bytes.length);
  new Uint8Array(memory.buffer, at, bytes.length).set(bytes);
  const length = answer();
  return JSON.parse(new TextDecoder().decode(new Uint8Array(memory.buffer, address(), length)));
}

self.onmessage = async ({ data: { id, request, module: code, broken } }) => {
  if (code) return arrived.resolve(code);
  if (broken) return arrived.reject(new Error(broken));
  try {
    self.postMessage({ id, answer: await answered(request) });
  } catch (error) {
    // A trap leaves the module unusable: the next request starts a new one.
    ready = null;
    self.postMessage({ id, answer: { error: [{ key: "", cause: "", remedy: "", text: String(error) }] } });
  }
};
