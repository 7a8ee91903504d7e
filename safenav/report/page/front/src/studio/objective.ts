/** Targets of an objective as they are chosen, one after the other. */

import type { Say } from "../live/player";
import type { DrawnRobot, Pen, Target } from "./model";

/** Add a target; the objective is set when it has enough of them. */
export function choose(pen: Pen & { does: "objective" }, target: Target, setPen: (pen: Pen) => void, say: Say): void {
  const targets = [...pen.targets, target];
  const { kind, least, most } = pen.kind;
  if (targets.length >= least) say("edit", { op: "set_objective", robot: pen.robot, kind, regions: targets });
  setPen(targets.length >= (most ?? Infinity) ? { does: "select" } : { ...pen, targets });
}

/** Return the targets of a robot as an edit writes them. */
export function targetsOf(robot: DrawnRobot): Target[] {
  return robot.targets.map((regions, i) => robot.areas[i] ?? (regions.length === 1 ? regions[0]! : regions));
}
