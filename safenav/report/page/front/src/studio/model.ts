/** Messages of the studio about the scenario being drawn. */

import type { Run } from "../run/run";

export interface DrawnRobot {
  name: string;
  model: string;
  start: number;
  heading: string | null;
  kind: string | null;
  targets: number[][];
  /** The area that a target names, or null. */
  areas: (string | null)[];
}

/** A hidden obstacle, with its index in the list of the scenario. */
export interface DrawnObstacle {
  index: number;
  type: string;
  region: number;
}

export interface Drawing {
  run: Run;
  robots: DrawnRobot[];
  obstacles: DrawnObstacle[];
  /** Whether the map is drawn in the scenario itself. */
  grid: boolean;
}

export interface Problem {
  line: number;
  column: number;
  found: string;
  hint: string;
}

export interface Kind {
  name: string;
  actions: string[];
  truth: boolean;
  blocks: boolean;
}

/** The actions that resolve it, in words. */
export function resolving(kind: Kind): string {
  return `'${kind.actions.join(" and ")}'`;
}

/** Whether the robots have the actions of a type that is ordered. */
export function isOrder(kind: Kind, robots: readonly { can: readonly string[] }[]): boolean {
  return !kind.blocks && kind.actions.every((action) => robots.some(({ can }) => can.includes(action)));
}

/** A kind of objective about targets: the number of targets (`most` null: unlimited), and its words. */
export interface ObjectiveKind {
  kind: string;
  label: string;
  meaning: string;
  drawing: string;
  least: number;
  most: number | null;
  /** Whether its target is written without a list. */
  one: boolean;
}

export interface Palette {
  objectives: ObjectiveKind[];
  robots: { name: string; turns: boolean; layer: string; can: string[] }[];
  /** Return whether a type blocks no robot: it can also be ordered in a robot's region. */
  obstacles: Kind[];
}

export interface Verdict {
  robot: string;
  verdict: "realizable" | "unrealizable" | "unknown";
  because?: string;
  allows?: string;
}

export interface Doc {
  text: string;
  revision: number;
  /** A number that differs for each scenario created or opened. */
  origin: number;
  dirty: boolean;
  file: string | null;
  drawing: Drawing | null;
  palette: Palette;
  problems: Problem[];
}

/** The effect of the next press on the drawing. */
export type Pen =
  | { does: "select" }
  | { does: "wall" }
  | { does: "floor" }
  | { does: "robot"; model: string; turns: boolean }
  | { does: "obstacle"; type: string }
  | { does: "objective"; robot: string; kind: ObjectiveKind; targets: number[] };

/** A region, several alternative regions, or the name of an area. */
export type Target = number | number[] | string;

/** The selection: a robot by its name, or an obstacle by its index. */
export type Chosen = string | number | null;

/** Return the targets of a robot as an edit writes them. */
export function targetsOf(robot: DrawnRobot): Target[] {
  return robot.targets.map((regions, i) => robot.areas[i] ?? (regions.length === 1 ? regions[0]! : regions));
}
