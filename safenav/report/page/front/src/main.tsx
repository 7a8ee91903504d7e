/** Reads the run that the page carries and shows it. */

import { render } from "preact";
import { App } from "./app";
import { followLinks } from "./run/link";
import { Player } from "./run/player";
import type { Run } from "./run/run";
import { extentOf } from "./map/camera";
import { flatStage } from "./map/stage";
import "./page.css";

const run = JSON.parse(document.getElementById("run")!.textContent!) as Run;
const player = new Player(run.last, run.times);
player.seek(run.opens);
render(<App run={run} player={player} stage={flatStage(extentOf(run))} />, document.getElementById("app")!);
followLinks(player);
