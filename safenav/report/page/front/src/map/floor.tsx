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
  /** Their regions have no numbers. */
  names: Name[];
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
      {fits && <Numbers run={run} size={size} hidden={names.flatMap((name) => name.regions)} />}
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
/** Most height of the letters, in the width of their regions, so that a robot does not hide them. */
const BELOW = 0.19;
/** Pixels between a name and the border of its regions. */
const GAP = 2;

/** A name in one or two lines of one row of regions, abbreviated if it has to be; `x`: its middle, in cells. */
interface Name {
  text: string;
  lines: string[];
  /** Height of the letters in pixels. */
  size: number;
  x: number;
  row: number;
  /** The regions that it covers. */
  regions: number[];
  area: boolean;
}

const brush = document.createElement("canvas").getContext("2d")!;

/** The width of a text of size 1. */
function widthOf(text: string): number {
  brush.font = `600 100px ${getComputedStyle(document.body).fontFamily}`;
  return brush.measureText(text).width / 100;
}

/** Return a text in at most two lines that fit into a width and a region, and their size; null if there is no room for three letters. */
function fitted(text: string, wide: number, side: number): [lines: string[], size: number] | null {
  const parts = text.split(/(?<=[ _-])/);
  const folds = parts.slice(1).map((_, i) => [parts.slice(0, i + 1).join(""), parts.slice(i + 1).join("")]);
  const short = [...text].map((_, i) => [`${text.slice(0, text.length - 1 - i)}…`]).slice(0, -3);
  for (const lines of [[text], ...folds, ...short]) {
    const room = Math.min((wide - 2 * GAP) / Math.max(...lines.map(widthOf)), side / (lines.length * LINE));
    if (room >= LEAST) return [lines, Math.min(room, Math.max(LEAST, Math.min(MOST, BELOW * wide)))];
  }
  return null;
}

/**
 * The names of a map for a given cell size in pixels, at the lower edge of their region; that of an area in its
 * longest row. A name without room appears only on hover.
 */
export function placeNames(run: Run, scale: number): Name[] {
  const placed: Name[] = [];
  const place = (text: string, regions: number[], area: boolean): void => {
    const found = fitted(text, regions.length * scale, scale);
    if (found === null) return;
    const [lines, size] = found;
    const [col, row] = placeOf(run, regions[0]!);
    const half = (Math.max(...lines.map(widthOf)) * size) / scale / 2;
    const x = col + regions.length / 2;
    const covered = regions.filter((_, i) => col + i < x + half && col + i + 1 > x - half);
    placed.push({ text, lines, size, x, row, regions: covered, area });
  };
  for (const [region, text] of Object.entries(run.names)) place(text, [Number(region)], false);
  for (const [text, area] of Object.entries(run.areas)) {
    const taken = new Set(placed.flatMap((name) => name.regions));
    place(text, longest(run, area.filter((region) => !taken.has(region))), true);
  }
  return placed;
}

/** The longest run of regions in a row, the one nearest to their middle. */
function longest(run: Run, regions: number[]): number[] {
  const runs: number[][] = [[]];
  for (const region of regions) {
    if (region % run.cols && runs[0]!.at(-1) === region - 1) runs[0]!.push(region);
    else runs.unshift([region]);
  }
  const middle = regions.reduce((sum, region) => sum + placeOf(run, region)[1], 0) / regions.length;
  const away = (row: number[]): number => Math.abs(placeOf(run, row[0]!)[1] - middle);
  return runs.sort((a, b) => b.length - a.length || away(a) - away(b))[0]!;
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
      {names.map(({ text, lines, area, size, x, row }) => (
        <text key={text} data-name={text} fill={area ? "var(--accent)" : "var(--ink)"} font-size={size * unit} stroke-width={0.28 * size * unit}>
          {lines.map((line, i) => (
            <tspan x={x * CELL} y={(row + 1) * CELL - (GAP / 2 + (0.25 + (lines.length - 1 - i) * LINE) * size) * unit}>
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
