/** The view of the 3D scene as the page's keys and panels know it; the scene moves its camera. */

import type { Eye } from "../map/camera";
import { at, type EventKind, type Run } from "../run/run";
import { centreOf } from "./floor";
import type { Motion } from "./motion";

/** Around the map, from above, following the story, or following the robot with that index. */
export type View = "orbit" | "top" | "story" | number;

/** The part of the scene that an eye needs. */
export interface Lens {
  look(view: View): void;
  dolly(factor: number): void;
  slide(dx: number, dy: number): void;
  aim(x: number, y: number): void;
}

export class OrbitEye implements Eye {
  view: View = "orbit";
  private lens: Lens | null = null;
  private moved = false;
  private readonly listeners = new Set<() => void>();

  attach(lens: Lens | null): void {
    this.lens = lens;
  }

  get followed(): number | null {
    return typeof this.view === "number" ? this.view : null;
  }

  get isWhole(): boolean {
    return this.followed === null && this.view !== "story" && !this.moved;
  }

  onChange(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  choose(view: View): void {
    this.view = view;
    this.moved = false;
    this.lens?.look(view);
    this.changed();
  }

  fit(): void {
    this.choose(this.view === "top" ? "top" : "orbit");
  }

  follow(robot: number | null): void {
    this.choose(robot ?? "orbit");
  }

  zoom(factor: number): void {
    this.move(() => this.lens?.dolly(1 / factor));
  }

  pan(dx: number, dy: number): void {
    this.move(() => this.lens?.slide(dx, dy));
  }

  show(x: number, y: number): void {
    if (this.view === "story") return;
    this.lens?.aim(x, y);
    this.changed();
  }

  private move(how: () => void): void {
    this.moved = true;
    how();
    this.changed();
  }

  private changed(): void {
    for (const listener of this.listeners) listener();
  }
}

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
