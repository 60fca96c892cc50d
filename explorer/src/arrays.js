/** Arrays of numbers as they come: in a frame's payload {offset, length, shape}, or in a page {base64, shape}. */
const isArray = (value) => value !== null && typeof value === "object" && Array.isArray(value.shape);

function fromBase64(text) {
  const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  return new Float32Array(bytes.buffer);
}

/** `value` with every array in it made {data: Float32Array, shape}. */
export function decoded(value, payload) {
  if (isArray(value) && "base64" in value) return { data: fromBase64(value.base64), shape: value.shape };
  if (isArray(value) && "offset" in value) {
    return { data: new Float32Array(payload.buffer, payload.byteOffset + value.offset, value.length), shape: value.shape };
  }
  if (Array.isArray(value)) return value.map((one) => decoded(one, payload));
  if (value !== null && typeof value === "object") {
    return Object.fromEntries(Object.entries(value).map(([key, one]) => [key, decoded(one, payload)]));
  }
  return value;
}

/** The result in a binary frame: a length, a JSON header, float32 numbers. */
export function frame(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  if (header.ok) header.result = decoded(header.result, new Uint8Array(buffer, 4 + length));
  return header;
}
