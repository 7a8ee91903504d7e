/** The selected robot or obstacle of the drawing board. */

import { Press } from "../panels/button";
import { label } from "../run/run";
import { chooseTarget, resolving } from "./model";
import type { Drawn } from "./tools";

export function Selection({ doc, drawing, pen, setPen, chosen, choose, say }: Drawn) {
  const remove = (op: string, data: object) => (
    <Press
      act={() => {
        say("edit", { op, ...data });
        choose(null);
      }}
    >
      Remove
    </Press>
  );
  if (chosen && "robot" in chosen) {
    const robot = drawing.robots.find((r) => r.name === chosen.robot);
    if (!robot) return null;
    const drawn = drawing.run.robots.find((each) => each.name === robot.name);
    const drawingObjective = pen.does === "objective" && pen.robot === robot.name;
    return (
      <section key={`robot ${robot.name}`} class="panel chosen" aria-label="The chosen robot">
        <h2>
          <span>
            {robot.name} <span class="quiet">{robot.model}</span>
          </span>
          {remove("remove_robot", { robot: robot.name })}
        </h2>
        <p class="pursued">
          {drawn?.tasks[0]![1] ?? "no objective"}
        </p>
        <div class="pens">
          {doc.palette.objectives.map((kind) => (
            <Press
              key={kind.kind}
              title={kind.meaning}
              aria-pressed={drawingObjective && pen.kind.kind === kind.kind}
              act={() => setPen({ does: "objective", robot: robot.name, kind, targets: [] })}
            >
              {kind.label}
            </Press>
          ))}
        </div>
        {Object.keys(drawing.areas).length > 0 && (
          <div class="pens areas" role="group" aria-label="Areas as targets">
            {Object.keys(drawing.areas).map((area) => (
              <Press
                key={area}
                off={!drawingObjective && "choose a kind of objective first: then this area can be a target"}
                act={() => drawingObjective && chooseTarget(pen, area, setPen, say)}
              >
                {area}
              </Press>
            ))}
          </div>
        )}
      </section>
    );
  }
  if (chosen && "obstacle" in chosen) {
    const obstacle = drawing.obstacles.find(({ index }) => index === chosen.obstacle);
    if (!obstacle) return null;
    const kind = doc.palette.obstacles.find((type) => type.name === obstacle.type);
    return (
      <section key={chosen.obstacle} class="panel chosen" aria-label="The chosen obstacle">
        <h2>
          <span>
            Hidden {obstacle.type} <span class="quiet">{label(drawing.run, obstacle.region)}</span>
          </span>
          {remove("remove_obstacle", { index: obstacle.index })}
        </h2>
        <p class="quiet">{kind ? `${resolving(kind)} resolves it` : "unknown type"}</p>
      </section>
    );
  }
  return null;
}
