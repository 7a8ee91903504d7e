/** The tools of the drawing board, and the size and settings of the map. */

import type { Say } from "../live/player";
import { Field } from "./field";
import { isOrder, resolving, type Chosen, type Doc, type Drawing, type Pen } from "./model";
import { Parts } from "./parts";

export interface Drawn {
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
      .filter((type) => (blocks ? type.blocks : isOrder(type, drawing.run.robots)))
      .map((type) =>
        tool(
          `obstacle ${type.name}`,
          (pen.does === "obstacle" || pen.does === "order") && pen.type === type.name,
          type.name,
          { does: blocks ? "obstacle" : "order", type: type.name },
          `${blocks ? "unknown to the robots" : "an order of the scenario"}; ${resolving(type)} resolves it`,
          type.shape,
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
