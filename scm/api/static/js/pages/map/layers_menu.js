/** Which layers the map shows: a button, and under it a box for each. */
import { useEffect, useRef, useState } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { LAYERS, layers, show } from "scm/pages/map/layers.js";

export function LayersMenu() {
  const [open, setOpen] = useState(false);
  const menu = useRef(null);
  useEffect(() => {
    if (!open) return undefined;
    const leave = (event) => !menu.current.contains(event.target) && setOpen(false);
    document.addEventListener("pointerdown", leave);
    return () => document.removeEventListener("pointerdown", leave);
  }, [open]);
  const onKeyDown = (event) => {
    if (event.key !== "Escape") return;
    setOpen(false);
    menu.current.querySelector("button").focus();
  };
  return html`
    <div class="layers" ref=${menu} onKeyDown=${onKeyDown}>
      <button aria-expanded=${open} aria-controls="layers-list" onClick=${() => setOpen(!open)}>
        Layers
      </button>
      <ul id="layers-list" hidden=${!open}>
        ${Object.entries(LAYERS).map(
          ([name, title]) => html`
            <li key=${name}>
              <label>
                <input
                  type="checkbox"
                  name=${name}
                  checked=${layers.value[name]}
                  onChange=${(event) => show(name, event.target.checked)}
                />
                ${title}
              </label>
            </li>
          `,
        )}
      </ul>
    </div>
  `;
}
