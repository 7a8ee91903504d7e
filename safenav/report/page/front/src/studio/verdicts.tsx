/** Problems of the scenario, and verdicts on its robots with repairs. */

import type { Say } from "../live/player";
import type { Chosen, DrawnRobot, Problem, Verdict } from "./model";

function Repairs({ verdict, say }: { verdict: Verdict; say: Say }) {
  return (verdict.repairs ?? []).slice(0, 5).map(({ change }) => (
    <button type="button" class="repair" onClick={() => say("edit", { op: "repair", change })}>
      {change.map(([item, value]) => wordsOf(item, value)).join("; ")}
    </button>
  ));
}

function wordsOf(item: string, value: string): string {
  if (item === "map" || item === "partition") return value;
  if (item === "obstacles") return `an obstacle there: ${value.replace(/[{}]/g, "")}`;
  return `${item.split(".").slice(1).join(" ")}: ${value}`;
}

interface ProblemsProps {
  problems: Problem[];
  verdicts: Record<string, Verdict>;
  robots: DrawnRobot[];
  go(line: number): void;
  choose(chosen: Chosen): void;
  say: Say;
}

export function Problems({ problems, verdicts, robots, go, choose, say }: ProblemsProps) {
  const judged = robots.map((robot) => verdicts[robot.name]).filter((v): v is Verdict => v !== undefined);
  return (
    <section class="panel problems" aria-labelledby="problems-title">
      <h2 id="problems-title">
        {problems.length === 0 ? "No problems" : "Problems"} {problems.length > 0 && <span class="count">{problems.length}</span>}
      </h2>
      <ul>
        {problems.map((problem) => (
          <li class="problem">
            <button type="button" class="event" onClick={() => go(problem.line)}>
              <span class="tick">{problem.line || ""}</span>
              <span>
                {problem.found}
                {problem.hint && <small class="quiet">{problem.hint}</small>}
              </span>
            </button>
          </li>
        ))}
        {judged.map((verdict) => (
          <li class={`verdict ${verdict.verdict}`} data-robot={verdict.robot} data-verdict={verdict.verdict}>
            <button type="button" class="event" onClick={() => choose({ robot: verdict.robot })}>
              <b>{verdict.robot}</b>
              <span>{verdict.verdict === "realizable" ? `realizable${verdict.allows ? ` (${verdict.allows})` : ""}` : verdict.because}</span>
            </button>
            {verdict.verdict === "unrealizable" && <Repairs verdict={verdict} say={say} />}
          </li>
        ))}
      </ul>
    </section>
  );
}
