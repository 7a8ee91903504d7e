/** The ground of the map: free regions, walls, numbers and areas. */

import { memo } from "preact/compat";
import { useMemo } from "preact/hooks";
import { isWall, placeOf, type Run } from "../run/run";
import { CELL } from "./camera";
import { filled, INK, outline } from "./shapes";

/** Text below this many pixels is not shown, nor numbers in regions below this side. */
const LEGIBLE = 8;
const LEAST_CELL = 28;
/** The width of a letter, in font sizes. */
const LETTER = 0.6;

interface FloorProps {
  run: Run;
  /** Boxes of names in pixels; their regions have no numbers. */
  names: Box[];
  /** Pixels of a cell. */
  scale: number;
}

export function Floor({ run, names, scale }: FloorProps) {
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
      {fits && <Numbers run={run} size={size} hidden={names.flatMap((name) => cellsOf(name, scale)).map(([row, col]) => row * run.cols + col)} />}
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

/** Heights of letters in pixels. */
const [MOST, LEAST] = [13, 9];
const LINE = 1.15;
/** Most height of the letters in a region, in its sides, so that its robot does not hide them. */
const BELOW = 0.19;
/** Pixels between a name and the border of its region. */
const GAP = 2;
/** Regions in which the name of an area is tried. */
const MOST_TRIED = 24;

/** A rectangle in pixels of the whole map. */
export interface Box {
  left: number;
  top: number;
  right: number;
  bottom: number;
}

interface Name extends Box {
  text: string;
  /** The text in one or two lines, abbreviated if it has to be. */
  lines: string[];
  size: number;
  area: boolean;
}

const brush = document.createElement("canvas").getContext("2d")!;

/** The width of a text of size 1. */
function widthOf(text: string): number {
  brush.font = `600 100px ${getComputedStyle(document.body).fontFamily}`;
  return brush.measureText(text).width / 100;
}

/** Return a text in at most two lines that fit a region, and their size; null if there is no room for three letters. */
function fitted(text: string, side: number): [lines: string[], size: number] | null {
  const parts = text.split(/(?<=[ _-])/);
  const folds = parts.slice(1).map((_, i) => [parts.slice(0, i + 1).join(""), parts.slice(i + 1).join("")]);
  const short = [...text].map((_, i) => [`${text.slice(0, text.length - 1 - i)}…`]).slice(0, -3);
  for (const lines of [[text], ...folds, ...short]) {
    const room = Math.min((side - 2 * GAP) / Math.max(...lines.map(widthOf)), side / (lines.length * LINE));
    if (room >= LEAST) return [lines, Math.min(room, Math.max(LEAST, Math.min(MOST, BELOW * side)))];
  }
  return null;
}

/**
 * The names of a map for a given cell size in pixels. That of a region stands at the lower edge of
 * the region, that of an area in its middle; a name without room appears only on hover.
 */
export function placeNames(run: Run, scale: number): Name[] {
  const cornerOf = (region: number) => placeOf(run, region).map((at) => at * scale) as [x: number, y: number];
  const inRegion = (text: string, region: number, area: boolean): Name | null => {
    const found = fitted(text, scale);
    if (found === null) return null;
    const [lines, size] = found;
    const [x, y] = cornerOf(region);
    const wide = Math.max(...lines.map(widthOf)) * size;
    const left = x + (scale - wide) / 2;
    const bottom = y + scale - GAP / 2;
    return { text, lines, size, area, left, right: left + wide, top: bottom - lines.length * LINE * size, bottom };
  };
  const placed = Object.entries(run.names).flatMap(([number, text]) => inRegion(text, Number(number), false) ?? []);
  for (const [text, regions] of Object.entries(run.areas)) {
    const own = new Set(regions);
    const free = (box: Box): boolean =>
      placed.every((other) => !overlap(box, other)) &&
      cellsOf(box, scale).every(([row, col]) => col < run.cols && own.has(row * run.cols + col));
    const tried = middleFirst(run, regions).slice(0, MOST_TRIED);
    const whole = [MOST, LEAST].flatMap((size) =>
      tried.flatMap((region): Name[] => {
        const [wide, high] = [widthOf(text) * size + 2 * GAP, LINE * size];
        const [x, y] = cornerOf(region);
        const left = x + (scale - wide) / 2;
        const middle = y + (scale - high) / 2;
        return [middle, y + GAP].map((top) => ({ text, lines: [text], size, area: true, left, right: left + wide, top, bottom: top + high }));
      }),
    );
    const small = tried.map((region) => inRegion(text, region, true));
    const name = [...whole, ...small].find((name) => name !== null && free(name));
    if (name) placed.push(name);
  }
  return placed;
}

/** Rows and columns that a box touches. */
function cellsOf(box: Box, scale: number): [row: number, col: number][] {
  const found: [number, number][] = [];
  for (let row = Math.floor(box.top / scale); row * scale < box.bottom; row++) {
    for (let col = Math.floor(box.left / scale); col * scale < box.right; col++) found.push([row, col]);
  }
  return found;
}

function middleFirst(run: Run, regions: number[]): number[] {
  const middle = [0, 1].map((axis) => regions.reduce((sum, region) => sum + placeOf(run, region)[axis]!, 0) / regions.length);
  const away = (region: number): number => Math.hypot(...placeOf(run, region).map((at, axis) => at - middle[axis]!));
  return [...regions].sort((a, b) => away(a) - away(b));
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
    <g class="names" {...INK.names}>
      {names.map(({ text, lines, area, size, left, right, bottom }) => (
        <text key={text} data-name={text} fill={area ? "var(--accent)" : "var(--ink)"} font-size={size * unit} stroke-width={0.28 * size * unit}>
          {lines.map((line, i) => (
            <tspan x={((left + right) / 2) * unit} y={(bottom - (0.25 + (lines.length - 1 - i) * LINE) * size) * unit}>
              {line}
            </tspan>
          ))}
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
        <path {...INK.areaLine} key={name} data-area={name} d={outline(run, regions)} />
      ))}
    </>
  ),
  (a, b) => key(a.run) === key(b.run) && a.run.cols === b.run.cols,
);
