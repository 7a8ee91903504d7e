/** The ground of the map: free regions, walls, numbers and areas. */

import { memo } from "preact/compat";
import { CELL } from "./camera";
import { INK } from "./ink";
import { Areas, overlap, type Box } from "./names";
import { filled, outline } from "./shapes";
import { isWall, placeOf, type Run } from "../run/run";

/** Text below this many pixels is not shown, nor numbers in regions below this side. */
const LEGIBLE = 8;
const LEAST_CELL = 28;
/** The width of a letter, in font sizes. */
const LETTER = 0.6;

interface FloorProps {
  run: Run;
  numbers: boolean;
  /** Boxes of names in pixels; numbers below them are left out. */
  names: Box[];
  /** Pixels of a cell. */
  scale: number;
}

export function Floor({ run, numbers, names, scale }: FloorProps) {
  const legible = (LEGIBLE * 1.05 * CELL) / scale;
  const digits = String(run.rows * run.cols - 1).length;
  const size = Math.max(7.4, legible);
  const fits = scale >= LEAST_CELL && size * LETTER * digits <= 0.8 * CELL && size <= 0.34 * CELL;
  return (
    <>
      <Ground run={run} />
      <Areas run={run} />
      {run.exclusions.map(([robots, regions], i) => (
        <path key={i} {...INK.exclusion} d={outline(run, regions, 0.06 * CELL)}>
          <title>at most one of {robots.join(", ")} at a time</title>
        </path>
      ))}
      {run.chargers.map((region) => {
        const [col, row] = placeOf(run, region);
        return (
          <path key={region} {...INK.charger} d={run.charger} transform={`scale(${CELL}) translate(${col + 0.13} ${row + 0.62}) scale(0.11)`}>
            <title>charger</title>
          </path>
        );
      })}
      {numbers && fits && <Numbers run={run} size={size} hidden={covered(run, names, size, scale)} />}
    </>
  );
}

/** Whether two runs have the same floor: live runs and edits create new objects. */
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
  const walls = [...Array(run.rows * run.cols).keys()].filter((region) => isWall(run, region));
  return (
    <>
      <rect {...INK.ground} width={width} height={height} />
      <path {...INK.lines} d={lines.join("")} />
      <path {...INK.walls} d={filled(run, walls)} />
      <path {...INK.wallLine} d={outline(run, walls)} />
    </>
  );
}, sameFloor);

/** Return the regions without a number: named ones, and those in which a name would cover it. */
function covered(run: Run, names: Box[], size: number, scale: number): number[] {
  const [wide, high] = [(size * scale) / CELL, (2.8 * scale) / CELL];
  const found = names.length ? Object.keys(run.names).map(Number) : [];
  for (const name of names) {
    for (let row = Math.floor(name.top / scale); row * scale < name.bottom; row++) {
      for (let col = Math.floor(name.left / scale); col * scale < name.right; col++) {
        const region = row * run.cols + col;
        const [left, top] = [col * scale + high, row * scale];
        const width = LETTER * wide * String(region).length;
        if (overlap(name, { left, top, right: left + width, bottom: top + high / 2 + wide })) found.push(region);
      }
    }
  }
  return found;
}

const Numbers = memo(({ run, size, hidden }: { run: Run; size: number; hidden: number[] }) => {
  const under = new Set(hidden);
  const labels = [];
  for (let region = 0; region < run.rows * run.cols; region++) {
    if (isWall(run, region) || under.has(region)) continue;
    const [col, row] = placeOf(run, region);
    labels.push(
      <text x={col * CELL + 2.8} y={row * CELL + 1 + size}>
        {region}
      </text>,
    );
  }
  return (
    <g class="numbers" {...INK.numbers} font-size={size}>
      {labels}
    </g>
  );
}, sameFloor);
