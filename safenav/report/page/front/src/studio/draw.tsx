/** The drawing board: map and text of a scenario, side by side. */

import type { ComponentChildren } from "preact";
import { useLayoutEffect, useMemo, useState } from "preact/hooks";
import { Button } from "../panels/controls";
import type { Say } from "../live/player";
import { MapView } from "../map/map";
import { Camera } from "../map/camera";
import { Player } from "../run/player";
import { applyTheme, nextTheme, storedTheme } from "../settings";
import { useDrawingHand } from "./hand";
import type { Chosen, Doc, Drawing, Pen, Verdict } from "./model";
import { Problems, Selection, Tools } from "./panels";
import { Text } from "./text";

interface DrawProps {
  doc: Doc & { drawing: Drawing };
  verdicts: Record<string, Verdict>;
  say: Say;
  menus: ComponentChildren;
  run(): void;
}

const SHOWN = { numbers: true, names: true, trails: false, targets: true, hidden: true, sight: false, beliefs: false, viewer: -1 };

export function Draw({ doc, verdicts, say, menus, run }: DrawProps) {
  const { drawing, problems } = doc;
  const { rows, cols } = drawing.run;
  const [pen, setPen] = useState<Pen>({ does: "select" });
  const [chosen, choose] = useState<Chosen>(null);
  const [line, go] = useState<{ number: number } | null>(null);
  const [theme, setTheme] = useState(storedTheme);
  useLayoutEffect(() => applyTheme(theme), [theme]);
  const camera = useMemo(() => new Camera(cols, rows), [cols, rows]);
  const player = useMemo(() => new Player(0), []);
  const robot = chosen && "robot" in chosen ? chosen.robot : null;
  const verdict = (robot !== null && verdicts[robot]) || null;
  const hand = useDrawingHand({
    drawing,
    pen,
    setPen,
    chosen,
    choose,
    say,
    problems,
    verdict: verdict?.verdict === "unrealizable" ? verdict : null,
  });
  useLayoutEffect(() => {
    const pressed = (event: KeyboardEvent): void => {
      const control = event.ctrlKey || event.metaKey;
      const typing = event.target instanceof HTMLElement && event.target.matches("input, textarea, select");
      if (control && event.key.toLowerCase() === "s") say("save");
      else if (control && !typing && event.key.toLowerCase() === "z") say(event.shiftKey ? "redo" : "undo");
      else if (control && !typing && event.key.toLowerCase() === "y") say("redo");
      else if (typing || control || event.altKey) return;
      else if (event.key === "v" || event.key === "Escape") setPen({ does: "select" });
      else if (event.key === "1") setPen({ does: "wall" });
      else if (event.key === "2") setPen({ does: "floor" });
      else if (event.key === "3") setPen({ does: "name" });
      else if (event.key === "Delete" || event.key === "Backspace") {
        if (chosen && "robot" in chosen) say("edit", { op: "remove_robot", robot: chosen.robot });
        else if (chosen && "obstacle" in chosen) say("edit", { op: "remove_obstacle", index: chosen.obstacle });
        choose(null);
      } else return;
      event.preventDefault();
    };
    addEventListener("keydown", pressed);
    return () => removeEventListener("keydown", pressed);
  }, [say, chosen]);
  const shared = { doc, drawing, pen, setPen, chosen, choose, say };
  const wrong = problems.length > 0;
  return (
    <>
      <header>
        <div>
          <h1>{drawing.settings.name}</h1>
          {doc.file && <span class="quiet">{doc.file}</span>}
        </div>
        <div class="group">
          {menus}
          <button type="button" aria-label="Undo" title="Undo (Ctrl Z)" disabled={!doc.undoable} onClick={() => say("undo")}>
            ↶
          </button>
          <button type="button" aria-label="Redo" title="Redo (Ctrl Shift Z)" disabled={!doc.redoable} onClick={() => say("redo")}>
            ↷
          </button>
          <button type="button" class="primary run" disabled={wrong} title={wrong ? "Mend the scenario first" : "Run it"} onClick={run}>
            ▶ Run
          </button>
          <Button icon={theme} label={`Theme: ${theme}`} onClick={() => setTheme(nextTheme)} />
        </div>
      </header>
      <main class="board">
        <aside class="palette" aria-label="Palette">
          <Tools {...shared} />
          <Selection {...shared} verdict={verdict} />
        </aside>
        <section class="stage" aria-label="Drawing">
          <MapView
            key={`${cols}x${rows}`}
            run={drawing.run}
            player={player}
            camera={camera}
            tick={0}
            shown={SHOWN}
            pointed={null}
            hand={hand}
          />
          <p class="hint quiet">{hintOf(pen, drawing)}</p>
        </section>
        <aside class="writing" aria-label="Text">
          <Text text={doc.text} revision={doc.revision} problems={problems} say={say} line={line} />
          <Problems
            problems={problems}
            verdicts={verdicts}
            drawing={drawing}
            go={(number) => go({ number })}
            choose={choose}
            say={say}
          />
        </aside>
      </main>
    </>
  );
}

function hintOf(pen: Pen, drawing: Drawing): string {
  switch (pen.does) {
    case "wall":
      return "Drag over the map to paint walls.";
    case "floor":
      return "Drag over the map to paint floor.";
    case "name":
      return "Click a region, then write its name at the left.";
    case "robot":
      return `Click where a ${pen.model} starts; click a robot that is there to say where it goes.`;
    case "obstacle":
      return `Click a free region that a ${pen.type} closes; no robot knows of it.`;
    case "objective":
      return `Click the regions that ${pen.robot} is to reach, in order.`;
    default:
      return drawing.robots.length === 0
        ? "Choose a robot at the left, and click where it starts."
        : "Click a robot to give it an objective; drag robots, obstacles and targets; ▶ runs it.";
  }
}
