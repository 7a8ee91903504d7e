/** The subject of the camera that follows the story. */

import { at, type EventKind, type Run } from "../run/run";
import { centreOf } from "./floor";
import type { Motion } from "./motion";

const KINDS: ReadonlySet<EventKind> = new Set(["violation", "request", "resolved", "blocked", "outcome"]);
/** Seconds by which the camera turns to an event before it happens. */
const AHEAD = 2;

type Point = [x: number, y: number];

/**
 * Return the subject of the story at a time, as points in metres: the robots and obstacle of an open request, else
 * the place and robot of the last important event, else all robots.
 */
export function focusAt(run: Run, motion: Motion, seconds: number, robotAt: (robot: number) => Point): Point[] {
  const told = run.events.filter((event) => KINDS.has(event[1]) && run.times![event[0]]! <= seconds + AHEAD);
  const last = told[told.length - 1];
  if (last === undefined || last[1] === "outcome") return run.robots.map((_, i) => robotAt(i));
  const frames = at(run.stack, last[0])[1];
  const points: Point[] = [];
  const involved = new Set<string>(frames.flatMap(([, , requester, helpers]) => [requester ?? "", ...helpers]));
  run.robots.forEach((robot, i) => {
    if (i === last[3] || involved.has(robot.name)) points.push(robotAt(i));
  });
  if (last[4] >= 0) points.push(centreOf(run, motion.side, last[4]));
  return points.length > 0 ? points : run.robots.map((_, i) => robotAt(i));
}
