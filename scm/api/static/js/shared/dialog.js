/** A modal question over the page: Escape and a click beside it mean no. What has `data-first` gets the focus. */
import { useLayoutEffect, useRef } from "preact/hooks";
import { html } from "scm/shared/html.js";
import { Notices } from "scm/shell/notices.js";

export function Dialog({ title, onClose, children }) {
  const dialog = useRef(null);
  useLayoutEffect(() => {
    dialog.current.showModal();
    dialog.current.querySelector("[data-first]")?.focus();
  }, []);
  const onClick = (event) => {
    if (event.target === dialog.current) onClose();
  };
  const onCancel = (event) => {
    event.preventDefault();
    onClose();
  };
  return html`
    <dialog ref=${dialog} aria-label=${title} onClick=${onClick} onCancel=${onCancel}>
      <div class="question"><h2>${title}</h2>${children}</div>
      <${Notices} />
    </dialog>
  `;
}
