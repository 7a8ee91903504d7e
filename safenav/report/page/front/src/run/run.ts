/**
 * The data of the page, written by `safenav/report/page/html.py`, and queries for the state
 * at a tick. Changing values are lists of [tick, value...] in
 * rising order; each holds until the next.
 */

import { useCallback, useReducer } from "preact/hooks";

export const STATUSES = ["hidden", "found", "requested", "resolved", "blocked"] as const;

/** `absent`: it has not appeared yet, or has disappeared. */
export type Status = (typeof STATUSES)[number] | "absent";

/** The words for an obstacle that is not ordered yet. */
export const UNORDERED = "not ordered yet";

/**
 * The kinds of events by rank: events of the story, causes from outside, and the rest; each with its colour, and its
 * meaning in the legend unless it has the sign of a status.
 */
export const EVENTS = {
  outcome: ["story", "quiet", "end of the run"],
  waiting: ["story", "found", "waits for an operator"],
  operator: ["story", "stack", "operator intervenes"],
  violation: ["story", "found", null],
  blocked: ["story", "blocked", null],
  resolved: ["story", "resolved", null],
  request: ["story", "requested", null],
  failure: ["story", "found", "failure"],
  deadline: ["story", "found", "deadline missed"],
  assumption: ["story", "found", "assumption broken"],
  inputs: ["outside", "found", "inputs changed"],
  appeared: ["outside", "found", "obstacle appears"],
  gone: ["outside", "resolved", "obstacle disappears"],
  truth: ["outside", "found", "truth set"],
  objective: ["outside", "found", "objective changed"],
  service: ["outside", "found", "in or out of service"],
  paused: ["outside", "quiet", "waits for a change"],
  reopened: ["outside", "found", "may be resolvable again"],
  act: ["rest", "resolved", "action begins"],
  push: ["rest", "stack", "objectives pushed"],
  pop: ["rest", "stack", "objectives restored"],
  synthesis: ["rest", "synthesis", "synthesis"],
  plan: ["rest", "stack", "joint plan begins"],
  plan_end: ["rest", "stack", "joint plan ends"],
  goal: ["rest", "quiet", "goal reached"],
} as const;

export type EventKind = keyof typeof EVENTS;

export interface Look {
  path: string;
  colour: string;
  ink: string;
  letters: string;
  /** Size and baseline of the letters, in radii of the body. */
  size: number;
  drop: number;
}

/** [from tick, in words, all target regions, regions that it avoids] */
export type Task = [tick: number, words: string, targets: number[], avoid: number[]];

/** [from tick, rounds done, target reached last or -1] */
export type Progress = [tick: number, rounds: number, reached: number];

export type Step = [first: number, last: number, toward: number, begin: number, end: number];

export interface Robot {
  name: string;
  model: string;
  can: string[];
  /** Region after each tick. */
  path: number[];
  /**
   * Steps of several ticks: after ticks `first` to `last` it is between its region and `toward`; it
   * departs at `begin` and arrives at `end`, in ticks, or in seconds where the run has a clock.
   */
  steps: Step[];
  /** One of N E S W for each tick, or null for a robot without a heading. */
  headings: string | null;
  look: Look;
  tasks: Task[];
  progress: Progress[];
  /** The charge of a robot with a battery, in percent of its capacity. */
  charge: [tick: number, percent: number][] | null;
  /** Whether it is out of service, from ticks on. */
  out: [tick: number, out: boolean][];
  /** By index of the other robot. */
  beliefs: Record<number, BeliefChange[]>;
}

/** [from tick, 1 if it sees the other, the place in `Run.sets` of the regions where the other may be, -1 for unknown] */
export type BeliefChange = [tick: number, seen: number, set: number];

export interface Obstacle {
  name: string;
  /** With the name of its region, if that has one. */
  label: string;
  type: string;
  /** The silhouette of its type, in units of [-1, 1]; empty for types that the library lacks. */
  shape: string;
  /** That of the type when it is resolved. */
  opened: string;
  region: number;
  action: string;
  /** Each of its needs, in words. */
  needs: string[];
  ordered: boolean;
  status: [tick: number, status: Status][];
  /** The number of its needs that are fulfilled. */
  met: [tick: number, needs: number][];
  /** The robots that carry it. */
  carried: [tick: number, robots: number[]][];
}

/** Helpers: who resolves the obstacle. */
export type Frame = [about: string, requester: string | null, helpers: string[]];

/** [tick, kind, text, index of the robot or -1, region or -1] */
export type RunEvent = [tick: number, kind: EventKind, text: string, robot: number, region: number];

export interface Ending {
  outcome: string;
  explanation: string;
}

export interface Run {
  name: string;
  source: string;
  version: string;
  rows: number;
  cols: number;
  grid: string[];
  /** The names that the scenario gives regions. */
  names: Record<number, string>;
  /** The named sets of regions. */
  areas: Record<string, number[]>;
  /** The regions where batteries are charged, and how they are marked. */
  chargers: number[];
  charger: string;
  /** Regions with at most one of these robots at a time. */
  exclusions: [robots: string[], regions: number[]][];
  last: number;
  /** Seconds of each tick if the run has a clock: its ticks are the instants of its events. */
  times: number[] | null;
  robots: Robot[];
  obstacles: Obstacle[];
  stack: [tick: number, frames: Frame[]][];
  /** Sets of regions, as `regionsOf` reads them. */
  sets: string[];
  events: RunEvent[];
  ending: Ending | null;
  /** The tick at which the page opens: the last one of a run that failed. */
  opens: number;
  nose: string;
  marks: {
    status: Record<(typeof STATUSES)[number], { path: string; meaning: string }>;
    event: Record<EventKind, string>;
    /** The silhouette of a load whose type has none. */
    load: string;
  };
}

/** The headings of scenarios. */
export const HEADINGS = ["north", "east", "south", "west"];

/** Return how many of `size` indices, the first ones, have a property. */
export function countOf(size: number, has: (index: number) => boolean): number {
  let [low, high] = [0, size];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (has(middle)) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** Return the entry that holds after all events of that tick. */
export function at<T extends [number, ...unknown[]]>(changes: readonly T[], tick: number): T {
  return changes[Math.max(0, countOf(changes.length, (i) => changes[i]![0] <= tick) - 1)]!;
}

/**
 * The current target of a robot, which it reaches next, also after another task; -1 if that is not known (in a live
 * run, of several targets). Also the tick until which it is on the way there.
 */
export function aimAt(run: Run, robot: Robot, tick: number): { region: number; tick: number } {
  const until = robot.tasks.find(([from]) => from > tick)?.[0] ?? run.last;
  const targets = at(robot.tasks, tick)[2];
  const next = robot.progress.find(([from, , reached]) => from > tick && from <= until && targets.includes(reached));
  if (next !== undefined) return { region: next[2], tick: next[0] };
  const there = robot.path[until]!;
  return { region: targets.includes(there) ? there : targets.length === 1 ? targets[0]! : -1, tick: until };
}

export interface Pose {
  /** Column and row of the centre, in cells; fractions between two ticks. */
  x: number;
  y: number;
  /** Degrees clockwise from north, or null. */
  heading: number | null;
}

/** The obstacles that a robot carries after a tick. */
export function loadsOf(run: Run, robot: number, tick: number): Obstacle[] {
  return run.obstacles.filter((obstacle) => at(obstacle.carried, tick)[1].includes(robot));
}

/** The step that a robot is making after a tick. */
export function transitAt(robot: Robot, tick: number): Step | null {
  if (robot.steps.length === 0) return null;
  const step = at(robot.steps, tick);
  return tick < step[0] || tick > step[1] ? null : step;
}

/** The part of a failed step after which a robot turns back. */
const TURNED_BACK = 0.4;

/** A robot's position at a moment, in ticks, or in seconds if the run has a clock. */
export function poseAt(run: Run, robot: Robot, time: number): Pose {
  const tick = tickAt(run, time);
  const next = Math.min(tick + 1, run.last);
  const origin = robot.path[tick]!;
  // Without a clock, a robot departs in the tick before `first`.
  const step = transitAt(robot, tick) ?? (run.times ? null : transitAt(robot, next));
  let [goal, after, part] = run.times ? [origin, tick, 0] : [robot.path[next]!, next, time - tick];
  if (step !== null) {
    const [, last, toward, begin, end] = step;
    [goal, after] = [toward, Math.min(last + 1, run.last)];
    part = clamp((time - begin) / Math.max(end - begin, 1e-9), 0, 1);
    if (last < run.last && robot.path[after] !== goal) {
      [after, part] = [tick, TURNED_BACK * (1 - Math.abs(2 * part - 1))];
    }
  }
  const [from, to] = [placeOf(run, origin), placeOf(run, goal)];
  const [x, y] = [0, 1].map((axis) => from[axis]! + (to[axis]! - from[axis]!) * part) as [number, number];
  if (robot.headings === null) return { x, y, heading: null };
  const [facing, faces] = [tick, after].map((when) => "NESW".indexOf(robot.headings![when]!) * 90);
  const turn = ((faces! - facing! + 540) % 360) - 180;
  // It has turned by half the step, so that it faces its direction of motion.
  return { x, y, heading: facing! + turn * Math.min(1, 2 * part) };
}

/** Return the last tick, of a run or a player, that is not after a moment. */
export function tickAt({ times, last }: Pick<Run, "last"> & { times: readonly number[] | null }, time: number): number {
  if (times === null) return Math.min(last, Math.floor(time + 1e-9));
  return Math.max(0, countOf(last + 1, (i) => times[i]! <= time + 1e-9) - 1);
}

/** `12`, or `12.3` if the run has a clock. */
export function moment(run: Run, tick: number): string {
  return run.times ? run.times[tick]!.toFixed(1) : String(tick);
}

/** `tick 12`, or `12.3 s` if the run has a clock. */
export function when(run: Run, tick: number): string {
  return run.times ? `${moment(run, tick)} s` : `tick ${tick}`;
}

/**
 * Separate robots above one another (in different layers) on a circle, smoothly as they come
 * closer than one cell. The same rule as `separated` in picture/svg.py.
 */
export function separate(poses: Pose[]): Pose[] {
  return poses.map((pose, i) => {
    let rank = 0;
    let count = 0;
    poses.forEach((other, j) => {
      const near = Math.max(0, 1 - Math.hypot(pose.x - other.x, pose.y - other.y));
      count += near;
      if (j < i) rank += near;
    });
    const turn = 2 * Math.PI * (0.125 + rank / count);
    const far = 0.3 * Math.min(1, count - 1);
    return { ...pose, x: pose.x - far * Math.sin(turn), y: pose.y + far * Math.cos(turn) };
  });
}

export function clamp(value: number, low: number, high: number): number {
  return Math.max(low, Math.min(high, value));
}

/** The smallest area that a region lies in. */
export function areaOf(run: Run, region: number): string | undefined {
  const around = Object.entries(run.areas).filter(([, regions]) => regions.includes(region));
  return around.sort(([, a], [, b]) => a.length - b.length)[0]?.[0];
}

/** `47 [3, 8]`, or `dock 47 [3, 8]` with the name of the region or its area. */
export function label(run: Run, region: number): string {
  const name = run.names[region] ?? areaOf(run, region);
  const [col, row] = placeOf(run, region);
  return `${name ? `${name} ` : ""}${region} [${row}, ${col}]`;
}

/** Whether a robot is out of service; else its role in the topmost stack entry that names it. */
export function roleOf(run: Run, { name, out }: Robot, tick: number): [kind: string, words: string] | null {
  if (at(out, tick)[1]) return ["out", "out of service"];
  const frames = at(run.stack, tick)[1];
  for (let i = frames.length - 1; i >= 0; i--) {
    const [about, requester, helpers] = frames[i]!;
    if (helpers.includes(name)) return ["helps", `${name === requester ? "resolves" : "helps"}: ${about}`];
    if (requester === name) return ["waits", `waits: ${about}`];
  }
  return null;
}

/** The first index in `events` (sorted by tick) whose tick is greater than `tick`. */
export function eventsAfter(events: readonly RunEvent[], tick: number): number {
  return countOf(events.length, (i) => events[i]![0] <= tick);
}

export function eventsAt(run: Run, tick: number): RunEvent[] {
  return run.events.slice(eventsAfter(run.events, tick - 1), eventsAfter(run.events, tick));
}

export function isWall(run: Run, region: number): boolean {
  const [col, row] = placeOf(run, region);
  return run.grid[row]![col] === "#";
}

/** The column and the row of a region. */
export function placeOf({ cols }: Pick<Run, "cols">, region: number): [col: number, row: number] {
  return [region % cols, Math.floor(region / cols)];
}

/** The region at a column and row, with fractions; -1 outside the map. */
export function regionAt({ cols, rows }: Pick<Run, "cols" | "rows">, x: number, y: number): number {
  return x >= 0 && y >= 0 && x < cols && y < rows ? Math.floor(y) * cols + Math.floor(x) : -1;
}

const readSets = new Map<string, number[]>();

/** The regions of a set, read on first use: gaps and lengths of runs of consecutive regions. */
export function regionsOf(run: Run, set: number): number[] {
  const text = run.sets[set]!;
  let regions = readSets.get(text);
  if (regions === undefined) {
    readSets.set(text, (regions = []));
    let end = 0;
    text.split(",").map(Number).forEach((length, i) => {
      if (i % 2) for (let region = end; region < end + length; region++) regions!.push(region);
      end += length;
    });
  }
  return regions;
}

/** Text that was deflated, as base64. */
export async function inflated(text: string): Promise<string> {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).text();
}

export const dark = matchMedia("(prefers-color-scheme: dark)");

/** Return a function that draws the component again. */
export function useRedraw(): () => void {
  const [, count] = useReducer((drawn: number) => drawn + 1, 0);
  return useCallback(() => count(0), []);
}
