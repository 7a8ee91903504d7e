/** The legend's rows for the 3D scene: solids, plates on the ground, lines. */

import type { ComponentChildren } from "preact";
import { Row, statusWords } from "../map/legend";
import { StatusSign } from "../panels/icons";
import { STATUSES, type Run } from "../run/run";
import type { Sampled } from "./motion";

/** The top and the two visible sides of a box, and its edges. */
const TOP = "M9 1L17 5L9 9L1 5Z";
const SIDES = ["M1 5L9 9V17L1 13Z", "M17 5L9 9V17L17 13Z"] as const;
const EDGES = "M9 1L17 5V13L9 17L1 13V5ZM1 5L9 9L17 5M9 9V17";

function Cube({ name }: { name: string }) {
  return (
    <svg width="18" height="18" aria-hidden="true" class={name}>
      <path d={TOP} />
      <path d={SIDES[0]} opacity="0.8" />
      <path d={SIDES[1]} opacity="0.6" />
    </svg>
  );
}

function Mark({ children, words }: { children: ComponentChildren; words: string }) {
  return (
    <li>
      {children}
      {words}
    </li>
  );
}

export function SolidMarks({ run, robots }: { run: Run; robots: Sampled[] }) {
  const first = run.robots[0];
  const load = run.obstacles.some((obstacle) => obstacle.carried.length > 1);
  return (
    <>
      <Mark words="wall">
        <Cube name="walls" />
      </Mark>
      {STATUSES.map((status) => (
        <Mark key={status} words={statusWords(run, status)}>
          {status === "hidden" ? (
            <svg width="18" height="18" aria-hidden="true">
              <path class="edges" d={EDGES} />
            </svg>
          ) : (
            <Cube name={`status-${status}`} />
          )}
          <StatusSign run={run} status={status} />
        </Mark>
      ))}
      {first && (
        <Row words="target of the robot with these letters" width={30}>
          <rect x="1" y="1" width="28" height="16" rx="4" fill={first.look.colour} />
          <text x="15" y="13" text-anchor="middle" font-size="12" font-weight="600" fill={first.look.ink}>
            {first.look.letters}
          </text>
        </Row>
      )}
      {first && (
        <Row words="path of a robot" width={30}>
          <path d="M1 9h28" stroke={first.look.colour} stroke-width="1.5" />
        </Row>
      )}
      {robots.some(({ track }) => track.feet.length > 0) && (
        <Row words="footprints" width={30}>
          <path fill={first?.look.colour} opacity="0.5" d="M1 3h8v4h-8zM11 11h8v4h-8zM21 3h8v4h-8z" />
        </Row>
      )}
      {first && (
        <Row words="region reserved by the robot of this colour">
          <path d="M1 1h16v16h-16z" fill={first.look.colour} opacity="0.3" />
        </Row>
      )}
      {robots.some(({ ghost }) => ghost !== null) && (
        <Row words="translucent: planned position of a measured robot">
          <circle cx="9" cy="9" r="7" fill={first?.look.colour} opacity="0.3" />
        </Row>
      )}
      {load && (
        <Mark words="load: the robot below carries it">
          <Cube name="load" />
        </Mark>
      )}
      {run.chargers.length > 0 && (
        <Row words="charger" viewBox="-1.6 -1.6 3.2 3.2">
          <path class="charger" d={run.charger} />
          <circle r="1.4" class="charger-ring" />
        </Row>
      )}
      {Object.keys(run.areas).length > 0 && (
        <Row words="area">
          <path class="border" d="M2 2h14v14h-14z" />
        </Row>
      )}
    </>
  );
}
