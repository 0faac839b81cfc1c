/** The one place that ties htm to Preact, and addresses of ours to where the dashboard stands. */
import { h } from "preact";
import htm from "htm";
import { placed } from "scm/shared/base.js";

const ADDRESSES = ["href", "src"];

export const html = htm.bind((type, props, ...children) => {
  if (typeof type !== "string" || !props) return h(type, props, ...children);
  const changed = ADDRESSES.filter((name) => typeof props[name] === "string");
  const own = changed.length ? { ...props } : props;
  for (const name of changed) own[name] = placed(props[name]);
  return h(type, own, ...children);
});
