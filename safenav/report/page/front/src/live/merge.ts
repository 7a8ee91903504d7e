/** Merge the news of a run, written by `safenav/report/page/encode.py`, into the run of the page. */

import type { Obstacle, Robot, Run, View } from "../run/run";

type Series = "path" | "tasks" | "progress" | "charge" | "headings";

/** New entries, in the shapes of the whole; sets of regions stand for themselves. */
interface RobotNews extends Pick<Robot, Series> {
  /** Index of the first new one. */
  steps: [from: number, steps: Robot["steps"]];
  view: { vision: number | null; sight: [number, string][]; beliefs: [of: number, told: [number, number, string | -1][]][] } | null;
}

export interface News extends Pick<Run, "last" | "times" | "stack" | "events" | "deadlines"> {
  robots: RobotNews[];
  /** The changed ones. */
  obstacles: Obstacle[];
}

/** Return a new run that shares unchanged parts with the old one. */
export function merged(run: Run, news: News): Run {
  const robots = run.robots.map((robot, i) => joined(run, robot, news.robots[i]!));
  const obstacles = run.obstacles.map((old) => {
    const told = news.obstacles.find(({ name }) => name === old.name);
    if (!told) return old;
    for (const key of ["status", "met", "carried"] as const) append<unknown>(old[key], told[key]);
    return { ...told, status: old.status, met: old.met, carried: old.carried };
  });
  obstacles.push(...news.obstacles.filter(({ name }) => run.obstacles.every((old) => old.name !== name)));
  for (const key of ["times", "stack", "events", "deadlines"] as const) append<unknown>(run[key], news[key]);
  return { ...run, last: news.last, robots, obstacles };
}

function joined(run: Run, robot: Robot, news: RobotNews): Robot {
  for (const key of ["path", "tasks", "progress", "charge"] as const) append<unknown>(robot[key], news[key]);
  return {
    ...robot,
    headings: robot.headings === null ? null : robot.headings + news.headings,
    steps: [...robot.steps.slice(0, news.steps[0]), ...news.steps[1]],
    view: news.view ? seen(run, robot.view, news.view) : robot.view,
  };
}

function seen(run: Run, view: View | null, news: NonNullable<RobotNews["view"]>): View {
  const found: View = view ?? { vision: news.vision, sight: [], beliefs: [] };
  for (const [tick, text] of news.sight) found.sight.push([tick, placeOf(run, text)]);
  for (const [of, changes] of news.beliefs) {
    let told = found.beliefs.find(([other]) => other === of);
    if (!told) found.beliefs.push((told = [of, []]));
    for (const [tick, sees, text] of changes) told[1].push([tick, sees, text === -1 ? -1 : placeOf(run, text)]);
  }
  return found;
}

function placeOf(run: Run, text: string): number {
  const known = run.sets.indexOf(text);
  return known >= 0 ? known : run.sets.push(text) - 1;
}

function append<T>(list: T[] | null, more: readonly T[] | null): void {
  for (const entry of more ?? []) list?.push(entry);
}
