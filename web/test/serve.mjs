// Serves a folder on this machine, for the test of the page: node test/serve.mjs FOLDER [PORT]

import { createServer } from "node:http";
import { readFile } from "node:fs/promises";
import { extname, join } from "node:path";

const TYPES = {
  ".html": "text/html; charset=utf-8",
  ".css": "text/css",
  ".js": "text/javascript",
  ".wasm": "application/wasm",
  ".json": "application/json",
};

/** Returns a server of a folder and its address. */
export async function serve(folder, port = 0) {
  const server = createServer(async (request, response) => {
    // A URL has no `..` in its path.
    const path = new URL(request.url, "http://localhost").pathname.replace(/^\/$/, "/index.html");
    try {
      const content = await readFile(join(folder, path));
      response.writeHead(200, { "content-type": TYPES[extname(path)] ?? "application/octet-stream" }).end(content);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((resolve) => server.listen(port, "127.0.0.1", resolve));
  return { server, address: `http://127.0.0.1:${server.address().port}/` };
}

if (process.argv[1]?.endsWith("serve.mjs")) {
  const { address } = await serve(process.argv[2], Number(process.argv[3] ?? 8000));
  console.log(address);
}
