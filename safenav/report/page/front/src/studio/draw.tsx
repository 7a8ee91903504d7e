/** The drawing board: map and text of a scenario, side by side. */

import type { ComponentChildren } from "preact";
import { useLayoutEffect, useMemo, useRef, useState } from "preact/hooks";
import type { Say } from "../live/player";
import { Camera } from "../map/camera";
import { MapView, Zoom } from "../map/map";
import { Header, type Keys, listenToKeys, Press } from "../panels/shell";
import { Player } from "../run/player";
import { label } from "../run/run";
import { useDrawingHand } from "./hand";
import { type Chosen, type Doc, type Drawing, type DrawnRobot, type Pen, type Problem, resolving, type Verdict } from "./model";
import { Text, type Writing } from "./text";

interface DrawProps {
  doc: Doc;
  writing: Writing;
  verdicts: Record<string, Verdict>;
  say: Say;
  save(): void;
  menus: ComponentChildren;
  run(): void;
}

const KEYS: Keys = [
  ["V", "select and drag"],
  ["1 2", "paint walls, or floor"],
  ["Esc", "close a menu; deselect the tool"],
  ["Delete", "remove what is selected"],
  ["Tab", "focus the map, then the next control"],
  ["Ctrl+Space", "in the text: the keys and values that fit here; also Alt+Space"],
  ["Ctrl+]", "in the text: indent; Ctrl+[ the reverse"],
  ["↑ ↓ ← →", "on the map: move the cursor; with Shift: drag an item, or paint"],
  ["Enter", "on the map: click at the cursor"],
  ["Ctrl+S", "save"],
  ["Ctrl+Z", "undo"],
  ["Ctrl+Y", "redo"],
  ["?", "this help"],
];

export function Draw({ doc, writing, verdicts, say, save, menus, run }: DrawProps) {
  const { drawing, problems } = doc;
  const [pen, setPen] = useState<Pen>({ does: "select" });
  const [chosen, choose] = useState<Chosen>(null);
  const help = useRef<HTMLDialogElement>(null);
  useLayoutEffect(() => {
    const remove = (): void => {
      if (typeof chosen === "string") say("edit", { op: "remove_robot", robot: chosen });
      else if (chosen !== null) say("edit", { op: "remove_obstacle", index: chosen });
      choose(null);
    };
    const select = (): void => setPen({ does: "select" });
    return listenToKeys({
      ...{ "Ctrl+s": save, "Ctrl+z": (shift) => void (shift ? writing.redo() : writing.undo()), "Ctrl+y": () => void writing.redo() },
      ...{ v: select, Escape: select, Delete: remove, Backspace: remove, "?": () => help.current!.showModal() },
      ...(drawing?.grid && { 1: () => setPen({ does: "wall" }), 2: () => setPen({ does: "floor" }) }),
    });
  }, [say, save, chosen, drawing, writing]);
  const shared = { doc, pen, setPen, chosen, choose, say };
  const first = problems[0];
  return (
    <>
      <Header
        help={help}
        name={drawing?.run.name ?? doc.file ?? "scenario"}
        state={<span class="quiet">{doc.file ?? "not saved yet"}</span>}
        keys={KEYS}
        about={<p>Drag robots, obstacles and targets to move them. The text and the map change together.</p>}
      >
        {menus}
        <Press aria-label="Undo" off={!writing.undoable && "nothing to undo yet"} title="Undo (Ctrl Z)" act={writing.undo}>↶</Press>
        <Press aria-label="Redo" off={!writing.redoable && "nothing to redo: undo a change first"} title="Redo (Ctrl Y)" act={writing.redo}>↷</Press>
        <Press
          class="primary run"
          off={first && `Fix the scenario first${first.line ? `, line ${first.line}` : ""}: ${first.found}`}
          title="Run it"
          act={run}
        >
          ▶ Run
        </Press>
      </Header>
      <main class="board">
        {drawing ? (
          <>
            <aside class="palette" aria-label="Palette">
              <Tools {...shared} drawing={drawing} />
              <Selection {...shared} drawing={drawing} />
            </aside>
            <Stage {...shared} drawing={drawing} />
          </>
        ) : (
          <section class="stage" aria-label="Drawing">
            <h2>This map cannot be drawn yet</h2>
          </section>
        )}
        <aside class="writing" aria-label="Text">
          <Text writing={writing} text={doc.text} problems={problems} />
          <Problems
            problems={problems}
            verdicts={verdicts}
            robots={drawing?.robots ?? []}
            go={(line) => writing.go(line)}
            choose={choose}
          />
        </aside>
      </main>
    </>
  );
}

function Stage({ drawing, pen, setPen, chosen, choose, say }: Omit<Drawn, "doc">) {
  const { rows, cols } = drawing.run;
  const camera = useMemo(() => new Camera({ left: 0, top: 0, right: cols, bottom: rows }), [cols, rows]);
  const player = useMemo(() => new Player(0), []);
  const hand = useDrawingHand({ drawing, pen, setPen, chosen, choose, say });
  return (
    <section class="stage" aria-label="Drawing">
      <MapView key={`${cols}x${rows}`} run={drawing.run} player={player} camera={camera} tick={0} hand={hand} />
      <div class="tool-line row wrap" aria-live="polite">
        <p class="hint quiet">{hintOf(pen, drawing)}</p>
        {pen.does !== "select" && (
          <Press title="Back to Select (Esc)" act={() => setPen({ does: "select" })}>Done</Press>
        )}
        <Zoom camera={camera} />
      </div>
    </section>
  );
}

function hintOf(pen: Pen, drawing: Drawing): string {
  switch (pen.does) {
    case "wall":
      return "Drag over the map to paint walls.";
    case "floor":
      return "Drag over the map to paint floor.";
    case "robot":
      return `Click where a ${pen.model} starts; click a robot to select it.`;
    case "obstacle":
      return `Click a free region: a hidden ${pen.type} closes it.`;
    case "objective": {
      const { robot, kind, targets } = pen;
      const some = `click them${targets.length > 0 ? `, ${targets.length} so far` : ""}`;
      const next = kind.most === 1 ? "click it" : kind.most === 2 ? `click the ${targets.length === 0 ? "first" : "second"}` : some;
      return `${robot} ${kind.drawing}: ${next}.`;
    }
    default:
      return drawing.robots.length === 0
        ? "Choose a robot in the palette and click where it starts."
        : "Click a robot to give it an objective; drag robots, obstacles and targets.";
  }
}

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
  const tool = (key: string, pressed: boolean, words: string, next: Pen, hint: string) => (
    <button type="button" key={key} class={`pen ${key.split(" ")[0]}`} aria-pressed={pressed} title={hint} onClick={() => setPen(next)}>
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
        <h2>Robots</h2>
        <div class="pens">
          {doc.palette.robots.map(({ name, turns, layer, can }) =>
            tool(
              `robot ${name}`,
              pen.does === "robot" && pen.model === name,
              name,
              { does: "robot", model: name, turns },
              `${layer}; can ${can.join(", ") || "nothing special"}${turns ? "; has a heading" : ""}`,
            ),
          )}
        </div>
        <h2>Hidden obstacles</h2>
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
              ),
            )}
        </div>
      </section>
    </div>
  );
}

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
  const robot = drawing.robots.find(({ name }) => name === chosen);
  if (robot) {
    const drawn = drawing.run.robots.find((each) => each.name === robot.name);
    const drawingObjective = pen.does === "objective" && pen.robot === robot.name;
    return (
      <section key={`robot ${robot.name}`} class="panel chosen" aria-label="The chosen robot">
        <h2 class="row">
          <span>
            {robot.name} <span class="quiet">{robot.model}</span>
          </span>
          {remove("remove_robot", { robot: robot.name })}
        </h2>
        <p>{drawn?.tasks[0]![1] ?? "no objective"}</p>
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
      </section>
    );
  }
  const obstacle = drawing.obstacles.find(({ index }) => index === chosen);
  if (obstacle) {
    const kind = doc.palette.obstacles.find((type) => type.name === obstacle.type);
    return (
      <section key={obstacle.index} class="panel chosen" aria-label="The chosen obstacle">
        <h2 class="row">
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

interface ProblemsProps {
  problems: Problem[];
  verdicts: Record<string, Verdict>;
  robots: DrawnRobot[];
  go(line: number): void;
  choose(chosen: Chosen): void;
}

export function Problems({ problems, verdicts, robots, go, choose }: ProblemsProps) {
  const judged = robots.map((robot) => verdicts[robot.name]).filter((v): v is Verdict => v !== undefined);
  return (
    <section class="panel problems" aria-labelledby="problems-title">
      <h2 id="problems-title">
        {problems.length === 0 ? "No problems" : "Problems"} {problems.length > 0 && <span class="quiet">{problems.length}</span>}
      </h2>
      <ul>
        {problems.map((problem) => (
          <li class="problem">
            <button type="button" class="event" onClick={() => go(problem.line)}>
              <span class="tick">{problem.line || ""}</span>
              <span>
                {problem.found}
                {problem.hint && <div class="quiet">{problem.hint}</div>}
              </span>
            </button>
          </li>
        ))}
        {judged.map((verdict) => (
          <li class={`verdict ${verdict.verdict}`} data-robot={verdict.robot} data-verdict={verdict.verdict}>
            <button type="button" class="event" onClick={() => choose(verdict.robot)}>
              <span style={{ color: `var(--${verdict.verdict === "realizable" ? "resolved" : "found"})` }}>●</span>
              <b>{verdict.robot}</b>
              <span>{verdict.verdict === "realizable" ? `realizable${verdict.allows ? ` (${verdict.allows})` : ""}` : verdict.because}</span>
            </button>
          </li>
        ))}
      </ul>
    </section>
  );
}
