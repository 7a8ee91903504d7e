/** Names of regions and areas: placed so that none lies over another, and outlines of areas. */

import { memo } from "preact/compat";
import { useMemo } from "preact/hooks";
import { CELL } from "./camera";
import type { Run } from "../run/run";

/** Heights of letters in pixels: large ones are better, and a name in its own region is best. */
const SIZES = [13, 12, 11, 10, 9];
const LINE = 1.2;
const GAP = 2;
/** Half of the middle of a named region, where robots stand, in cells. */
const BODY = 0.3;
/** Width and height of the corner of a region that has its number, in cells. */
const NUMBER: readonly [number, number] = [0.45, 0.3];
/** Costs of a name on a wall, and for each other region that it reaches into. */
const ON_WALL = 0.6;
const BESIDE = 0.1;

/** A rectangle in pixels of the whole map. */
export interface Box {
  left: number;
  top: number;
  right: number;
  bottom: number;
}

interface Name extends Box {
  text: string;
  size: number;
  area: boolean;
}

/** The boxes in or beside which a name may be placed, the best first. */
interface Subject {
  text: string;
  area: boolean;
  own: ReadonlySet<number>;
  boxes: Box[];
}

const brush = document.createElement("canvas").getContext("2d")!;

/** The width of a text of size 1. */
function widthOf(text: string): number {
  brush.font = `600 100px ${getComputedStyle(document.body).fontFamily}`;
  return brush.measureText(text).width / 100;
}

function subjectsOf(run: Run, scale: number): Subject[] {
  const cell = (region: number): Box => {
    const [left, top] = [(region % run.cols) * scale, Math.floor(region / run.cols) * scale];
    return { left, top, right: left + scale, bottom: top + scale };
  };
  const subjects = Object.entries(run.names).map(([number, text]) => ({
    text,
    area: false,
    own: new Set([Number(number)]),
    boxes: [cell(Number(number))],
  }));
  const areas = Object.entries(run.areas).map(([text, regions]) => {
    const middle = (value: (region: number) => number): number =>
      regions.reduce((sum, region) => sum + value(region), 0) / regions.length;
    const [row, col] = [middle((r) => Math.floor(r / run.cols)), middle((r) => r % run.cols)];
    const away = (r: number): number => Math.hypot(Math.floor(r / run.cols) - row, (r % run.cols) - col);
    return { text, area: true, own: new Set(regions), boxes: [...regions].sort((a, b) => away(a) - away(b)).slice(0, 24).map(cell) };
  });
  return [...subjects, ...areas];
}

/** Positions of a text for a box: inside at the bottom, below, above, beside, diagonal. */
function* places(box: Box, width: number, height: number, area: boolean): Generator<[x: number, y: number]> {
  const x = (box.left + box.right) / 2;
  const y = (box.top + box.bottom) / 2;
  const [below, above] = [box.bottom + height / 2, box.top - height / 2];
  if (area) yield [x, y];
  yield [x, box.bottom - height / 2 - 1];
  yield [x, below];
  yield [x, above];
  yield [box.right + width / 2 + GAP, y];
  yield [box.left - width / 2 - GAP, y];
  for (const across of [width / 3, -width / 3]) {
    yield [x + across, below];
    yield [x + across, above];
  }
}

/** The names of a map for a given cell size in pixels; a name without room appears only on hover. */
export function placeNames(run: Run, scale: number): Name[] {
  const placed: Name[] = [];
  const [width, height] = [run.cols * scale, run.rows * scale];
  const subjects = subjectsOf(run, scale);
  const bodies = subjects
    .filter((subject) => !subject.area)
    .map(({ boxes: [box] }) => grown(box!, -(0.5 - BODY) * scale));
  for (const { text, area, own, boxes } of subjects) {
    const wide = widthOf(text);
    let best: Name | null = null;
    let least = Infinity;
    let order = 0;
    for (const size of SIZES) {
      const [w, h] = [wide * size + GAP, LINE * size];
      if (w > width || h > height) continue;
      for (const box of boxes) {
        for (const [x, y] of places(box, w, h, area)) {
          const left = Math.min(Math.max(x - w / 2, 0), width - w);
          const top = Math.min(Math.max(y - h / 2, 0), height - h);
          const name = { text, area, size, left, top, right: left + w, bottom: top + h };
          if (placed.some((other) => overlap(name, other))) continue;
          let cost = costOf(run, own, scale, name) + bodies.reduce((sum, body) => sum + shared(name, body), 0);
          cost += 0.03 * (SIZES[0]! - size) + 1e-4 * order++;
          if (cost < least) [best, least] = [name, cost];
        }
      }
    }
    if (best !== null) placed.push(best);
  }
  return placed;
}

/** How much a name covers that is not its own: numbers, other regions, walls. */
function costOf(run: Run, own: ReadonlySet<number>, scale: number, box: Box): number {
  let cost = 0;
  for (let row = Math.floor(box.top / scale); row < run.rows && row * scale < box.bottom; row++) {
    for (let col = Math.floor(box.left / scale); col < run.cols && col * scale < box.right; col++) {
      const [left, top, region] = [col * scale, row * scale, row * run.cols + col];
      const share = shared(box, { left, top, right: left + scale, bottom: top + scale });
      if (share > 0 && !own.has(region)) cost += BESIDE;
      if (run.grid[row]![col] === "#") cost += ON_WALL * share;
      else {
        const corner = { left, top, right: left + NUMBER[0] * scale, bottom: top + NUMBER[1] * scale };
        cost += (overlap(box, corner) ? 2 : 0) + (own.has(region) ? 0 : share);
      }
    }
  }
  return cost;
}

/** The part of a box that another one covers. */
function shared(box: Box, other: Box): number {
  const wide = Math.min(box.right, other.right) - Math.max(box.left, other.left);
  const high = Math.min(box.bottom, other.bottom) - Math.max(box.top, other.top);
  return (Math.max(0, wide) * Math.max(0, high)) / ((box.right - box.left) * (box.bottom - box.top));
}

function grown(box: Box, by: number): Box {
  return { left: box.left - by, top: box.top - by, right: box.right + by, bottom: box.bottom + by };
}

export function overlap(a: Box, b: Box): boolean {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}

export function useNames(run: Run, scale: number): Name[] {
  return useMemo(() => placeNames(run, scale), [run.cols, run.rows, key(run), scale]);
}

function key(run: Run): string {
  return JSON.stringify([run.names, run.areas]);
}

export function Names({ names, scale }: { names: Name[]; scale: number }) {
  const unit = CELL / scale;
  return (
    <g class="names">
      {names.map(({ text, area, size, left, right, bottom }) => (
        <text
          key={text}
          class={area ? "area-name" : ""}
          x={((left + right) / 2) * unit}
          y={(bottom - 0.3 * size) * unit}
          font-size={size * unit}
          stroke-width={0.28 * size * unit}
        >
          {text}
        </text>
      ))}
    </g>
  );
}

/** Lines around the areas, on the borders of their outer regions. */
export const Areas = memo(
  ({ run }: { run: Run }) => (
    <>
      {Object.entries(run.areas).map(([name, regions]) => (
        <path class="area-line" key={name} data-area={name} d={outline(run, regions)} />
      ))}
    </>
  ),
  (a, b) => key(a.run) === key(b.run) && a.run.cols === b.run.cols,
);

/** Return the outer border of a set of regions, moved inwards by `inset`. */
export function outline(run: Run, regions: readonly number[], inset = 0): string {
  const held = new Set(regions);
  const has = (row: number, col: number): boolean =>
    row >= 0 && col >= 0 && col < run.cols && held.has(row * run.cols + col);
  let path = "";
  for (const region of held) {
    const [col, row] = [region % run.cols, Math.floor(region / run.cols)];
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
