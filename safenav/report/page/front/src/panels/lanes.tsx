/** Below the timeline: a lane for each robot that shows its activities, and numbers of ticks. */

import { memo } from "preact/compat";
import { useMemo } from "preact/hooks";
import type { Player } from "../run/player";
import { at, moment, tickAt, transitAt, when, type Robot, type Run } from "../run/run";

export type Doing = "moving" | "waiting" | "helping" | "still";

export const DOINGS: [kind: Doing, meaning: string][] = [
  ["moving", "moves"],
  ["waiting", "waits for help"],
  ["helping", "helps"],
];

/** Top and bottom of a bar in a lane of height 4; colours alone resemble those of robots. */
const FILLED: Record<Doing, [top: number, bottom: number][]> = {
  moving: [[1, 3]],
  waiting: [
    [0, 1],
    [3, 4],
  ],
  helping: [[0, 4]],
  still: [],
};

/** A stretch of a lane. */
export const bar = (kind: Doing, from: string, to: string): string =>
  FILLED[kind].map(([top, bottom]) => `M${from} ${top}H${to}V${bottom}H${from}z`).join("");

/** A robot's activity in the tick that ends at `tick`. */
export function doingAt(run: Run, robot: Robot, tick: number): Doing {
  const frames = at(run.stack, Math.max(0, tick - 1))[1];
  for (let i = frames.length - 1; i >= 0; i--) {
    const [, , requester, helpers] = frames[i]!;
    if (helpers.includes(robot.name)) return "helping";
    if (requester === robot.name) return "waiting";
  }
  const under = transitAt(robot, run.times ? tick - 1 : tick) !== null;
  const moved = under || (!run.times && robot.path[tick] !== robot.path[tick - 1]);
  return moved ? "moving" : "still";
}

interface Stretch {
  doing: Doing;
  first: number;
  last: number;
}

function stretchesOf(run: Run, robot: Robot): Stretch[] {
  const found: Stretch[] = [];
  for (let tick = 1; tick <= run.last; tick++) {
    const doing = doingAt(run, robot, tick);
    const before = found[found.length - 1];
    if (before?.doing === doing) before.last = tick;
    else found.push({ doing, first: tick - 1, last: tick });
  }
  return found.filter((stretch) => stretch.doing !== "still");
}

interface LanesProps {
  run: Run;
  player: Player;
  /** The selected robot, or null. */
  selected: number | null;
  select(robot: number): void;
}

export const Lanes = memo(({ run, player, selected, select }: LanesProps) => (
  <ol class="lanes" aria-hidden="true" tabIndex={-1}>
    {run.robots.map((robot, i) => (
      <Lane key={robot.name} run={run} player={player} index={i} selected={selected === i} select={select} />
    ))}
  </ol>
));

type LaneProps = Omit<LanesProps, "selected"> & { index: number; selected: boolean };

/** `digit helps, 11 to 16`. */
function activityAt(run: Run, robot: Robot, stretches: Stretch[], tick: number): string {
  const found = stretches.find(({ first, last }) => first <= tick && tick < last);
  if (found === undefined) return `${robot.name} stays, ${when(run, tick)}`;
  const meaning = DOINGS.find(([kind]) => kind === found.doing)![1];
  return `${robot.name} ${meaning}, ${moment(run, found.first)} to ${moment(run, found.last)}`;
}

function Lane({ run, player, index, selected, select }: LaneProps) {
  const robot = run.robots[index]!;
  const stretches = useMemo(() => stretchesOf(run, robot), [run, robot]);
  const syntheses = useMemo(
    () => run.events.filter((event) => event[1] === "synthesis" && event[3] === index),
    [run, index],
  );
  const most = player.end || 1;
  const x = (tick: number): string => player.timeOf(tick).toFixed(2);
  const bars = (kind: Doing): string =>
    stretches
      .filter((stretch) => stretch.doing === kind)
      .map(({ first, last }) => bar(kind, x(first), x(last)))
      .join("");
  return (
    <li
      data-robot={robot.name}
      class={selected ? "selected" : ""}
      style={{ "--colour": robot.look.colour }}
      onClick={() => select(index)}
      onPointerMove={(event) => {
        const box = event.currentTarget.getBoundingClientRect();
        const time = ((event.clientX - box.left) / box.width) * player.end;
        event.currentTarget.title = activityAt(run, robot, stretches, tickAt(run, time));
      }}
    >
      <span title={robot.name}>{robot.look.letters}</span>
      <svg viewBox={`0 0 ${most} 4`} preserveAspectRatio="none">
        {DOINGS.map(([kind]) => (
          <path class={`doing ${kind}`} d={bars(kind)} />
        ))}
        <path class="doing synthesis" d={syntheses.map((event) => `M${x(event[0])} 0V4`).join("")} />
      </svg>
    </li>
  );
}

/** Times (ticks, or seconds where the run has a motion) at round steps, spaced so that they are legible. */
export function axisOf(last: number, width: number): number[] {
  const least = (last * 44) / Math.max(1, width);
  let step = 1;
  for (let power = 1; step < least; power *= 10) {
    step = [1, 2, 5, 10].map((part) => part * power).find((size) => size >= least) ?? 10 * power;
  }
  const ticks = [];
  for (let tick = 0; tick <= last; tick += step) ticks.push(tick);
  return ticks;
}

export function Axis({ last, width }: { last: number; width: number }) {
  return (
    <div class="axis" aria-hidden="true">
      {axisOf(last, width).map((tick) => (
        <span key={tick} style={{ left: `${last ? (100 * tick) / last : 0}%` }}>
          {tick}
        </span>
      ))}
    </div>
  );
}
