/** The selected robot, obstacle or area of the drawing board, and its fields. */

import type { Say } from "../live/player";
import { unless } from "../panels/notice";
import { label } from "../run/run";
import { Field } from "./field";
import { idOf, resolving, type Doc, type Verdict } from "./model";
import { choose as chooseTarget } from "./objective";
import { Parts } from "./parts";
import { NEW_AREA, type Drawn } from "./tools";
import { VerdictDetails } from "./verdicts";

export function Selection({ doc, drawing, pen, setPen, chosen, choose, say, verdict }: Drawn & { verdict: Verdict | null }) {
  const edit = (op: string, data: object): void => say("edit", { op, ...data });
  if (chosen && "robot" in chosen) {
    const robot = drawing.robots.find((r) => r.name === chosen.robot);
    if (!robot) return null;
    const drawn = drawing.run.robots.find((each) => each.name === robot.name);
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
          {drawn?.tasks[0]![1] ?? "no objective"}
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
        <div class="verdict-room">{verdict && <VerdictDetails verdict={verdict} say={say} />}</div>
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
        <p class="quiet">{kind ? `${resolving(kind)} resolves it` : "unknown type"}</p>
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

/** The robot model or obstacle type: its keys in the scenario's catalogue, or a button that copies it there. */
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
