/** Shapes of regions and of sets of regions on the map. */

import { placeOf, type Run } from "../run/run";
import { CELL } from "./camera";

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

/** A line of the same width at every zoom. */
const LINE = { fill: "none", "vector-effect": "non-scaling-stroke" } as const;
/** A robot's colour, lighter on a dark page. */
const OWN = "color-mix(in oklab, var(--colour), light-dark(var(--colour), white) 40%)";
const [ACCENT, GROUND] = ["var(--accent)", "var(--ground)"];
const BOX = { fill: "currentColor", "fill-opacity": 0.17, stroke: "currentColor", "stroke-width": 1.8 } as const;
const BOLD = { "font-weight": 700, "text-anchor": "middle" } as const;

export const INK = {
  ground: { fill: GROUND },
  lines: { fill: "none", stroke: "var(--grid)" },
  walls: { fill: "var(--wall)" },
  wallLine: { ...LINE, stroke: "var(--wall-line)" },
  areaLine: { ...LINE, stroke: ACCENT, "stroke-dasharray": "6 3", "stroke-width": 2 },
  exclusion: { ...LINE, stroke: "var(--synthesis)", "stroke-dasharray": "9 3 2 3", "stroke-width": 2.2 },
  charger: { fill: "var(--requested)" },
  numbers: { fill: "var(--number)" },
  names: { "stroke-linejoin": "round", "font-weight": 600, "paint-order": "stroke", "text-anchor": "middle", stroke: GROUND },
  // robots
  body: { stroke: "var(--outline)", "stroke-width": 0.1 },
  nose: { fill: "var(--outline)" },
  shape: { fill: "var(--ink)", "fill-rule": "evenodd" },
  plate: { fill: GROUND, stroke: "var(--ink)" },
  letters: BOLD,
  // obstacles, by status; a resolved one is out of the way: no box, a faded outline
  boxes: {
    hidden: { ...BOX, "fill-opacity": 0, "stroke-dasharray": "3 3", "stroke-width": 1 },
    found: BOX,
    requested: BOX,
    resolved: { fill: "none" },
    blocked: { ...BOX, "fill-opacity": 0.35 },
  },
  sign: { fill: "currentColor", "fill-rule": "evenodd" },
  opened: { fill: "none", stroke: "currentColor", "stroke-width": 0.08, opacity: 0.7 },
  // lanes
  moving: { fill: OWN },
  waiting: { fill: "var(--requested)" },
  helping: { fill: "var(--resolved)" },
  // targets
  aim: { ...LINE, stroke: OWN, "stroke-linejoin": "round", "stroke-width": 2.4 },
  current: { fill: "color-mix(in oklab, var(--colour) 32%, transparent)" },
  avoided: { "stroke-dasharray": "2.4 4.8" },
  target: { stroke: "var(--outline)", "stroke-width": 0.24 },
  intention: { ...LINE, stroke: OWN, "stroke-dasharray": "2 5", "stroke-linecap": "round", "stroke-width": 2 },
  // beliefs
  hatch: { fill: OWN, "fill-opacity": 0.55 },
  belief: { fill: "var(--colour)", "fill-opacity": 0.13 },
  beliefEdge: { fill: "none", stroke: OWN, "stroke-dasharray": "5 3", "stroke-width": 1.6 },
  seenEdge: { fill: "none", stroke: OWN, "stroke-width": 2.6 },
  // what is pointed out
  spoken: { ...LINE, stroke: "var(--ink)", "stroke-width": 1.2 },
  cursor: { fill: "none", stroke: ACCENT, "stroke-dasharray": "4 2", "stroke-width": 3 },
  order: { ...BOLD, fill: "var(--ink)", "font-size": 16 },
} as const;

/** Marks of a hand in regions. */
export const MARKS = {
  hover: { fill: ACCENT, "fill-opacity": 0.18, stroke: ACCENT, "stroke-width": 2 },
  chosen: { fill: ACCENT, "fill-opacity": 0.3, stroke: ACCENT, "stroke-width": 2 },
  picked: { fill: "none", stroke: ACCENT, "stroke-width": 2.5 },
  wall: INK.walls,
  floor: { fill: GROUND, stroke: ACCENT },
} as const;
