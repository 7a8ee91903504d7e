/** Sets of regions as `safenav/report/page/encode.py` writes them, and their shapes. */

import type { Run } from "./run";

/** Runs of consecutive regions: the first region and the length of each. */
type Runs = [start: number, count: number][];

interface Shape {
  area: string;
  border: string;
}

const readSets = new Map<string, Runs>();
const drawnSets = new Map<string, Shape>();

/** The runs of a set, parsed on first use. */
export function runsOf(run: Run, set: number): Runs {
  const text = run.sets[set]!;
  let runs = readSets.get(text);
  if (runs === undefined) readSets.set(text, (runs = decoded(text)));
  return runs;
}

function decoded(text: string): Runs {
  const numbers = text === "" ? [] : text.split(",").map(Number);
  const runs: Runs = [];
  let end = 0;
  for (let i = 0; i < numbers.length; i += 2) {
    const start = end + numbers[i]!;
    end = start + numbers[i + 1]!;
    runs.push([start, end - start]);
  }
  return runs;
}

export function holds(run: Run, set: number, region: number): boolean {
  return runsOf(run, set).some(([start, count]) => region >= start && region < start + count);
}

export function sizeOf(run: Run, set: number): number {
  return runsOf(run, set).reduce((sum, [, count]) => sum + count, 0);
}

/** The area of a set as path data, and the border around it (without its inner edges). */
export function shapeOf(run: Run, set: number, cell: number): Shape {
  const text = run.sets[set]!;
  let shape = drawnSets.get(text);
  if (shape === undefined) drawnSets.set(text, (shape = drawn(run, set, cell)));
  return shape;
}

function drawn(run: Run, set: number, cell: number): Shape {
  const regions = new Set<number>();
  for (const [start, count] of runsOf(run, set)) for (let i = 0; i < count; i++) regions.add(start + i);
  let area = "";
  let border = "";
  let width = 0;
  for (const region of regions) {
    const col = region % run.cols;
    const x = col * cell;
    const y = Math.floor(region / run.cols) * cell;
    width += cell;
    if (col === run.cols - 1 || !regions.has(region + 1)) {
      area += `M${x + cell - width} ${y}h${width}v${cell}h${-width}z`;
      width = 0;
    }
    if (!regions.has(region - run.cols)) border += `M${x} ${y}h${cell}`;
    if (!regions.has(region + run.cols)) border += `M${x} ${y + cell}h${cell}`;
    if (col === 0 || !regions.has(region - 1)) border += `M${x} ${y}v${cell}`;
    if (col === run.cols - 1 || !regions.has(region + 1)) border += `M${x + cell} ${y}v${cell}`;
  }
  return { area, border };
}
