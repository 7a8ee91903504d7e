/** The drawing board: map and text of a scenario, side by side. */

import { listenToKeys } from "../keyboard";
import type { ComponentChildren } from "preact";
import { useLayoutEffect, useMemo, useState } from "preact/hooks";
import { Header, useShell, type Keys } from "../panels/header";
import { Press } from "../panels/button";
import type { Say } from "../live/player";
import { MapView } from "../map/map";
import { Camera } from "../map/camera";
import { Zoom } from "../map/stage";
import { Player } from "../run/player";
import { ALL } from "../settings";
import { useDrawingHand } from "./hand";
import type { Chosen, Doc, Drawing, Pen, Verdict } from "./model";
import { Selection } from "./selection";
import { Text, type Writing } from "./text";
import { Tools, type Drawn } from "./tools";
import { Problems } from "./verdicts";

interface DrawProps {
  doc: Doc;
  writing: Writing;
  verdicts: Record<string, Verdict>;
  say: Say;
  save(): void;
  menus: ComponentChildren;
  run(): void;
}

const SHOWN = { ...ALL, trails: false, sight: false, beliefs: false };

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
  const shell = useShell();
  useLayoutEffect(() => {
    const chosenItem = chosen && ("robot" in chosen ? { op: "remove_robot", robot: chosen.robot } : { op: "remove_obstacle", index: chosen.obstacle });
    const remove = (): void => {
      if (chosenItem) say("edit", chosenItem);
      choose(null);
    };
    const select = (): void => setPen({ does: "select" });
    return listenToKeys({
      ...{ "Ctrl+s": save, "Ctrl+z": (shift) => void (shift ? writing.redo() : writing.undo()), "Ctrl+y": () => void writing.redo() },
      ...{ v: select, Escape: select, Delete: remove, Backspace: remove, "?": shell.help },
      ...(drawing?.grid && { 1: () => setPen({ does: "wall" }), 2: () => setPen({ does: "floor" }) }),
    });
  }, [say, save, chosen, drawing, writing]);
  const robot = chosen && "robot" in chosen ? chosen.robot : null;
  const verdict = (robot !== null && verdicts[robot]) || null;
  const shared = { doc, pen, setPen, chosen, choose, say };
  const first = problems[0];
  return (
    <>
      <Header
        shell={shell}
        name={drawing?.name ?? doc.file ?? "scenario"}
        state={<span class="quiet">{doc.file ?? "not saved yet"}</span>}
        keys={KEYS}
        about={<p>Drag a robot's handle to turn it, and its targets to move them. The text and the map change together.</p>}
      >
        {menus}
        <Press aria-label="Undo" off={!writing.undoable && "nothing to undo yet"} title="Undo (Ctrl Z)" act={writing.undo}>
          ↶
        </Press>
        <Press aria-label="Redo" off={!writing.redoable && "nothing to redo: undo a change first"} title="Redo (Ctrl Y)" act={writing.redo}>
          ↷
        </Press>
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
            <Stage {...shared} drawing={drawing} verdict={verdict} />
          </>
        ) : (
          <section class="stage" aria-label="Drawing">
            <h2 class="no-map">This map cannot be drawn yet</h2>
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
            say={say}
          />
        </aside>
      </main>
    </>
  );
}

interface StageProps extends Drawn {
  verdict: Verdict | null;
}

function Stage({ doc, drawing, pen, setPen, chosen, choose, say, verdict }: StageProps) {
  const { rows, cols } = drawing.run;
  const camera = useMemo(() => new Camera({ left: 0, top: 0, right: cols, bottom: rows }), [cols, rows]);
  const player = useMemo(() => new Player(0), []);
  const hand = useDrawingHand({
    drawing,
    pen,
    setPen,
    chosen,
    choose,
    say,
    problems: doc.problems,
    verdict: verdict?.verdict === "unrealizable" ? verdict : null,
  });
  return (
    <section class="stage" aria-label="Drawing">
      <MapView key={`${cols}x${rows}`} run={drawing.run} player={player} camera={camera} tick={0} shown={SHOWN} pointed={null} hand={hand} />
      <div class="tool-line row" aria-live="polite">
        <p class="hint quiet">{hintOf(pen, drawing)}</p>
        <Press class={pen.does === "select" ? "unused" : ""} title="Back to Select (Esc)" act={() => setPen({ does: "select" })}>
          Done
        </Press>
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
