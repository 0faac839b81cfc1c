/** The picture of an overhead camera on its canvas: the newest one, with the tags found in it. */
import { drawTag } from "scm/pages/eye/tag_shape.js";
import { placed } from "scm/shared/base.js";

const MAX_TAGS = 16; // frames: three seconds
const AHEAD_NS = 5_000_000_000n; // what was fetched is never so much newer than what was named
const CLOSEST = 12;

/**
 * Follows one camera: fetches one picture at a time, and draws it with its own tags.
 *
 * The newest is requested, not the one that the stream named: a busy page, as every page is
 * when it opens, receives the name late and would show the cars where they were a second ago.
 */
export class EyePicture {
  #camera;
  #canvas;
  #onDrawn;
  #tags = new Map(); // by exposure
  #known = new Map(); // whose tag it is, by id
  #named = null; // exposures in ns, as text: too long for a number
  #fetched = null;
  #waiting = null; // a picture whose tags have not arrived yet
  #shown = null;
  #busy = false;
  #layers = {};
  #chosen = null;
  #zoom = 1;
  #middle = [0.5, 0.5]; // of what is shown, in parts of the picture

  /** @param onDrawn receives the exposure of every picture drawn */
  constructor(camera, canvas, onDrawn) {
    this.#camera = camera;
    this.#canvas = canvas;
    this.#onDrawn = onDrawn;
  }

  /** Apply the stream's state of the camera's newest frame. */
  update({ frame_t_ns, tags_t_ns, tags, known }) {
    if (frame_t_ns === null) return;
    this.#named = frame_t_ns;
    this.#known = new Map(known.map((one) => [one.tag_id, one]));
    if (tags_t_ns !== null) this.#tags.set(tags_t_ns, tags);
    if (this.#shown?.t_ns === tags_t_ns && this.#shown.tags !== tags) {
      this.#shown.tags = tags; // they came after their picture
      this.draw();
    }
    if (this.#tags.size > MAX_TAGS) this.#tags.delete(this.#tags.keys().next().value);
    this.#drawWaiting();
    this.#follow();
  }

  /** Draw these layers over the picture (`outline`, `id`, `axes`, `name`), one tag marked. */
  show(layers, chosen) {
    [this.#layers, this.#chosen] = [layers, chosen];
    this.draw();
  }

  /** How many times larger than the whole picture. */
  get zoom() {
    return this.#zoom;
  }

  /** Come closer or go back; the spot stays where it is (in parts of what is shown). */
  zoomBy(factor, [x, y] = [0.5, 0.5]) {
    const before = this.#zoom;
    this.#zoom = Math.min(CLOSEST, Math.max(1, before * factor));
    const gain = 1 / before - 1 / this.#zoom;
    this.#moveTo(this.#middle[0] + (x - 0.5) * gain, this.#middle[1] + (y - 0.5) * gain);
  }

  /** Shift what is shown, by parts of it. */
  panBy(x, y) {
    this.#moveTo(this.#middle[0] - x / this.#zoom, this.#middle[1] - y / this.#zoom);
  }

  /** Show the whole picture again. */
  fit() {
    this.#zoom = 1;
    this.#moveTo(0.5, 0.5);
  }

  #moveTo(x, y) {
    const half = 0.5 / this.#zoom;
    const within = (value) => Math.min(1 - half, Math.max(half, value));
    this.#middle = [within(x), within(y)];
    this.draw();
  }

  /** Fetch until what was fetched is as new as what was named. */
  async #follow() {
    if (this.#busy) return;
    this.#busy = true;
    try {
      while (this.#isBehind()) {
        const before = this.#fetched;
        await this.#fetchNewest();
        if (this.#fetched === before) break; // the server has nothing newer
      }
    } catch {
      // No picture this time; the next name from the stream triggers the next try.
    } finally {
      this.#busy = false;
    }
  }

  /** Whether the stream named a newer picture, or one of a run whose time began anew. */
  #isBehind() {
    if (this.#fetched === null) return true;
    const ahead_ns = BigInt(this.#fetched) - BigInt(this.#named);
    return ahead_ns < 0n || ahead_ns > AHEAD_NS;
  }

  async #fetchNewest() {
    const response = await fetch(placed(`/api/v1/eye/cameras/${this.#camera}/frame.jpg`));
    if (!response.ok) return;
    const t_ns = response.headers.get("X-Time-Ns");
    const image = await createImageBitmap(await response.blob());
    this.#fetched = t_ns;
    this.#waiting = { t_ns, image };
    this.#drawWaiting();
  }

  /** Draw what was fetched once its tags are known, or never will be. */
  #drawWaiting() {
    if (this.#waiting === null) return;
    const { t_ns, image } = this.#waiting;
    const tags = this.#tags.get(t_ns);
    if (!tags && BigInt(t_ns) > BigInt(this.#named)) return;
    this.#waiting = null;
    this.#shown?.image.close();
    this.#shown = { t_ns, image, tags: tags ?? [] };
    this.draw();
    this.#onDrawn(t_ns);
  }

  /** Draw what is held, sharp at any size of the canvas on the screen. */
  draw() {
    if (this.#shown === null) return;
    const { image, tags } = this.#shown;
    const canvas = this.#canvas;
    const ratio = window.devicePixelRatio || 1;
    const wide = Math.round((canvas.clientWidth || image.width) * ratio);
    const high = Math.round((wide * image.height) / image.width);
    if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
    const paper = canvas.getContext("2d");
    const scale = (wide / image.width) * this.#zoom;
    const left = wide / 2 - this.#middle[0] * image.width * scale;
    const top = high / 2 - this.#middle[1] * image.height * scale;
    paper.setTransform(1, 0, 0, 1, 0, 0);
    paper.imageSmoothingQuality = "high";
    paper.drawImage(image, left, top, image.width * scale, image.height * scale);
    const at = ([x, y]) => [left + (x + 0.5) * scale, top + (y + 0.5) * scale];
    for (const tag of tags) {
      const known = this.#known.get(tag.tag_id);
      drawTag(paper, tag, known, at, this.#layers, ratio, this.#chosen === tag.tag_id);
    }
  }
}
