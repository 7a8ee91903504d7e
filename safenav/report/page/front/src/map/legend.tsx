/** The legend's rows for the marks on the flat map. */

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

export function FlatMarks({ run }: { run: Run }) {
  const first = run.robots[0];
  const load = run.obstacles.find((obstacle) => obstacle.carried.length > 1);
  return (
    <>
      <li>
        <svg width="18" height="18" aria-hidden="true">
          <rect class="walls" x="1" y="1" width="16" height="16" />
        </svg>
        wall
      </li>
      {STATUSES.map((status) => (
        <li key={status}>
          <StatusSign run={run} status={status} />
          {statusWords(run, status)}
        </li>
      ))}
      {first && (
        <li>
          <svg width="20" height="20" viewBox="-2 -2 24 24" aria-hidden="true">
            <path class="aim current" style={{ "--colour": first.look.colour }} d={ringOf(10, 10, 9)} />
            <path class="target" transform="translate(16 4) scale(3.6)" d={first.look.path} fill={first.look.colour} />
          </svg>
          target of the robot with this shape and colour; the next one is filled
        </li>
      )}
      {first && (
        <li>
          <svg width="30" height="18" aria-hidden="true" style={{ "--colour": first.look.colour }}>
            <path class="intention" d="M1 9h28" />
          </svg>
          its next steps
        </li>
      )}
      {first && (
        <li>
          <svg width="30" height="18" aria-hidden="true" class="trail" style={{ "--colour": first.look.colour }}>
            <path d="M1 9h9" opacity="0.25" />
            <path d="M10 9h9" opacity="0.45" />
            <path d="M19 9h10" opacity="0.75" />
          </svg>
          path of a robot, newest part strongest
        </li>
      )}
      {first && run.robots.some((robot) => robot.tasks.some((task) => task[3].length > 0)) && (
        <li>
          <svg width="20" height="20" viewBox="-2 -2 24 24" aria-hidden="true">
            <path class="aim avoided" style={{ "--colour": first.look.colour }} d="M1 1h18v18h-18z" />
          </svg>
          regions that the robot of this colour avoids
        </li>
      )}
      {run.robots.some((robot) => robot.headings !== null) && (
        <li>
          <svg width="18" height="18" viewBox="-0.9 -2 1.8 1.2" aria-hidden="true">
            <path class="nose" d={run.nose} />
          </svg>
          where a robot faces
        </li>
      )}
      <ShadingLegend run={run} />
      {load && (
        <li>
          <svg width="18" height="18" viewBox="-1.2 -1.2 2.4 2.4" class="robot" aria-hidden="true">
            <g class="load">
              <rect x={-1.1} y={-1.1} width={2.2} height={2.2} style="stroke-width: 0.1" />
              <path d={load.shape || ANY_LOAD} fill-rule="evenodd" />
            </g>
          </svg>
          load that the robot carries
        </li>
      )}
      {run.exclusions.map(([robots], i) => (
        <li key={i}>
          <svg width="18" height="18" aria-hidden="true">
            <path class="exclusion" d="M2 2h14v14h-14z" />
          </svg>
          at most one of {robots.join(", ")} at a time
        </li>
      ))}
      {run.chargers.length > 0 && (
        <li>
          <svg width="18" height="18" viewBox="-1.2 -1.2 2.4 2.4" aria-hidden="true">
            <path class="charger" d={run.charger} />
          </svg>
          charger
        </li>
      )}
      <li>
        <svg width="26" height="18" viewBox="14 -9 24 18" aria-hidden="true">
          <path class="violation-arrow" d={ARROW} />
        </svg>
        refused step
      </li>
      {Object.keys(run.areas).length > 0 && (
        <li>
          <svg width="18" height="18" aria-hidden="true">
            <path class="area-line" d="M2 2h14v14h-14z" />
          </svg>
          area
        </li>
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
  const sought = { "--colour": run.robots[of]?.look.colour };
  return (
    <>
      {moving && (
        <li>
          <svg width="34" height="18" aria-hidden="true">
            <rect class="taken" style={{ "--colour": moving.look.colour }} x="1.5" y="1.5" width="31" height="15" rx="4" />
          </svg>
          in transit: occupies both regions
        </li>
      )}
      {seeing && (
        <li>
          <svg width="18" height="18" aria-hidden="true" class="sight" style={{ "--colour": seeing.look.colour }}>
            <path class="area" d="M1 1h16v16h-16z" />
            <path class="border" d="M1 1h16v16h-16z" />
          </svg>
          what {viewersOf(run).length > 1 ? "the robot of that colour" : seeing.name} sees
        </li>
      )}
      {believing && (
        <li>
          <svg width="18" height="18" aria-hidden="true" class="belief" style={sought}>
            <defs>
              <Hatch run={run} of={of} id="hatch-legend" />
            </defs>
            <path d="M1 1h16v16h-16z" fill="url(#hatch-legend)" />
            <path class="border" d="M1 1h16v16h-16z" />
          </svg>
          where the robot of that colour may be, by the last observation
        </li>
      )}
      {believing && (
        <li>
          <svg width="18" height="18" aria-hidden="true" class="belief seen" style={sought}>
            <path class="border" d="M2 2h14v14h-14z" />
          </svg>
          where it was seen
        </li>
      )}
    </>
  );
}
