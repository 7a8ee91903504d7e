/** The legend's rows for the 3D scene: solids, plates on the ground, lines. */

import { INK } from "../map/ink";
import { Row, Statuses } from "../panels/legend";
import type { Run } from "../run/run";
import type { Sampled } from "./motion";

export function SolidMarks({ run, robots }: { run: Run; robots: Sampled[] }) {
  const { colour, ink, letters } = run.robots[0]!.look;
  return (
    <>
      <Statuses run={run} />
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
      <Row words="charger" shown={run.chargers.length > 0} viewBox="-1.2 -1.2 2.4 2.4">
        <path {...INK.charger} d={run.charger} />
      </Row>
      <Row words="area" shown={Object.keys(run.areas).length > 0}>
        <path {...INK.areaLine} d="M2 2h14v14h-14z" />
      </Row>
    </>
  );
}
