/** Marks one moment of the recording in a report's maps and time line: by pointer or by slider. */
import { short, unitText } from "scm/pages/mismatch/words.js";

const HINT = "Point at a map or the time line, or move the slider: all show the same moment.";

export function linkMoments(root, drawn) {
  const timeLine = root.querySelector("#when svg[data-across]");
  const longest = drawn.residuals[0];
  if (!timeLine || !longest?.t_s.length) return;
  const onFloor = drawn.residuals.filter((one) => one.x_m.some((value) => value !== null));
  const maps = [...root.querySelectorAll("#where svg[data-across]")].slice(0, onFloor.length);
  const cursor = mark(timeLine, "path");
  const dots = maps.map((map) => mark(map, "circle"));
  const slider = Object.assign(document.createElement("input"), { type: "range", min: 0, max: longest.t_s.length - 1, value: 0 });
  slider.setAttribute("aria-label", "Moment of the recording");
  const words = Object.assign(document.createElement("p"), { className: "moment", textContent: HINT });
  timeLine.closest("figure").append(slider, words);

  const at = (t) => {
    const x = axis(timeLine, "across").pixel(t);
    cursor.setAttribute("d", `M${x} 0V${timeLine.viewBox.baseVal.height}`);
    maps.forEach((map, i) => {
      const row = rowAt(onFloor[i], t);
      const [px, py] = [onFloor[i].x_m[row], onFloor[i].y_m[row]];
      if (px === null || py === null) return dots[i].removeAttribute("r");
      dots[i].setAttribute("cx", axis(map, "across").pixel(px));
      dots[i].setAttribute("cy", axis(map, "up").pixel(py));
      dots[i].setAttribute("r", 7);
    });
    slider.value = rowAt(longest, t);
    words.textContent = textAt(drawn.residuals, t);
    slider.setAttribute("aria-valuetext", words.textContent);
  };
  slider.addEventListener("input", () => at(longest.t_s[Number(slider.value)]));
  follow(timeLine, (x) => at(axis(timeLine, "across").value(x)));
  maps.forEach((map, i) => {
    const [across, up] = [axis(map, "across"), axis(map, "up")];
    follow(map, (x, y) => at(nearest(onFloor[i], across.value(x), up.value(y))));
  });
}

function mark(svg, shape) {
  const made = document.createElementNS(svg.namespaceURI, shape);
  made.setAttribute("class", "moment");
  made.setAttribute("fill", "none");
  made.setAttribute("stroke", "currentColor");
  made.setAttribute("stroke-width", shape === "path" ? 1.5 : 2.5);
  svg.append(made);
  return made;
}

/** An axis that the picture states in its data: low, high, pixel of low, pixels to high. */
function axis(svg, name) {
  const [low, high, start, length] = svg.dataset[name].split(" ").map(Number);
  return {
    pixel: (value) => start + ((value - low) / (high - low)) * length,
    value: (pixel) => low + ((pixel - start) / length) * (high - low),
  };
}

function follow(svg, moved) {
  const onMove = (event) => {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    moved(point.x, point.y);
  };
  svg.addEventListener("pointermove", onMove);
  svg.addEventListener("pointerdown", onMove);
}

function rowAt({ t_s }, t) {
  const row = t_s.findIndex((one) => one >= t);
  return row < 0 ? t_s.length - 1 : row;
}

/** When the car was nearest to a place. */
function nearest({ t_s, x_m, y_m }, x, y) {
  const far = x_m.map((one, i) => (one === null || y_m[i] === null ? Infinity : Math.hypot(one - x, y_m[i] - y)));
  return t_s[far.indexOf(Math.min(...far))];
}

function textAt(residuals, t) {
  const first = residuals[0];
  const row = rowAt(first, t);
  const place = first.x_m[row] === null ? "" : ` at x ${short(first.x_m[row])} m, y ${short(first.y_m[row])} m`;
  const each = residuals.map((one) => {
    const i = rowAt(one, t);
    return `${one.channel} ${short(one.before[i])} before, ${short(one.after[i])} after (± ${short(one.std[i])} ${unitText(one.unit)})`;
  });
  return `${short(first.t_s[row])} s${place}: ${each.join("; ")}`;
}
