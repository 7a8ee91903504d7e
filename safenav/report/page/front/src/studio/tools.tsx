/** The tools of the drawing board. */

import type { Say } from "../live/player";
import { resolving, type Chosen, type Doc, type Drawing, type Pen } from "./model";

export interface Drawn {
  doc: Doc;
  drawing: Drawing;
  pen: Pen;
  setPen(pen: Pen): void;
  chosen: Chosen;
  choose(chosen: Chosen): void;
  say: Say;
}

export function Tools({ doc, drawing, pen, setPen }: Drawn) {
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
  return (
    <div class="tools-of-map">
      <section class="panel" aria-label="Tools">
        <h2>
          Draw{" "}
          <span class="quiet">
            {drawing.run.rows} x {drawing.run.cols}
          </span>
        </h2>
        <div class="pens">
          {tool("select", pen.does === "select", "Select", { does: "select" }, "Select and drag items (V)")}
          {drawing.grid && tool("wall", pen.does === "wall", "Wall", { does: "wall" }, "Paint walls (1)")}
          {drawing.grid && tool("floor", pen.does === "floor", "Floor", { does: "floor" }, "Paint floor (2)")}
        </div>
        {!drawing.grid && <p class="quiet">The walls come from a file.</p>}
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
        <div class="pens">
          {doc.palette.obstacles
            .filter((type) => type.blocks)
            .map((type) =>
              tool(
                `obstacle ${type.name}`,
                pen.does === "obstacle" && pen.type === type.name,
                type.name,
                { does: "obstacle", type: type.name },
                `unknown to the robots; ${resolving(type)} resolves it`,
                type.shape,
              ),
            )}
        </div>
      </section>
    </div>
  );
}
