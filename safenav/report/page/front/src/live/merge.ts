/** Joins what is new of a run to what the page has: `safenav/report/page/live.py` tells it. */

import type { Frame, Obstacle, Progress, Robot, Run, RunEvent, Slack, Status, Task, View } from "../run/run";

interface RobotNews {
  path: number[];
  headings: string;
  /** From which number on they are new. */
  steps: [from: number, steps: Robot["steps"]];
  tasks: Task[];
  progress: Progress[];
  charge: [tick: number, percent: number][];
  view: { sight: [number, string][]; beliefs: [of: number, tick: number, seen: number, set: string | -1][] } | null;
}

export interface News {
  last: number;
  times: number[];
  robots: RobotNews[];
  obstacles: Omit<Obstacle, "status" | "met" | "carried">[];
  status: Record<string, [number, Status][]>;
  met: Record<string, [number, number][]>;
  carried: Record<string, [number, number[]][]>;
  stack: [number, Frame[]][];
  events: RunEvent[];
  deadlines: Slack[];
}

/** A new run that shares with the old one what has not changed. */
export function merged(run: Run, news: News): Run {
  const robots = run.robots.map((robot, i) => joined(run, robot, news.robots[i]!));
  const fresh = new Map(news.obstacles.map((obstacle) => [obstacle.name, obstacle]));
  const known = run.obstacles.map((old) => {
    const told = fresh.get(old.name);
    fresh.delete(old.name);
    return told ? { ...old, ...told } : old;
  });
  const added = [...fresh.values()].map((told): Obstacle => ({ ...told, status: [[0, "hidden"]], met: [[0, 0]], carried: [[0, []]] }));
  for (const obstacle of [...known, ...added]) {
    append(obstacle.status, news.status[obstacle.name] ?? []);
    append(obstacle.met, news.met[obstacle.name] ?? []);
    append(obstacle.carried, news.carried[obstacle.name] ?? []);
  }
  append(run.times ?? [], news.times);
  append(run.stack, news.stack);
  append(run.events, news.events);
  append(run.deadlines, news.deadlines);
  return { ...run, last: news.last, robots, obstacles: [...known, ...added] };
}

function joined(run: Run, robot: Robot, news: RobotNews): Robot {
  append(robot.path, news.path);
  append(robot.tasks, news.tasks);
  append(robot.progress, news.progress);
  append(robot.charge ?? [], news.charge);
  return {
    ...robot,
    headings: robot.headings === null ? null : robot.headings + news.headings,
    steps: [...robot.steps.slice(0, news.steps[0]), ...news.steps[1]],
    view: news.view ? seen(run, robot.view, news.view) : robot.view,
  };
}

function seen(run: Run, view: View | null, news: NonNullable<RobotNews["view"]>): View {
  const found: View = view ?? { vision: null, sight: [], beliefs: [] };
  for (const [tick, text] of news.sight) found.sight.push([tick, placeOf(run, text)]);
  for (const [of, tick, sees, text] of news.beliefs) {
    let told = found.beliefs.find(([other]) => other === of);
    if (!told) found.beliefs.push((told = [of, [[0, 0, -1]]]));
    told[1].push([tick, sees, text === -1 ? -1 : placeOf(run, text)]);
  }
  return found;
}

function placeOf(run: Run, text: string): number {
  const known = run.sets.indexOf(text);
  return known >= 0 ? known : run.sets.push(text) - 1;
}

function append<T>(list: T[], more: readonly T[]): void {
  for (const entry of more) list.push(entry);
}
