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
  literal: boolean;
  line: number;
}

/** A hidden obstacle or an order, with its list and its index there. */
export interface DrawnObstacle {
  list: "obstacles" | "orders";
  index: number;
  /** The tick of an order. */
  at: number | null;
  type: string;
  region: number;
  from: number | null;
  until: number | null;
  traversable: boolean | null;
  /** The most ticks from its request to its resolution. */
  within: number | null;
  line: number;
}

export interface Drawing {
  run: Run;
  robots: DrawnRobot[];
  obstacles: DrawnObstacle[];
  names: Record<string, number>;
  areas: Record<string, number[]>;
  chargers: number[];
  /** By the path of their item and their key: text, line and column of the key, last line. */
  parts: Record<string, Record<string, [text: string, line: number, column: number, last: number]>>;
  /** Whether the map is drawn in the scenario itself. */
  grid: boolean;
  settings: { name: string; rounds: number; ticks: number; seed: number };
}

export interface Problem {
  line: number;
  column: number;
  found: string;
  hint: string;
}

export interface Kind {
  name: string;
  shape: string;
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
  /** Whether it has a literal form and a weaker one. */
  strict: boolean;
}

export interface Palette {
  objectives: ObjectiveKind[];
  robots: { name: string; shape: string; turns: boolean; layer: string; can: string[] }[];
  /** Return whether a type blocks no robot: it can also be ordered in a robot's region. */
  obstacles: Kind[];
  keys: Record<"scenario" | "robot" | "objective" | "obstacle" | "order" | "model" | "type", KeyAbout[]>;
}

/** A key that has a field of text. */
export interface KeyAbout {
  key: string;
  about: string;
}

export interface Repair {
  kind: string;
  change: [item: string, value: string][];
}

export interface Verdict {
  robot: string;
  verdict: "realizable" | "unrealizable" | "limit";
  because?: string;
  allows?: string;
  confined?: number[];
  lost?: number[];
  repairs?: Repair[];
}

export interface Doc {
  text: string;
  revision: number;
  /** A number that differs for each scenario created or opened. */
  origin: number;
  undoable: boolean;
  redoable: boolean;
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
  | { does: "order"; type: string }
  /** Order a delivery from region `from`, once it was clicked. */
  | { does: "delivery"; from: number | null }
  | { does: "charger" }
  | { does: "name" }
  /** Draws `area`, from `corner` if that was clicked. */
  | { does: "area"; area: string | null; corner: number | null }
  | { does: "objective"; robot: string; kind: ObjectiveKind; targets: Target[] };

/** A region, several alternative regions, or the name of an area. */
export type Target = number | number[] | string;

export type Chosen = { robot: string } | { obstacle: string } | { region: number; naming?: boolean } | { area: string; naming?: boolean } | null;

/** The path of an obstacle or an order in the document, valid until the text changes. */
export function idOf(obstacle: DrawnObstacle): string {
  return `${obstacle.list}/${obstacle.index}`;
}
