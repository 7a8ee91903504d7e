/** Reads the run and its motion that the 3D page carries and shows them. */

import { render } from "preact";
import { App } from "./app";
import { followLinks } from "./run/link";
import { Player } from "./run/player";
import type { Run } from "./run/run";
import { decoded, type Motion } from "./view3d/motion";
import { stage3d } from "./view3d/stage";
import "./page.css";
import "./view3d/view3d.css";

const text = (id: string): string => document.getElementById(id)!.textContent!;
const run = JSON.parse(text("run")) as Run;
const motion = JSON.parse(text("motion")) as Motion;
const player = new Player(run.last, run.times);

void decoded(motion).then((robots) => {
  const stage = stage3d(run, motion, robots);
  render(<App run={run} player={player} stage={stage} />, document.getElementById("app")!);
  followLinks(player);
});
