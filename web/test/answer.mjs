// Answers a request on stdin with the module in Node: node test/answer.mjs MODULE [--time]. With --bits it prints the
// hashes instead, one scenario per line.

import { readFileSync } from "node:fs";

const { instance } = await WebAssembly.instantiate(readFileSync(process.argv[2]), {});
const { memory, buffer, answer, address } = instance.exports;
const isBits = process.argv[3] === "--bits";
const request = isBits ? Buffer.from('{"call": "bits"}') : readFileSync(0);
const at = buffer(request.length);
new Uint8Array(memory.buffer, at, request.length).set(request);
const started = performance.now();
const length = answer();
const took = performance.now() - started;
const text = Buffer.from(memory.buffer, address(), length).toString();
console.log(isBits ? JSON.parse(text).bits.join("\n") : text);
if (process.argv[3] === "--time") console.error(`${took.toFixed(1)} ms`);
