/** The sides of the drawing board: tools, the selection, problems. */

import { useEffect, useRef, useState } from "preact/hooks";
import type { Say } from "../live/player";
import { unless } from "../panels/notice";
import { label } from "../run/run";
import { choose as chooseTarget } from "./objective";
import { idOf, type Chosen, type Doc, type DrawnRobot, type Drawing, type Pen, type Problem, type Verdict } from "./model";
import { Parts } from "./parts";

interface Drawn {
  doc: Doc;
  drawing: Drawing;
  pen: Pen;
  setPen(pen: Pen): void;
  chosen: Chosen;
  choose(chosen: Chosen): void;
  say: Say;
}

export const NEW_AREA: Pen & { does: "area" } = { does: "area", area: null, corner: null };

export function Tools({ doc, drawing, pen, setPen, say }: Drawn) {
  const tool = (key: string, pressed: boolean, words: string, next: Pen, hint: string, shape = "") => (
    <button type="button" key={key} class={`pen ${key.split(" ")[0]}`} aria-pressed={pressed} title={hint} onClick={() => setPen(next)}>
      {shape && (
        <svg class="shape" viewBox="-1.1 -1.1 2.2 2.2" aria-hidden="true">
          <path d={shape} fill-rule="evenodd" />
        </svg>
      )}
      {words}
    </button>
  );
  const types = (blocks: boolean) =>
    doc.palette.obstacles
      .filter((type) => type.blocks === blocks)
      .map(({ name, shape, action }) =>
        tool(
          `obstacle ${name}`,
          (pen.does === "obstacle" || pen.does === "order") && pen.type === name,
          name,
          { does: blocks ? "obstacle" : "order", type: name },
          blocks ? `unknown to the robots; '${action}' resolves it` : `an order of the scenario; '${action}' resolves it`,
          shape,
        ),
      );
  return (
    <div class="tools-of-map">
      <section class="panel" aria-label="Tools">
        <h2>Draw</h2>
        <div class="pens">
          {tool("select", pen.does === "select", "Select", { does: "select" }, "Select and drag items (V)")}
          {tool("wall", pen.does === "wall", "Wall", { does: "wall" }, "Paint walls (1)")}
          {tool("floor", pen.does === "floor", "Floor", { does: "floor" }, "Paint floor (2)")}
          {tool("name", pen.does === "name", "Name", { does: "name" }, "Click a region to name it (3)")}
          {tool("area", pen.does === "area", "Area", NEW_AREA, "Drag over the regions of an area and name it (4)")}
          {tool("charger", pen.does === "charger", "Charger", { does: "charger" }, "Click regions where batteries are charged")}
        </div>
        <h3>Robots</h3>
        <div class="pens">
          {doc.palette.robots.map(({ name, shape, turns, layer, can }) =>
            tool(
              `robot ${name}`,
              pen.does === "robot" && pen.model === name,
              name,
              { does: "robot", model: name, turns },
              `${layer}; can ${can.join(", ") || "nothing special"}${turns ? "; has a heading" : ""}`,
              shape,
            ),
          )}
        </div>
        <h3>Hidden obstacles</h3>
        <div class="pens">{types(true)}</div>
        <h3>Orders</h3>
        <div class="pens">
          {tool(
            "delivery",
            pen.does === "delivery",
            "Delivery",
            { does: "delivery", from: null },
            "Order the delivery of a load from one region to another",
          )}
          {types(false)}
        </div>
      </section>
      <Size drawing={drawing} say={say} />
      <Settings doc={doc} drawing={drawing} say={say} />
    </div>
  );
}

function Size({ drawing, say }: { drawing: Drawing; say: Say }) {
  const { rows, cols } = drawing.run;
  const grow = (side: string, by: number): void => say("edit", { op: "resize", [side]: by });
  const sides: [string, string][] = [
    ["top", "↑"],
    ["bottom", "↓"],
    ["left", "←"],
    ["right", "→"],
  ];
  return (
    <section class="panel size" aria-label="Size of the map">
      <h2>
        Map <span class="quiet">{rows} x {cols}</span>
      </h2>
      {drawing.grid ? (
        <ul>
          {sides.map(([side, arrow]) => (
            <li key={side}>
              {arrow}
              <button type="button" aria-label={`Remove a row or column: ${side}`} onClick={() => grow(side, -1)}>
                −
              </button>
              <button type="button" aria-label={`Add a row or column: ${side}`} onClick={() => grow(side, 1)}>
                +
              </button>
            </li>
          ))}
        </ul>
      ) : (
        <>
          <p class="quiet">This map comes from a file; edit the file.</p>
          <button type="button" title="Copy the map into the scenario, which then needs no file" onClick={() => say("embed")}>
            Copy into the scenario
          </button>
        </>
      )}
    </section>
  );
}

function Settings({ doc, drawing, say }: { doc: Doc; drawing: Drawing; say: Say }) {
  const { name, rounds, seed } = drawing.settings;
  const set = (key: string, value: string | number): void => say("edit", { op: "set_value", key, value });
  return (
    <section class="panel chosen" aria-label="Settings of the scenario">
      <h2>Scenario</h2>
      <Field name="title" value={name} onChange={(value) => set("name", value)} />
      <Field name="rounds" number value={String(rounds)} onChange={(value) => set("rounds", Number(value))} />
      <Field name="seed" number value={String(seed)} onChange={(value) => set("seed", Number(value))} />
      <Parts doc={doc} say={say} path={[]} keys={doc.palette.keys.scenario} add="Add a key of the scenario ..." />
    </section>
  );
}

export function Selection({ doc, drawing, pen, setPen, chosen, choose, say, verdict }: Drawn & { verdict: Verdict | null }) {
  const edit = (op: string, data: object): void => say("edit", { op, ...data });
  if (chosen && "robot" in chosen) {
    const robot = drawing.robots.find((r) => r.name === chosen.robot);
    if (!robot) return null;
    const called = (region: number): string => drawing.run.names[region] ?? String(region);
    const drawingObjective = pen.does === "objective" && pen.robot === robot.name;
    return (
      <section key={`robot ${robot.name}`} class="panel chosen" aria-label="The chosen robot">
        <h2>
          Robot
          <button
            type="button"
            onClick={() => {
              edit("remove_robot", { robot: robot.name });
              choose(null);
            }}
          >
            Remove
          </button>
        </h2>
        <Field
          name="name"
          value={robot.name}
          onChange={(name) => {
            edit("rename_robot", { robot: robot.name, name });
            choose({ robot: name });
          }}
        />
        <label>
          model
          <select
            value={robot.model}
            onChange={(event) => {
              const model = event.currentTarget.value;
              const turns = doc.palette.robots.find((m) => m.name === model)?.turns ?? false;
              edit("set_model", { robot: robot.name, model, turns });
            }}
          >
            {doc.palette.robots.map(({ name }) => (
              <option value={name}>{name}</option>
            ))}
          </select>
        </label>
        {robot.heading !== null && (
          <label>
            heading
            <select value={robot.heading} onChange={(event) => edit("set_heading", { robot: robot.name, heading: event.currentTarget.value })}>
              {["north", "east", "south", "west"].map((heading) => (
                <option value={heading}>{heading}</option>
              ))}
            </select>
          </label>
        )}
        <h3>Objective</h3>
        <p class="pursued">
          {robot.kind ?? "none"} {robot.targets.map((target, i) => robot.areas[i] ?? target.map(called).join(" or ")).join(", ")}
        </p>
        <div class="pens">
          {doc.palette.objectives.map((kind) => (
            <button
              type="button"
              key={kind.kind}
              title={kind.meaning}
              aria-pressed={drawingObjective && pen.kind.kind === kind.kind}
              onClick={() => setPen({ does: "objective", robot: robot.name, kind, targets: [] })}
            >
              {kind.label}
            </button>
          ))}
        </div>
        {Object.keys(drawing.areas).length > 0 && (
          <div class="pens areas" role="group" aria-label="Areas as targets">
            {Object.keys(drawing.areas).map((area) => (
              <button
                type="button"
                key={area}
                {...unless(
                  !drawingObjective && "choose a kind of objective first: then this area can be a target",
                  () => drawingObjective && chooseTarget(pen, area, setPen, say),
                )}
              >
                {area}
              </button>
            ))}
          </div>
        )}
        {doc.palette.objectives.some(({ kind, strict }) => strict && kind === robot.kind) && (
          <label class="check" title="The paper's formula: no target is crossed out of turn. Otherwise a weaker form is accepted.">
            <input
              type="checkbox"
              checked={robot.literal}
              onChange={(event) => edit("set_form", { robot: robot.name, literal: event.currentTarget.checked })}
            />{" "}
            literal form
          </label>
        )}
        <div class="verdict-room">{verdict && <Judged verdict={verdict} say={say} />}</div>
        <Parts
          doc={doc}
          say={say}
          path={["robots", robot.name, "objective"]}
          keys={doc.palette.keys.objective}
          add="Add a rule to its objective ..."
        />
        <h3>Robot</h3>
        <Parts doc={doc} say={say} path={["robots", robot.name]} keys={doc.palette.keys.robot} add="Add a key of the robot ..." />
        <Own doc={doc} say={say} of="robots" name={robot.model} />
      </section>
    );
  }
  if (chosen && "obstacle" in chosen) {
    const obstacle = drawing.obstacles.find((one) => idOf(one) === chosen.obstacle);
    if (!obstacle) return null;
    const kind = doc.palette.obstacles.find((type) => type.name === obstacle.type);
    const place = { list: obstacle.list, index: obstacle.index };
    const ordered = obstacle.list === "orders";
    const set = (key: string, value: unknown): void => edit("set_obstacle", { ...place, key, value });
    const tick = (key: "from" | "until" | "at", words: string) => (
      <Field
        name={words}
        number
        value={obstacle[key] === null ? "" : String(obstacle[key])}
        onChange={(value) => set(key, value === "" ? null : Number(value))}
      />
    );
    return (
      <section key={chosen.obstacle} class="panel chosen" aria-label="The chosen obstacle">
        <h2>
          <span>
            {ordered ? "Order:" : "Hidden"} {obstacle.type} <span class="quiet">{label(drawing.run, obstacle.region)}</span>
          </span>
          <button
            type="button"
            onClick={() => {
              edit("remove_obstacle", place);
              choose(null);
            }}
          >
            Remove
          </button>
        </h2>
        <p class="quiet">{kind ? `'${kind.action}' resolves it` : "unknown type"}</p>
        {kind?.truth && (
          <label>
            turns out
            <select
              value={String(obstacle.traversable ?? true)}
              onChange={(event) => set("traversable", event.currentTarget.value === "true")}
            >
              <option value="true">passable</option>
              <option value="false">impassable</option>
            </select>
          </label>
        )}
        {ordered && tick("at", "ordered at tick")}
        {!ordered && tick("from", "appears at tick")}
        {!ordered && tick("until", "disappears at tick")}
        <Field
          name="resolve within"
          number
          value={obstacle.within === null ? "" : String(obstacle.within)}
          onChange={(value) => set("resolve_within", value === "" ? null : Number(value))}
        />
        {!ordered && (
          <label>
            sweeps
            <select value={obstacle.sweeps ?? ""} onChange={(event) => set("sweeps", event.currentTarget.value || null)}>
              <option value="">as its type</option>
              <option value="neighbours">all adjacent regions</option>
              {obstacle.sweeps === "listed" && (
                <option value="listed" disabled>
                  listed regions
                </option>
              )}
            </select>
          </label>
        )}
        <Parts
          doc={doc}
          say={say}
          path={[obstacle.list, obstacle.index]}
          keys={doc.palette.keys[ordered ? "order" : "obstacle"]}
          add="Add a key of the obstacle ..."
        />
        <Own doc={doc} say={say} of="obstacles" name={obstacle.type} />
      </section>
    );
  }
  if (chosen && "region" in chosen) {
    const name = Object.entries(drawing.names).find(([, region]) => region === chosen.region)?.[0] ?? "";
    return (
      <section class="panel chosen" aria-label="The chosen region">
        <h2>
          Region <span class="quiet">{label(drawing.run, chosen.region)}</span>
        </h2>
        {Object.entries(drawing.areas)
          .filter(([, regions]) => regions.includes(chosen.region))
          .map(([area]) => (
            <p key={area}>
              in{" "}
              <button type="button" onClick={() => choose({ area })}>
                {area}
              </button>
            </p>
          ))}
        <Field
          key={chosen.region}
          name="name"
          value={name}
          focused={chosen.naming}
          onChange={(value) => edit("name_region", { region: chosen.region, name: value })}
        />
      </section>
    );
  }
  if (chosen && "area" in chosen) {
    const { area } = chosen;
    if (!(area in drawing.areas)) return null;
    return (
      <section class="panel chosen" aria-label="The chosen area">
        <h2>
          <span>
            Area <span class="quiet">{drawing.areas[area]!.length} regions</span>
          </span>
          <button type="button" onClick={() => edit("remove_area", { area })}>
            Remove
          </button>
        </h2>
        <Field
          key={area}
          name="name"
          value={area}
          focused={chosen.naming}
          onChange={(name) => {
            edit("rename_area", { area, name });
            choose({ area: name });
          }}
        />
        <button type="button" onClick={() => setPen({ ...NEW_AREA, area })}>
          Add a part
        </button>
        <p class="quiet">As a target, any of its regions counts.</p>
      </section>
    );
  }
  return null;
}

/** The robot model or obstacle type: its keys where the scenario has its own, else a way to make it so. */
function Own({ doc, say, of, name }: { doc: Doc; say: Say; of: "robots" | "obstacles"; name: string }) {
  const own = `catalogue/${of}/${name}` in (doc.drawing?.parts ?? {});
  const [kind, words] = of === "robots" ? (["model", "Model"] as const) : (["type", "Type"] as const);
  return (
    <>
      <h3>
        {words} {name}
      </h3>
      {own ? (
        <Parts doc={doc} say={say} path={["catalogue", of, name]} keys={doc.palette.keys[kind]} add={`Add a key of the ${kind} ...`} />
      ) : (
        <button
          type="button"
          title={`Copy ${name} into the scenario's catalogue, and change it there`}
          onClick={() => say("edit", { op: "own", of, name })}
        >
          {of === "robots" ? "Change its battery, loads, speed ..." : "Change what it needs and blocks ..."}
        </button>
      )}
    </>
  );
}

interface FieldProps {
  name: string;
  value: string;
  number?: boolean;
  /** Whether the reader types here next. */
  focused?: boolean | undefined;
  onChange(value: string): void;
}

/** A field that reports its value when it is left, or with Enter. */
function Field({ name, value, number, focused, onChange }: FieldProps) {
  const [own, setOwn] = useState(value);
  const input = useRef<HTMLInputElement>(null);
  useEffect(() => setOwn(value), [value]);
  useEffect(() => {
    if (focused) input.current!.select();
  }, []);
  const tell = (): void => {
    if (own !== value) onChange(own);
  };
  return (
    <label>
      {name}
      <input
        ref={input}
        inputMode={number ? "numeric" : "text"}
        aria-label={name}
        value={own}
        onInput={(event) => setOwn(event.currentTarget.value)}
        onBlur={tell}
        onKeyDown={(event) => event.key === "Enter" && event.currentTarget.blur()}
      />
    </label>
  );
}

/** Why a robot has no strategy, and repairs. */
export function Judged({ verdict, say }: { verdict: Verdict; say: Say }) {
  if (verdict.verdict === "realizable") return <p class="judged good">Realizable: it can meet this objective{verdict.allows && ` (${verdict.allows})`}.</p>;
  return (
    <div class="judged bad">
      <p>
        <b>{verdict.verdict === "limit" ? "Not checked: " : "Unrealizable: "}</b>
        {verdict.because}
      </p>
      {(verdict.repairs ?? []).slice(0, 5).map((repair) => (
        <button type="button" onClick={() => say("edit", { op: "repair", change: repair.change })}>
          {repair.change.map(([item, value]) => wordsOf(item, value)).join("; ")}
        </button>
      ))}
    </div>
  );
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
              <span>{verdict.verdict === "realizable" ? "realizable" : verdict.because}</span>
            </button>
            {verdict.verdict === "unrealizable" &&
              (verdict.repairs ?? []).slice(0, 3).map((repair) => (
                <button type="button" class="repair" onClick={() => say("edit", { op: "repair", change: repair.change })}>
                  {repair.change.map(([item, value]) => wordsOf(item, value)).join("; ")}
                </button>
              ))}
          </li>
        ))}
      </ul>
    </section>
  );
}
