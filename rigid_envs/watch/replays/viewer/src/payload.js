// The replay in the page: a JSON document whose `blob` holds all arrays, deflated, in base64.
// A reference to an array is [kind, offset in bytes, number of entries].

const KINDS = { f4: Float32Array, f8: Float64Array, u1: Uint8Array, u4: Uint32Array };

export async function readPayload(node) {
  const payload = JSON.parse(node.textContent);
  const packed = Uint8Array.from(atob(payload.blob), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(stream).arrayBuffer();
  delete payload.blob;
  return { payload, array: ([kind, offset, count]) => new KINDS[kind](buffer, offset, count) };
}

// Rows of `width` numbers over frames; a single row is constant.
export class Rows {
  constructor(values, width) {
    this.values = values;
    this.width = width;
    this.constant = values.length === width;
  }

  copy(index, out) {
    const first = this.constant ? 0 : index * this.width;
    for (let k = 0; k < this.width; k++) out[k] = this.values[first + k];
    return out;
  }
}
