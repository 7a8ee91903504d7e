/** The ground of the map: free regions, walls, numbers and names. */

import { memo } from "preact/compat";
import { CELL } from "./camera";
import type { Run } from "../run/run";

/** Text below this many pixels is not shown. */
const LEGIBLE = 8;
/** The width of a letter, in font sizes. */
const LETTER = 0.6;

interface FloorProps {
  run: Run;
  numbers: boolean;
  names: boolean;
  /** Pixels of a cell. */
  scale: number;
}

export function Floor({ run, numbers, names, scale }: FloorProps) {
  const legible = (LEGIBLE * 1.05 * CELL) / scale;
  const digits = String(run.rows * run.cols - 1).length;
  const size = Math.max(7.4, legible);
  const fits = size * LETTER * digits <= 0.8 * CELL && size <= 0.34 * CELL;
  return (
    <>
      <Ground run={run} />
      {numbers && fits && <Numbers run={run} size={size} />}
      {names && <Names run={run} least={legible} />}
    </>
  );
}

/** Runs that go on, and drawings that are changed, come as new objects with the same floor. */
function sameFloor<P extends { run: Run }>(a: P, b: P): boolean {
  const rest = (props: P): string => JSON.stringify({ ...props, run: null });
  return a.run.grid === b.run.grid && a.run.cols === b.run.cols && rest(a) === rest(b);
}

const Ground = memo(({ run }: { run: Run }) => {
  const width = run.cols * CELL;
  const height = run.rows * CELL;
  const lines: string[] = [];
  for (let r = 1; r < run.rows; r++) lines.push(`M0 ${r * CELL}H${width}`);
  for (let c = 1; c < run.cols; c++) lines.push(`M${c * CELL} 0V${height}`);
  const walls: string[] = [];
  for (let row = 0; row < run.rows; row++) {
    for (let col = 0; col < run.cols; col++) {
      if (!isWall(run, row * run.cols + col)) continue;
      let end = col;
      while (end + 1 < run.cols && isWall(run, row * run.cols + end + 1)) end++;
      walls.push(`M${col * CELL} ${row * CELL}h${(end - col + 1) * CELL}v${CELL}h${(col - end - 1) * CELL}z`);
      col = end;
    }
  }
  return (
    <>
      <rect class="ground" width={width} height={height} />
      <path class="lines" d={lines.join("")} />
      <path class="walls" d={walls.join("")} />
    </>
  );
}, sameFloor);

const Numbers = memo(({ run, size }: { run: Run; size: number }) => {
  const labels = [];
  for (let region = 0; region < run.rows * run.cols; region++) {
    if (isWall(run, region)) continue;
    const x = (region % run.cols) * CELL;
    const y = Math.floor(region / run.cols) * CELL;
    labels.push(
      <text x={x + 2.8} y={y + 1 + size}>
        {region}
      </text>,
    );
  }
  return (
    <g class="numbers" font-size={size}>
      {labels}
    </g>
  );
}, sameFloor);

/** The names that the scenario gives regions, never wider than their region. */
const Names = memo(({ run, least }: { run: Run; least: number }) => (
  <g class="names">
    {Object.entries(run.names).map(([number, name]) => {
      const region = Number(number);
      const size = Math.min(9, (0.94 * CELL) / (LETTER * name.length));
      if (size < least) return null;
      const x = ((region % run.cols) + 0.5) * CELL;
      const y = (Math.floor(region / run.cols) + 1) * CELL - 4.6; // within the frame of a target
      return (
        <text key={name} x={x} y={y} font-size={size}>
          {name}
        </text>
      );
    })}
  </g>
));

export function isWall(run: Run, region: number): boolean {
  return run.grid[Math.floor(region / run.cols)]![region % run.cols] === "#";
}
