/** What a hand draws over regions of the map. */

import { CELL } from "./camera";
import type { Run } from "../run/run";

export function centreOf(run: Run, region: number): [x: number, y: number] {
  return [((region % run.cols) + 0.5) * CELL, (Math.floor(region / run.cols) + 0.5) * CELL];
}

/** A frame in a region; `kind` is its style. */
export function square(run: Run, region: number, kind: string, key: string) {
  const [x, y] = [(region % run.cols) * CELL + 1.5, Math.floor(region / run.cols) * CELL + 1.5];
  return <rect key={key} class={`mark-${kind}`} x={x} y={y} width={CELL - 3} height={CELL - 3} rx={4} />;
}

/** The numbers of regions in their order. */
export function ordered(run: Run, regions: readonly number[]) {
  return regions.map((region, i) => (
    <text key={`o${i}`} class="order" x={((region % run.cols) + 0.5) * CELL} y={(Math.floor(region / run.cols) + 0.64) * CELL}>
      {i + 1}
    </text>
  ));
}
