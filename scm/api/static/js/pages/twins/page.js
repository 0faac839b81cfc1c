/** Twins: `/twins` lists all watched cars, `/twins/n1` shows the changes of one and the versions of its file. */
import { html } from "scm/shared/html.js";
import { route } from "scm/shell/router.js";
import { useTopics } from "scm/shell/store.js";
import { Car } from "scm/pages/twins/car.js";
import { List } from "scm/pages/twins/list.js";

export function Page() {
  useTopics("twins", "stations");
  const name = route.value.rest;
  return name ? html`<${Car} key=${name} name=${name} />` : html`<${List} />`;
}
