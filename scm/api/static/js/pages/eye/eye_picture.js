/** The picture of an overhead camera on its canvas: the newest one, with the tags found in it. */

const TAGS_KEPT = 16; // frames: three seconds
const AHEAD_NS = 5_000_000_000n; // what was fetched is never so much newer than what was named

/**
 * Follows one camera: fetches one picture at a time, and draws it with its own tags.
 *
 * The newest is asked for, not the one that the stream named: a page that is busy, as every page is
 * when it opens, hears the name late and would show the cars where they were a second ago.
 */
export class EyePicture {
  #camera;
  #canvas;
  #onDrawn;
  #tags = new Map(); // by exposure
  #named = null; // exposures in ns, as text: too long for a number
  #fetched = null;
  #waiting = null; // a picture whose tags the stream has not told yet
  #busy = false;

  /** @param onDrawn is told the exposure of every picture drawn */
  constructor(camera, canvas, onDrawn) {
    this.#camera = camera;
    this.#canvas = canvas;
    this.#onDrawn = onDrawn;
  }

  /** Take what the stream tells of the camera's newest frame. */
  hear({ frame_t_ns, tags }) {
    if (frame_t_ns === null) return;
    this.#named = frame_t_ns;
    this.#tags.set(frame_t_ns, tags);
    if (this.#tags.size > TAGS_KEPT) this.#tags.delete(this.#tags.keys().next().value);
    this.#drawWaiting();
    this.#follow();
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
      // No picture this time; the next name that the stream tells brings the next try.
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
    const response = await fetch(`/api/v1/eye/cameras/${this.#camera}/frame.jpg`);
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
    draw(this.#canvas, image, tags ?? []);
    this.#onDrawn(t_ns);
  }
}

function draw(canvas, image, tags) {
  canvas.width = image.width;
  canvas.height = image.height;
  const paper = canvas.getContext("2d");
  paper.drawImage(image, 0, 0);
  const shown = canvas.clientWidth || canvas.width;
  const pixel = canvas.width / shown; // one pixel of the screen, in the picture's
  for (const tag of tags) drawTag(paper, tag, pixel);
}

function drawTag(paper, tag, pixel) {
  paper.beginPath();
  for (const [x, y] of tag.corners_px) paper.lineTo(x + 0.5, y + 0.5);
  paper.closePath();
  paper.lineJoin = "round";
  paper.lineWidth = 4 * pixel;
  paper.strokeStyle = "rgba(0, 20, 15, 0.65)";
  paper.stroke();
  paper.lineWidth = 2 * pixel;
  paper.strokeStyle = "#38e8b0";
  paper.stroke();
  const top = Math.min(...tag.corners_px.map(([, y]) => y));
  const text = String(tag.tag_id);
  paper.font = `600 ${11 * pixel}px system-ui, sans-serif`;
  paper.textAlign = "center";
  const width = paper.measureText(text).width + 8 * pixel;
  const [x] = tag.centre_px;
  const y = Math.max(top - 4 * pixel, 15 * pixel);
  paper.fillStyle = "rgba(6, 20, 16, 0.85)";
  paper.beginPath();
  paper.roundRect(x - width / 2, y - 14 * pixel, width, 15 * pixel, 3 * pixel);
  paper.fill();
  paper.fillStyle = "#7ff5d2";
  paper.fillText(text, x, y - 3 * pixel);
}
