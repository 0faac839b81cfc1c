/** Long work of the server, followed until it is over. */
import { placed } from "scm/shared/base.js";

const OVER = ["done", "failed", "cancelled"];
const LOOK_MS = 250;

export const isOver = ({ state }) => OVER.includes(state);

/** Follow an operation until it is over; `onUpdate` receives each state. */
export async function finished(operation, onUpdate = () => {}) {
  let row = operation;
  onUpdate(row);
  while (!isOver(row)) {
    await new Promise((resolve) => setTimeout(resolve, LOOK_MS));
    row = await lookedAt(row);
    onUpdate(row);
  }
  return row;
}

/** The link may break: then it is looked at again. A server that began anew knows nothing of it any more. */
async function lookedAt(row) {
  const response = await fetch(placed(`/api/v1/operations/${row.id}`)).catch(() => null);
  if (response?.status === 404) return { ...row, state: "failed", error: "The server was started anew: try again." };
  return response?.ok ? response.json() : row;
}
