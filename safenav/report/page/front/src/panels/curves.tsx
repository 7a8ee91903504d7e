/** Below the lanes: the robustness of each requirement over time; below its line it is violated. */

import type { Curve, Run } from "../run/run";

const HEIGHT = 22;

export function Curves({ run, end }: { run: Run; end: number }) {
  if (!run.curves?.length) return null;
  return (
    <ol class="curves">
      {run.curves.map((curve) => (
        <li key={curve.name} class={curve.verdict} title={curve.told} data-requirement={curve.name}>
          <Plot curve={curve} end={end} />
          <span>
            {curve.name}: {curve.verdict}
          </span>
        </li>
      ))}
    </ol>
  );
}

function Plot({ curve, end }: { curve: Curve; end: number }) {
  const values = curve.points.map(([, value]) => value);
  const [top, bottom] = [Math.max(0, ...values), Math.min(0, ...values)];
  const y = (value: number): string => ((HEIGHT * (top - value)) / (top - bottom || 1)).toFixed(2);
  const line = curve.points.map(([seconds, value]) => `${seconds} ${y(value)}`).join("L");
  return (
    <svg viewBox={`0 -1 ${end || 1} ${HEIGHT + 2}`} preserveAspectRatio="none" role="img">
      <title>{curve.told}</title>
      <path class="zero" d={`M0 ${y(0)}H${end}`} />
      <path class="curve" d={`M${line}`} />
    </svg>
  );
}
