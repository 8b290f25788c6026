// The state of the page in the fragment of its address, which no server receives.

const bytesToText = (bytes) =>
  btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""))
    .replaceAll("+", "-")
    .replaceAll("/", "_")
    .replaceAll("=", "");
const textToBytes = (text) =>
  Uint8Array.from(atob(text.replaceAll("-", "+").replaceAll("_", "/")), (c) => c.charCodeAt(0));

async function through(bytes, stream) {
  return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(stream)).arrayBuffer());
}

/** Returns the fragment of a state: readable settings, and the text of an own file in compressed form. */
export async function toFragment({ sheet, own, values, test, fault }) {
  const parts = new URLSearchParams();
  if (own) {
    const bytes = new TextEncoder().encode(own.text);
    parts.set("name", own.name);
    parts.set("file", bytesToText(await through(bytes, new CompressionStream("deflate-raw"))));
  } else {
    parts.set("sheet", sheet);
  }
  for (const [key, value] of Object.entries(values)) parts.set(key, value);
  if (test !== "move") parts.set("test", test);
  if (fault) parts.set("fault", fault);
  return parts.toString();
}

/** Returns the state of a fragment; `null` without one. */
export async function fromFragment(fragment) {
  const parts = new URLSearchParams(fragment.replace(/^#/, ""));
  if (![...parts.keys()].length) return null;
  const state = { sheet: parts.get("sheet") ?? "motor", own: null, values: {}, test: "move", fault: null };
  for (const [key, value] of parts) {
    if (key === "test" || key === "fault") state[key] = value;
    else if (key !== "sheet" && key !== "name" && key !== "file") state.values[key] = value;
  }
  if (parts.has("file")) {
    const bytes = await through(textToBytes(parts.get("file")), new DecompressionStream("deflate-raw"));
    state.own = { name: parts.get("name") ?? "mine", text: new TextDecoder().decode(bytes) };
  }
  return state;
}
