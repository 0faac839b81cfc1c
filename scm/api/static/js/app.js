/** The dashboard: lays out the panels and starts the store. */
import { render } from "preact";
import { html } from "./html.js";
import { CarPanel, chosenCar } from "./car_panel.js";
import { CarsTable } from "./cars_table.js";
import { EventFeed } from "./event_feed.js";
import { EyePanel } from "./eye_panel.js";
import { MapPanel } from "./map_panel.js";
import { KeyDialog, Notices } from "./notices.js";
import { SignalsPanel } from "./signals_panel.js";
import { StationsPanel } from "./stations_panel.js";
import { Banners, TitleBar } from "./title_bar.js";
import { link, start } from "./store.js";

function Dashboard() {
  const car = chosenCar();
  return html`
    <div class="page" data-link=${link.value}>
      <${TitleBar} />
      <${Banners} />
      <main>
        <div class="wide">
          <${MapPanel} />
          <div class="below">
            <${CarsTable} />
            <${EventFeed} />
          </div>
        </div>
        <div class="side">
          <${SignalsPanel} />
          ${car ? html`<${CarPanel} car=${car} />` : html`<${EyePanel} />`}
          <${StationsPanel} />
        </div>
      </main>
      <${Notices} />
      <${KeyDialog} />
    </div>
  `;
}

const root = document.getElementById("app");
root.replaceChildren();
render(html`<${Dashboard} />`, root);
start();
