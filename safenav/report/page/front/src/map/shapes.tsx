/** Shapes of regions and of sets of regions on the map. */

import { CELL } from "./camera";
import { INK, MARKS } from "./ink";
import { placeOf, type Run } from "../run/run";

export function centreOf(run: Run, region: number): [x: number, y: number] {
  const [col, row] = placeOf(run, region);
  return [(col + 0.5) * CELL, (row + 0.5) * CELL];
}

/** A frame in a region; `kind` is its style. */
export function square(run: Run, region: number, kind: keyof typeof MARKS, key: string) {
  const [col, row] = placeOf(run, region);
  return <rect key={key} {...MARKS[kind]} x={col * CELL + 1.5} y={row * CELL + 1.5} width={CELL - 3} height={CELL - 3} rx={4} />;
}

/** The numbers of regions in their order. */
export function ordered(run: Run, regions: readonly number[]) {
  return regions.map((region, i) => {
    const [x, y] = centreOf(run, region);
    return (
      <text key={`o${i}`} class="order" {...INK.order} x={x} y={y + 0.14 * CELL}>
        {i + 1}
      </text>
    );
  });
}

/** The area of regions in rising order. */
export function filled(run: Run, regions: readonly number[]): string {
  let path = "";
  let width = 0;
  regions.forEach((region, i) => {
    const [col, row] = placeOf(run, region);
    width += CELL;
    if (regions[i + 1] === region + 1 && col < run.cols - 1) return;
    path += `M${(col + 1) * CELL - width} ${row * CELL}h${width}v${CELL}h${-width}z`;
    width = 0;
  });
  return path;
}

/** Return the outer border of a set of regions, moved inwards by `inset`. */
export function outline(run: Run, regions: readonly number[], inset = 0): string {
  const held = new Set(regions);
  const has = (row: number, col: number): boolean =>
    row >= 0 && col >= 0 && col < run.cols && held.has(row * run.cols + col);
  let path = "";
  for (const region of held) {
    const [col, row] = placeOf(run, region);
    const end = (open: boolean, corner: boolean): number => (!open ? inset : corner ? -inset : 0);
    for (const side of [-1, 1]) {
      if (!has(row + side, col)) {
        const y = (row + (side + 1) / 2) * CELL - side * inset;
        const left = col * CELL + end(has(row, col - 1), has(row + side, col - 1));
        const right = (col + 1) * CELL - end(has(row, col + 1), has(row + side, col + 1));
        path += `M${left} ${y}H${right}`;
      }
      if (!has(row, col + side)) {
        const x = (col + (side + 1) / 2) * CELL - side * inset;
        const top = row * CELL + end(has(row - 1, col), has(row - 1, col + side));
        const bottom = (row + 1) * CELL - end(has(row + 1, col), has(row + 1, col + side));
        path += `M${x} ${top}V${bottom}`;
      }
    }
  }
  return path;
}
