/** Below the lanes: the robustness of requirements, and deadlines. */

import type { Player } from "../run/player";
import type { Curve, Run, Slack } from "../run/run";

const HEIGHT = 22;

/** The robustness of each requirement over time; below its line it is violated. */
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

interface Bar {
  begin: number;
  due: number;
  end: number;
  verdict: Slack[4];
  /** Ticks until it was due; for an open deadline, until now. */
  left: number;
}

/** The bars of each deadline, in the order in which they begin. */
function barsOf(run: Run): Map<string, Bar[]> {
  const found = new Map<string, Bar[]>();
  for (const [tick, of, begin, due, verdict, slack] of run.deadlines) {
    const bars = found.get(of) ?? [];
    found.set(of, bars);
    const last = bars[bars.length - 1];
    const open = last && (last.verdict === "set" || last.verdict === "lost") && last.begin === begin;
    const runs = verdict === "set" || verdict === "lost";
    const [end, left] = runs ? [run.last, due - run.last] : [tick, slack];
    if (open) Object.assign(last, { end, verdict, left });
    else bars.push({ begin, due, end, verdict, left });
  }
  return found;
}

/** The bar with the least slack. */
function worstOf(bars: readonly Bar[]): Bar {
  return bars.reduce((a, b) => (b.left < a.left ? b : a));
}

const MISSED = { late: "missed", lost: "cannot be met", excused: "excused" } as const;

/** `met, 3 ticks of slack`. */
function slackOf(bars: readonly Bar[]): string {
  const worst = worstOf(bars);
  if (worst.verdict === "set") return "open";
  if (worst.verdict !== "kept") return MISSED[worst.verdict];
  return `met, ${worst.left} ${worst.left === 1 ? "tick" : "ticks"} of slack`;
}

/** Each deadline from its start to its due tick, and the time used. */
export function Deadlines({ run, player }: { run: Run; player: Player }) {
  if (run.deadlines.length === 0) return null;
  const last = player.end || 1;
  const x = (tick: number): string => Math.min(last, player.timeOf(Math.min(run.last, tick))).toFixed(2);
  return (
    <ol class="curves deadlines">
      {[...barsOf(run)].map(([of, bars]) => (
        <li key={of} data-of={of} class={worstOf(bars).verdict} title={`${of}: ${slackOf(bars)}`}>
          <svg viewBox={`0 0 ${last} 4`} preserveAspectRatio="none" role="img">
            <title>{`${of}: ${slackOf(bars)}`}</title>
            {bars.map(({ begin, due, end, verdict }) => (
              <>
                <path class="allowed" d={`M${x(begin)} .5H${x(due)}V3.5H${x(begin)}z`} />
                <path class={`used ${verdict}`} d={`M${x(begin)} 1H${x(end)}V3H${x(begin)}z`} />
              </>
            ))}
          </svg>
          <span>
            {of}: {slackOf(bars)}
          </span>
        </li>
      ))}
    </ol>
  );
}
