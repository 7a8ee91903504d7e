/** Sight and beliefs of robots as shading of the floor: the same as in report/picture/shading.py. */

import { memo } from "preact/compat";
import { at, label, type Robot, type Run, type BeliefChange } from "../run/run";
import { INK } from "./ink";
import { filled, outline } from "./shapes";
import { holds, regionsOf, runsOf, sizeOf } from "../run/sets";
import { EVERYONE, type Shown } from "../settings";

/** Directions of the hatches, one per believed robot. */
const ANGLES = [45, -45, 15, -75, 75, -15];
/** Distance of the lines. */
const PITCH = 6.5;

/** Return the robots that have sight or beliefs to shade. */
export function viewersOf(run: Run): Robot[] {
  return run.robots.filter((robot) => robot.view !== null);
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
  shown: Shown;
  /** The selected robot: what others believe of it, and what it believes, is hatched. */
  selected: number | null;
}

export const Shading = memo(({ run, tick, shown, selected }: ShadingProps) => {
  const viewers = viewersOf(run).filter((robot) => watched(run, robot, shown));
  return (
    <>
      <defs>
        {run.robots.map((_, i) => (
          <Hatch run={run} of={i} id={`hatch-${i}`} />
        ))}
      </defs>
      {shown.sight && viewers.map((robot) => <Sight run={run} robot={robot} tick={tick} />)}
      {shown.beliefs &&
        viewers.flatMap((robot) =>
          robot.view!.beliefs.map(([of, told]) => (
            <Believed run={run} robot={robot} of={of} told={at(told, tick)} hatched={[of, run.robots.indexOf(robot)].includes(selected ?? -1)} />
          )),
        )}
    </>
  );
});

function watched(run: Run, robot: Robot, shown: Shown): boolean {
  return shown.viewer === EVERYONE || run.robots[shown.viewer] === robot;
}

/** The area of a set, and the border around it. */
function shapeOf(run: Run, set: number): { area: string; border: string } {
  const text = run.sets[set]!;
  let shape = drawn.get(text);
  if (shape === undefined) {
    const regions = regionsOf(run, set);
    drawn.set(text, (shape = { area: filled(run, regions), border: outline(run, regions) }));
  }
  return shape;
}

const drawn = new Map<string, { area: string; border: string }>();

function Sight({ run, robot, tick }: { run: Run; robot: Robot; tick: number }) {
  if (robot.view!.sight.length === 0) return null;
  const { area, border } = shapeOf(run, at(robot.view!.sight, tick)[1]);
  return (
    <g class="sight" data-viewer={robot.name} style={{ "--colour": robot.look.colour }}>
      <path {...INK.sight} d={area} />
      <path {...INK.sightEdge} d={border} />
    </g>
  );
}

interface BelievedProps {
  run: Run;
  robot: Robot;
  of: number;
  told: BeliefChange;
  hatched: boolean;
}

function Believed({ run, robot, of, told, hatched }: BelievedProps) {
  const [tick, seen, set] = told;
  if (set < 0 || tick < 0) return null;
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

/** A robot's knowledge of the others since its last observation, at the beginning of its turn. */
export function knowledgeOf(run: Run, robot: Robot, tick: number): string[] {
  return (robot.view?.beliefs ?? []).flatMap(([of, told]) => {
    const [, seen, set] = at(told, tick);
    if (set < 0) return [];
    const name = run.robots[of]!.name;
    const count = sizeOf(run, set);
    const first = runsOf(run, set)[0]?.[0] ?? 0;
    const where = count === 1 ? label(run, first) : `one of ${count} regions`;
    return [`last observation: ${seen ? "saw" : "believes"} ${name} ${seen ? "at" : "in"} ${where}`];
  });
}

/** Return notes on a region in the present shading. */
export function shadesAt(run: Run, region: number, tick: number, shown: Shown): string[] {
  return viewersOf(run)
    .filter((robot) => watched(run, robot, shown))
    .flatMap((robot) => {
      const { sight, beliefs } = robot.view!;
      const told: string[] = [];
      if (shown.sight && sight.length > 0 && holds(run, at(sight, tick)[1], region)) {
        told.push(`in sight of ${robot.name}`);
      }
      for (const [of, changes] of shown.beliefs ? beliefs : []) {
        const [, seen, set] = at(changes, tick);
        if (set < 0 || !holds(run, set, region)) continue;
        const name = run.robots[of]!.name;
        told.push(seen ? `${robot.name} saw ${name} here` : `${robot.name} believes ${name} may be here`);
      }
      return told;
    });
}
