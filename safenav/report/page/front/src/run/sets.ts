/** Sets of regions as `safenav/report/page/encode.py` writes them. */

import type { Run } from "./run";

/** Runs of consecutive regions: the first region and the length of each. */
type Runs = [start: number, count: number][];

const readSets = new Map<string, Runs>();

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

export function regionsOf(run: Run, set: number): number[] {
  return runsOf(run, set).flatMap(([start, count]) => Array.from({ length: count }, (_, i) => start + i));
}
