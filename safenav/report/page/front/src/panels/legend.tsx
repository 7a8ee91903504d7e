/** The legend: marks of the stage, and signs of events and activities on the timeline. */

import type { ComponentChildren } from "preact";
import { memo } from "preact/compat";
import { INK } from "../map/shapes";
import { Hatch, ringOf, viewersOf } from "../map/knowledge";
import { type EventKind, EVENTS, type Run, STATUSES, UNORDERED } from "../run/run";
import { EventSign, Popup, StatusSign } from "./shell";

interface RowProps {
  words: ComponentChildren;
  /** Whether this run has it. */
  shown?: boolean;
  width?: number;
  height?: number;
  viewBox?: string;
  preserveAspectRatio?: string;
  class?: string;
  /** That of the first robot, unless another one is meant. */
  colour?: string | undefined;
  children: ComponentChildren;
}

/** A row of a legend: a drawing and its meaning. */
export function Row({ words, shown = true, colour, children, width = 18, height = 18, ...rest }: RowProps) {
  if (!shown) return null;
  return (
    <li class="row">
      <svg width={width} height={height} aria-hidden="true" {...rest} {...(colour && { style: { "--colour": colour } })}>
        {children}
      </svg>
      {words}
    </li>
  );
}

/** A row for each status of an obstacle. */
export function Statuses({ run }: { run: Run }) {
  const hidden = `obstacle, still hidden${run.obstacles.some((each) => each.ordered) ? `, or ${UNORDERED}` : ""}`;
  return STATUSES.map((status) => (
    <li key={status} class="row">
      <StatusSign run={run} status={status} />
      {status === "hidden" ? hidden : run.marks.status[status].meaning}
    </li>
  ));
}

export const Legend = memo(({ run, marks }: { run: Run; marks: ComponentChildren }) => (
  <Popup name="Legend" kind="legend">
    <ul style={{ "--colour": run.robots[0]!.look.colour }}>
      <MapMarks run={run} />
      {marks}
      {Object.entries(EVENTS).map(([kind, [, , meaning]]) =>
        meaning && run.events.some((event) => event[1] === kind) ? (
          <li key={kind} class="row">
            <EventSign run={run} kind={kind as EventKind} />
            {meaning}
          </li>
        ) : null,
      )}
    </ul>
  </Popup>
));

export function MapMarks({ run }: { run: Run }) {
  const { look } = run.robots[0]!;
  const load = run.obstacles.find((obstacle) => obstacle.carried.length > 1);
  return (
    <>
      <Row words="wall">
        <rect {...INK.walls} x="1" y="1" width="16" height="16" />
      </Row>
      <Statuses run={run} />
      <Row words="target of the robot with this shape and colour; the next one is filled" width={20} height={20} viewBox="-2 -2 24 24">
        <path {...INK.aim} {...INK.current} d={ringOf(10, 10, 9)} />
        <path {...INK.target} transform="translate(16 4) scale(3.6)" d={look.path} fill={look.colour} />
      </Row>
      <Row words="its next steps" width={30}>
        <path {...INK.intention} d="M1 9h28" />
      </Row>
      <Row words="load that the robot carries" shown={load !== undefined} viewBox="-1.2 -1.2 2.4 2.4">
        <rect x={-1.1} y={-1.1} width={2.2} height={2.2} {...INK.plate} stroke-width={0.1} />
        <path d={load?.shape || run.marks.load} {...INK.shape} />
      </Row>
      <Row
        words="regions that the robot of this colour avoids"
        shown={run.robots.some((robot) => robot.tasks.some((task) => task[3].length > 0))}
        width={20}
        height={20}
        viewBox="-2 -2 24 24"
      >
        <path {...INK.aim} {...INK.avoided} d="M1 1h18v18h-18z" />
      </Row>
      <Row words="where a robot faces" shown={run.robots.some((robot) => robot.headings !== null)} viewBox="-0.9 -2 1.8 1.2">
        <path {...INK.nose} d={run.nose} />
      </Row>
      <ShadingLegend run={run} />
      {run.exclusions.map(([robots], i) => (
        <Row key={i} words={`at most one of ${robots.join(", ")} at a time`}>
          <path {...INK.exclusion} d="M2 2h14v14h-14z" />
        </Row>
      ))}
      <Row words="charger" shown={run.chargers.length > 0} viewBox="-1.2 -1.2 2.4 2.4">
        <path {...INK.charger} d={run.charger} />
      </Row>
      <Row words="area" shown={Object.keys(run.areas).length > 0}>
        <path {...INK.areaLine} d="M2 2h14v14h-14z" />
      </Row>
    </>
  );
}

/** Legend of the beliefs in this run. */
function ShadingLegend({ run }: { run: Run }) {
  const [believing] = viewersOf(run);
  const of = Number(Object.keys(believing?.beliefs ?? {})[0] ?? 0);
  const sought = run.robots[of]!.look.colour;
  return (
    <>
      <Row words="where the robot of that colour may be, by the last observation" shown={believing !== undefined} colour={sought}>
        <defs>
          <Hatch run={run} of={of} id="hatch-legend" />
        </defs>
        <path d="M1 1h16v16h-16z" fill="url(#hatch-legend)" />
        <path {...INK.beliefEdge} d="M1 1h16v16h-16z" />
      </Row>
      <Row words="where it was seen" shown={believing !== undefined} colour={sought}>
        <path {...INK.seenEdge} d="M2 2h14v14h-14z" />
      </Row>
    </>
  );
}
