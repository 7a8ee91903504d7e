/** The entry of all pages: a run that the page carries, flat or with its motion; the studio's chunk shows a stream. */

import { render } from "preact";
import { App } from "./app";
import { extentOf } from "./map/camera";
import { flatStage, type Stage } from "./map/map";
import { followLinks, Player } from "./run/player";
import { inflated, type Run } from "./run/run";
import "./page.css";

declare const safenavScene: typeof import("./view3d/stage");

const text = (id: string): string | null => document.getElementById(id)?.textContent ?? null;

/** The stage of a page with a motion: that of the chunk; without WebGL, the flat map. */
async function solidStage(run: Run, motion: string): Promise<Stage> {
  const chunk = Object.assign(document.createElement("script"), { textContent: await inflated(text("scene")!) });
  document.body.append(chunk);
  return safenavScene.stage3d(run, JSON.parse(motion)).catch(() => flatStage(extentOf(run)));
}

async function show(run: Run, motion: string | null): Promise<void> {
  const player = new Player(run.last, run.times);
  player.seek(run.opens);
  const stage = motion === null ? flatStage(extentOf(run)) : await solidStage(run, motion);
  render(<App run={run} player={player} stage={stage} />, document.getElementById("app")!);
  followLinks(player);
}

const carried = text("run");
if (carried !== null) void show(JSON.parse(carried), text("motion"));
