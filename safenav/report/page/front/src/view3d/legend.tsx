/** The legend's rows for the 3D scene: solids, plates on the ground, lines. */

import { INK } from "../map/ink";
import { Row, Statuses } from "../panels/legend";
import type { Run } from "../run/run";
import type { Sampled } from "./motion";

const EDGES = "M9 1L17 5V13L9 17L1 13V5ZM1 5L9 9L17 5M9 9V17";

/** The top and the two visible sides of a box. */
function Cube({ colour }: { colour: string }) {
  return (
    <g fill={`var(--${colour})`}>
      <path d="M9 1L17 5L9 9L1 5Z" />
      <path d="M1 5L9 9V17L1 13Z" opacity="0.8" />
      <path d="M17 5L9 9V17L17 13Z" opacity="0.6" />
    </g>
  );
}

export function SolidMarks({ run, robots }: { run: Run; robots: Sampled[] }) {
  const { colour, ink, letters } = run.robots[0]!.look;
  return (
    <>
      <Row words="wall">
        <Cube colour="wall" />
      </Row>
      <Statuses
        run={run}
        before={(status) => (
          <svg width="18" height="18" aria-hidden="true">
            {status === "hidden" ? <path class="edges" d={EDGES} /> : <Cube colour={status} />}
          </svg>
        )}
      />
      <Row words="target of the robot with these letters" width={30}>
        <rect x="1" y="1" width="28" height="16" rx="4" fill={colour} />
        <text x="15" y="13" text-anchor="middle" font-size="12" font-weight="600" fill={ink}>
          {letters}
        </text>
      </Row>
      <Row words="path of a robot" width={30}>
        <path d="M1 9h28" stroke={colour} stroke-width="1.5" />
      </Row>
      <Row words="footprints" shown={robots.some(({ track }) => track.feet.length > 0)} width={30}>
        <path fill={colour} opacity="0.5" d="M1 3h8v4h-8zM11 11h8v4h-8zM21 3h8v4h-8z" />
      </Row>
      <Row words="region reserved by the robot of this colour">
        <path d="M1 1h16v16h-16z" fill={colour} opacity="0.3" />
      </Row>
      <Row words="translucent: planned position of a measured robot" shown={robots.some(({ ghost }) => ghost !== null)}>
        <circle cx="9" cy="9" r="7" fill={colour} opacity="0.3" />
      </Row>
      <Row words="load: the robot below carries it" shown={run.obstacles.some(({ carried }) => carried.length > 1)}>
        <Cube colour="ink" />
      </Row>
      <Row words="charger" shown={run.chargers.length > 0} viewBox="-1.2 -1.2 2.4 2.4">
        <path {...INK.charger} d={run.charger} />
      </Row>
      <Row words="area" shown={Object.keys(run.areas).length > 0}>
        <path class="area-edge" d="M2 2h14v14h-14z" />
      </Row>
    </>
  );
}
