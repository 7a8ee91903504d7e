/** The legend's rows for the marks on the flat map. */

import type { ComponentChildren } from "preact";
import { ANY_LOAD } from "./motion";
import { ARROW, ringOf } from "./knowledge";
import { Hatch, viewersOf } from "./shading";
import { StatusSign } from "../panels/icons";
import { STATUSES, UNORDERED, type Run, type Status } from "../run/run";

/** Return the words for a status in a legend. */
export function statusWords(run: Run, status: Exclude<Status, "absent">): string {
  if (status !== "hidden") return run.marks.status[status].meaning;
  return `obstacle, still hidden${run.obstacles.some((each) => each.ordered) ? `, or ${UNORDERED}` : ""}`;
}

interface RowProps {
  words: ComponentChildren;
  width?: number;
  height?: number;
  viewBox?: string;
  class?: string;
  colour?: string | undefined;
  children: ComponentChildren;
}

/** A row of a legend: a drawing and its meaning. */
export function Row({ words, children, colour, width = 18, height = 18, ...rest }: RowProps) {
  return (
    <li>
      <svg width={width} height={height} aria-hidden="true" {...rest} {...(colour && { style: { "--colour": colour } })}>
        {children}
      </svg>
      {words}
    </li>
  );
}

export function FlatMarks({ run }: { run: Run }) {
  const first = run.robots[0];
  const load = run.obstacles.find((obstacle) => obstacle.carried.length > 1);
  return (
    <>
      <Row words="wall">
        <rect class="walls" x="1" y="1" width="16" height="16" />
      </Row>
      {STATUSES.map((status) => (
        <li key={status}>
          <StatusSign run={run} status={status} />
          {statusWords(run, status)}
        </li>
      ))}
      {first && (
        <Row words="target of the robot with this shape and colour; the next one is filled" width={20} height={20} viewBox="-2 -2 24 24">
          <path class="aim current" style={{ "--colour": first.look.colour }} d={ringOf(10, 10, 9)} />
          <path class="target" transform="translate(16 4) scale(3.6)" d={first.look.path} fill={first.look.colour} />
        </Row>
      )}
      {first && (
        <Row words="its next steps" width={30} colour={first.look.colour}>
          <path class="intention" d="M1 9h28" />
        </Row>
      )}
      {first && (
        <Row words="path of a robot, newest part strongest" width={30} class="trail" colour={first.look.colour}>
          <path d="M1 9h9" opacity="0.25" />
          <path d="M10 9h9" opacity="0.45" />
          <path d="M19 9h10" opacity="0.75" />
        </Row>
      )}
      {first && run.robots.some((robot) => robot.tasks.some((task) => task[3].length > 0)) && (
        <Row words="regions that the robot of this colour avoids" width={20} height={20} viewBox="-2 -2 24 24">
          <path class="aim avoided" style={{ "--colour": first.look.colour }} d="M1 1h18v18h-18z" />
        </Row>
      )}
      {run.robots.some((robot) => robot.headings !== null) && (
        <Row words="where a robot faces" viewBox="-0.9 -2 1.8 1.2">
          <path class="nose" d={run.nose} />
        </Row>
      )}
      <ShadingLegend run={run} />
      {load && (
        <Row words="load that the robot carries" viewBox="-1.2 -1.2 2.4 2.4" class="robot">
          <g class="load">
            <rect x={-1.1} y={-1.1} width={2.2} height={2.2} style="stroke-width: 0.1" />
            <path d={load.shape || ANY_LOAD} fill-rule="evenodd" />
          </g>
        </Row>
      )}
      {run.exclusions.map(([robots], i) => (
        <Row key={i} words={`at most one of ${robots.join(", ")} at a time`}>
          <path class="exclusion" d="M2 2h14v14h-14z" />
        </Row>
      ))}
      {run.chargers.length > 0 && (
        <Row words="charger" viewBox="-1.2 -1.2 2.4 2.4">
          <path class="charger" d={run.charger} />
        </Row>
      )}
      <Row words="refused step" width={26} viewBox="14 -9 24 18">
        <path class="violation-arrow" d={ARROW} />
      </Row>
      {Object.keys(run.areas).length > 0 && (
        <Row words="area">
          <path class="area-line" d="M2 2h14v14h-14z" />
        </Row>
      )}
    </>
  );
}

/** Legend of the shadings in this run: robots in transit, sight, beliefs. */
function ShadingLegend({ run }: { run: Run }) {
  const moving = run.robots.find((robot) => robot.steps.length > 0);
  const seeing = viewersOf(run).find((robot) => robot.view!.sight.length > 0);
  const believing = viewersOf(run).find((robot) => robot.view!.beliefs.length > 0);
  const of = believing?.view!.beliefs[0]![0] ?? 0;
  const sought = run.robots[of]?.look.colour;
  return (
    <>
      {moving && (
        <Row words="in transit: occupies both regions" width={34}>
          <rect class="taken" style={{ "--colour": moving.look.colour }} x="1.5" y="1.5" width="31" height="15" rx="4" />
        </Row>
      )}
      {seeing && (
        <Row words={<>what {viewersOf(run).length > 1 ? "the robot of that colour" : seeing.name} sees</>} class="sight" colour={seeing.look.colour}>
          <path class="area" d="M1 1h16v16h-16z" />
          <path class="border" d="M1 1h16v16h-16z" />
        </Row>
      )}
      {believing && (
        <Row words="where the robot of that colour may be, by the last observation" class="belief" colour={sought}>
          <defs>
            <Hatch run={run} of={of} id="hatch-legend" />
          </defs>
          <path d="M1 1h16v16h-16z" fill="url(#hatch-legend)" />
          <path class="border" d="M1 1h16v16h-16z" />
        </Row>
      )}
      {believing && (
        <Row words="where it was seen" class="belief seen" colour={sought}>
          <path class="border" d="M2 2h14v14h-14z" />
        </Row>
      )}
    </>
  );
}
