/** Knowledge at a tick: obstacles, targets, next steps, beliefs. */

import { memo } from "preact/compat";
import { aimAt, at, type BeliefChange, placeOf, regionsOf, type Robot, type Run } from "../run/run";
import { CELL } from "./camera";
import { centreOf, filled, INK, outline } from "./shapes";

/** In smaller regions the pictogram of an obstacle would be illegible: only its status is shown. */
const MOST_GROWN = 2;
/** The most ticks of a way that is shown before it is gone. */
const MOST_STEPS = 100;

interface KnowledgeProps {
  run: Run;
  tick: number;
  /** Enlargement of marks on large maps, where a cell is too small for them. */
  grown: number;
}

export const Knowledge = memo(({ run, tick, grown }: KnowledgeProps) => (
  <>
    {run.obstacles.map((obstacle) => {
      const status = at(obstacle.status, tick)[1];
      const carried = at(obstacle.carried, tick)[1].length > 0;
      if (status === "absent") return null;
      const [col, row] = placeOf(run, obstacle.region);
      const shape = grown > MOST_GROWN ? "" : status === "resolved" ? obstacle.opened : obstacle.shape;
      return (
        <g
          key={obstacle.name}
          class={`obstacle status-${status}`}
          style={{ color: `var(--${status})` }}
          data-obstacle={obstacle.name}
          data-status={status}
          transform={`translate(${col * CELL} ${row * CELL})`}
        >
          <rect {...INK.boxes[status]} {...(carried && { fill: "none" })} x={1.2} y={1.2} width={CELL - 2.4} height={CELL - 2.4} rx={3.5} />
          {!carried && shape && (
            <path {...(status === "resolved" ? INK.opened : INK.sign)} transform={`translate(${CELL / 2} ${CELL / 2}) scale(${CELL * 0.27})`} d={shape} />
          )}
          {!carried && (
            <path
              {...INK.sign}
              transform={
                shape
                  ? `translate(${CELL * 0.83} ${CELL * 0.17}) scale(${CELL * 0.11 * grown})`
                  : `translate(${CELL / 2} ${CELL / 2}) scale(${(status === "hidden" ? 6 : 8.8) * grown})`
              }
              d={run.marks.status[status].path}
            />
          )}
        </g>
      );
    })}
    <Intentions run={run} tick={tick} />
    <Targets run={run} tick={tick} grown={grown} />
  </>
));

/** Rings that mark targets: the radius of the first, and the difference of those of several robots, in cells. */
const RING = 0.34;
const NEXT_RING = 0.05;
/** Directions of the copies of the robots' shapes on the rings, as x and y. */
const ASIDE: [number, number][] = [[0.71, -0.71], [0.71, 0.71], [-0.71, 0.71]];

/** Rings in the targets of robots, and lines around areas, each with a small copy of its robot's shape; the current one is filled. */
function Targets({ run, tick, grown }: { run: Run; tick: number; grown: number }) {
  const taken = new Map<number, number>();
  const slotOf = (key: number): number => {
    const slot = taken.get(key) ?? 0;
    taken.set(key, slot + 1);
    return slot;
  };
  const mark = (robot: Robot, key: string | number, current: boolean, frame: string, [x, y]: [number, number]) => (
    <g style={{ "--colour": robot.look.colour }} data-target={key} data-of={robot.name}>
      <path class={current ? "aim current" : "aim"} {...INK.aim} {...(current && INK.current)} d={frame} />
      <path class="target" {...INK.target} d={robot.look.path} fill={robot.look.colour} transform={`translate(${x} ${y}) scale(${3.6 * Math.min(grown, 2)})`} />
    </g>
  );
  return (
    <>
      {run.robots.flatMap((robot) => {
        const regions = new Set(at(robot.tasks, tick)[2]);
        const avoid = at(robot.tasks, tick)[3];
        const current = aimAt(run, robot, tick).region;
        const marks = [];
        if (avoid.length) {
          marks.push(<path {...INK.aim} {...INK.avoided} style={{ "--colour": robot.look.colour }} data-avoided={robot.name} d={outline(run, avoid, 2.4)} />);
        }
        for (const [name, area] of Object.entries(run.areas)) {
          if (area.length < 2 || !area.every((region) => regions.has(region))) continue;
          area.forEach((region) => regions.delete(region));
          const slot = slotOf(-1 - area[0]!);
          if (slot >= ASIDE.length) continue;
          const [x, y] = centreOf(run, area[0]!);
          const [right, down] = ASIDE[slot]!;
          const corner: [number, number] = [x + 0.4 * CELL * right, y + 0.4 * CELL * down];
          marks.push(mark(robot, name, area.includes(current), outline(run, area, 2.6 + 3.2 * slot), corner));
        }
        for (const region of regions) {
          const slot = slotOf(region);
          if (slot >= ASIDE.length) continue;
          const [x, y] = centreOf(run, region);
          const radius = CELL * (RING - NEXT_RING * slot);
          const [right, down] = ASIDE[slot]!;
          marks.push(mark(robot, region, region === current, ringOf(x, y, radius), [x + radius * right, y + radius * down]));
        }
        return marks;
      })}
    </>
  );
}

/** A circle as a path. */
export function ringOf(x: number, y: number, radius: number): string {
  return `M${x + radius} ${y}a${radius} ${radius} 0 1 1 ${-2 * radius} 0a${radius} ${radius} 0 1 1 ${2 * radius} 0z`;
}

/** The next steps of each robot to its current target; in a live run they are not known yet. */
function Intentions({ run, tick }: { run: Run; tick: number }) {
  return (
    <>
      {run.robots.map((robot) => {
        const aim = aimAt(run, robot, tick);
        const path = robot.path.slice(tick, Math.min(aim.tick, tick + MOST_STEPS) + 1);
        const steps = path.filter((region, i) => region !== path[i - 1]);
        if (steps.length < 2) return null;
        const line = steps.map((region) => centreOf(run, region).join(" ")).join("L");
        return <path {...INK.intention} style={{ "--colour": robot.look.colour }} data-intention={robot.name} d={`M${line}`} />;
      })}
    </>
  );
}

/** Directions of the hatches, one per believed robot. */
const ANGLES = [45, -45, 15, -75, 75, -15];
/** Distance of the lines. */
const PITCH = 6.5;

/** Return the robots that have beliefs to shade. */
export function viewersOf(run: Run): Robot[] {
  return run.robots.filter(({ beliefs }) => Object.keys(beliefs).length > 0);
}

export function Hatch({ run, of, id }: { run: Run; of: number; id: string }) {
  const angle = ANGLES[of % ANGLES.length]!;
  return (
    <pattern
      id={id}
      width={PITCH}
      height={PITCH}
      patternUnits="userSpaceOnUse"
      patternTransform={`rotate(${angle})`}
    >
      <rect {...INK.hatch} width={1.7} height={PITCH} style={{ "--colour": run.robots[of]!.look.colour }} />
    </pattern>
  );
}

interface ShadingProps {
  run: Run;
  tick: number;
  /** The selected robot, or null: what it believes is shown, else that of the first robot; what others believe of it, and what it believes, is hatched. */
  selected: number | null;
}

export const Shading = memo(({ run, tick, selected }: ShadingProps) => {
  const viewers = viewersOf(run);
  const robot = viewers.find((each) => each === run.robots[selected ?? -1]) ?? viewers[0];
  if (robot === undefined) return null;
  return (
    <>
      <defs>
        {run.robots.map((_, i) => (
          <Hatch run={run} of={i} id={`hatch-${i}`} />
        ))}
      </defs>
      {Object.entries(robot.beliefs).map(([of, told]) => (
        <Believed run={run} robot={robot} of={Number(of)} told={at(told, tick)} hatched={[Number(of), run.robots.indexOf(robot)].includes(selected ?? -1)} />
      ))}
    </>
  );
});

/** The area of a set, and the border around it. */
function shapeOf(run: Run, set: number): { area: string; border: string } {
  const regions = regionsOf(run, set);
  let shape = drawn.get(regions);
  if (shape === undefined) drawn.set(regions, (shape = { area: filled(run, regions), border: outline(run, regions) }));
  return shape;
}

const drawn = new WeakMap<number[], { area: string; border: string }>();

interface BelievedProps {
  run: Run;
  robot: Robot;
  of: number;
  told: BeliefChange;
  hatched: boolean;
}

function Believed({ run, robot, of, told, hatched }: BelievedProps) {
  const [tick, seen, set] = told;
  if (set === -1 || tick < 0) return null;
  const { area, border } = shapeOf(run, set);
  const other = run.robots[of]!;
  return (
    <g
      class={seen ? "belief seen" : "belief"}
      data-viewer={robot.name}
      data-of={other.name}
      style={{ "--colour": other.look.colour }}
    >
      {!seen && <path {...INK.belief} d={area} />}
      {!seen && hatched && <path d={area} fill={`url(#hatch-${of})`} />}
      <path {...(seen ? INK.seenEdge : INK.beliefEdge)} d={border} />
    </g>
  );
}
