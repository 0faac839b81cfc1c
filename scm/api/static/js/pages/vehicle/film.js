/** A film as the server sends it: JPEG pictures, one behind the other. Only the newest is shown, and its end is noticed. */
import { enter } from "scm/shell/api.js";
import { RANKS, whileSeen } from "scm/shell/streams.js";

const AGAIN_MS = 1000;
const HEAD_END = "\r\n\r\n";
const LENGTH = /^content-length: *(\d+)/im;
const TIME = /^x-time-ns: *(\d+)/im;

const letters = new TextDecoder("latin1");

/**
 * Draw every picture of a film, decoded, while the page is visible; the film is requested again when it ends.
 * @param draw receives a picture, which is closed when it returns.
 * @param receive receives every JPEG that came, and when it was exposed [ns].
 * @returns what ends it.
 */
export function watch(address, draw, receive) {
  return whileSeen(() => {
    const ending = new AbortController();
    const show = newestOnly(draw, ending.signal);
    follow(address, (jpeg, t_ns) => (receive(jpeg, t_ns), show(jpeg)), ending.signal);
    return () => ending.abort();
  }, RANKS.view);
}

async function follow(address, show, ended) {
  while (!ended.aborted) {
    try {
      const response = await fetch(address, { signal: ended });
      if (response.status === 401) await enter();
      if (response.ok) await readAll(response.body.getReader(), show);
    } catch {
      if (ended.aborted) return;
    }
    await new Promise((resolve) => setTimeout(resolve, AGAIN_MS));
  }
}

async function readAll(reader, show) {
  let rest = new Uint8Array();
  for (;;) {
    const { done, value } = await reader.read();
    if (done) return;
    const bytes = new Uint8Array(rest.length + value.length);
    bytes.set(rest);
    bytes.set(value, rest.length);
    rest = bytes.slice(cut(bytes, show));
  }
}

/** Show the newest whole picture in what came; returns where what is left begins. */
function cut(bytes, show) {
  let at = 0;
  let newest = null;
  let t_ns = null;
  for (;;) {
    const head = letters.decode(bytes.subarray(at, at + 400)).split(HEAD_END)[0];
    const begin = at + head.length + HEAD_END.length;
    const end = begin + Number(LENGTH.exec(head)?.[1]);
    if (!(end <= bytes.length)) break; // of the head or of the picture some is still to come
    newest = bytes.subarray(begin, end);
    t_ns = Number(TIME.exec(head)?.[1]); // rounded to what a number holds, as in JSON
    at = end;
  }
  if (newest) show(new Blob([newest], { type: "image/jpeg" }), t_ns);
  return at;
}

/** Decode one picture at a time: of those that came meanwhile the newest. */
function newestOnly(draw, ended) {
  let waiting = null;
  let isBusy = false;
  return async (jpeg) => {
    waiting = jpeg;
    if (isBusy) return;
    isBusy = true;
    while (waiting) {
      const next = waiting;
      waiting = null;
      const picture = await createImageBitmap(next).catch(() => null);
      if (picture && !ended.aborted) draw(picture);
      picture?.close();
    }
    isBusy = false;
  };
}
