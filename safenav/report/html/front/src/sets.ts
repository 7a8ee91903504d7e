/** Sets of regions as `safenav/report/html/region_sets.py` writes them, and their shapes. */

import type { Run } from "./run";

const DIGITS = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
const BASE = 32;

/** Runs of consecutive regions: where each begins, and how many there are. */
type Runs = [start: number, count: number][];

const known = new WeakMap<Run, Map<number, Runs>>();

/** The runs of a set; read when it is first asked for. */
export function runsOf(run: Run, set: number): Runs {
  const read = known.get(run) ?? new Map<number, Runs>();
  known.set(run, read);
  const found = read.get(set) ?? decoded(run.sets[set]!);
  read.set(set, found);
  return found;
}

function decoded(text: string): Runs {
  const numbers: number[] = [];
  let value = 0;
  let scale = 1;
  for (const letter of text) {
    const digit = DIGITS.indexOf(letter);
    value += (digit % BASE) * scale;
    scale *= BASE;
    if (digit >= BASE) continue;
    numbers.push(value);
    value = 0;
    scale = 1;
  }
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

/** The area of a set as path data, and the border around it (its inner edges left out). */
export function shapeOf(run: Run, set: number, cell: number): { area: string; border: string } {
  const regions = new Set<number>();
  for (const [start, count] of runsOf(run, set)) for (let i = 0; i < count; i++) regions.add(start + i);
  let area = "";
  let border = "";
  for (const region of regions) {
    const col = region % run.cols;
    const x = col * cell;
    const y = Math.floor(region / run.cols) * cell;
    area += `M${x} ${y}h${cell}v${cell}h${-cell}z`;
    if (!regions.has(region - run.cols)) border += `M${x} ${y}h${cell}`;
    if (!regions.has(region + run.cols)) border += `M${x} ${y + cell}h${cell}`;
    if (col === 0 || !regions.has(region - 1)) border += `M${x} ${y}v${cell}`;
    if (col === run.cols - 1 || !regions.has(region + 1)) border += `M${x + cell} ${y}v${cell}`;
  }
  return { area, border };
}
