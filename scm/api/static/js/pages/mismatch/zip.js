/** A folder as a zip, stored without packing: enough to send a recording as one file. */

const TABLE = Uint32Array.from({ length: 256 }, (_, n) => {
  let c = n;
  for (let k = 0; k < 8; k++) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c >>> 0;
});

/** @param files `[{name, bytes}]`; @returns a Blob of type `application/zip` */
export function zipOf(files) {
  const parts = [];
  const central = [];
  let offset = 0;
  for (const { name, bytes } of files) {
    const title = new TextEncoder().encode(name);
    const facts = [0x0800, 0, 0, 0x21, crc(bytes), bytes.length, bytes.length, title.length];
    const head = record([[0x04034b50, 4], [20, 2], ...common(facts), [0, 2]], title);
    parts.push(head, bytes);
    central.push(
      record(
        [[0x02014b50, 4], [20, 2], [20, 2], ...common(facts), [0, 2], [0, 2], [0, 2], [0, 2], [0, 4], [offset, 4]],
        title,
      ),
    );
    offset += head.length + bytes.length;
  }
  const size = central.reduce((sum, one) => sum + one.length, 0);
  const count = files.length;
  const end = record([[0x06054b50, 4], [0, 2], [0, 2], [count, 2], [count, 2], [size, 4], [offset, 4], [0, 2]]);
  return new Blob([...parts, ...central, end], { type: "application/zip" });
}

/** Flags, method, time, date, checksum, both sizes and the name's length, as both heads have them. */
function common([flags, method, time, date, sum, packed, whole, name]) {
  return [[flags, 2], [method, 2], [time, 2], [date, 2], [sum, 4], [packed, 4], [whole, 4], [name, 2]];
}

function record(fields, tail = new Uint8Array()) {
  const head = fields.reduce((sum, [, wide]) => sum + wide, 0);
  const bytes = new Uint8Array(head + tail.length);
  const view = new DataView(bytes.buffer);
  let at = 0;
  for (const [value, wide] of fields) {
    if (wide === 2) view.setUint16(at, value, true);
    else view.setUint32(at, value, true);
    at += wide;
  }
  bytes.set(tail, at);
  return bytes;
}

function crc(bytes) {
  let c = 0xffffffff;
  for (const byte of bytes) c = TABLE[(c ^ byte) & 0xff] ^ (c >>> 8);
  return (c ^ 0xffffffff) >>> 0;
}
