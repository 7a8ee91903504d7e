/** Keys of the page; a focused control's own keys come first. */

import { heard } from "./listening";
import type { Eye } from "./map/camera";
import type { Player } from "./run/player";
import { eventsAfter, type Run } from "./run/run";

const PAN = 80;

export const KEYS: [keys: string, meaning: string][] = [
  ["Space", "play or pause"],
  ["← →", "previous or next tick"],
  ["Shift ← →", "previous or next event"],
  ["Home End", "first or last tick"],
  ["+ −", "faster or slower"],
  ["I O", "zoom in or out; also the wheel and two fingers"],
  ["W A S D", "move the map; dragging it does the same"],
  ["F", "the whole map"],
  ["R", "follow the next robot"],
  ["T", "theme: automatic, light, dark"],
  ["?", "this help"],
];

export interface Actions {
  eye: Eye;
  help(): void;
  theme(): void;
}

export function listen(run: Run, player: Player, actions: Actions): () => void {
  const known = actionsOf(run, player, actions);
  const pressed = (event: KeyboardEvent): void => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (document.querySelector("dialog[open]")) return;
    const focus = event.target instanceof HTMLElement ? event.target : null;
    if (focus?.matches("select, input:not([type=range])")) return;
    const activates = event.key === " " && focus?.matches("button, summary, a");
    if (activates) return;
    const action = known[event.key];
    if (action === undefined) return;
    event.preventDefault();
    action(event.shiftKey);
  };
  return heard(window, { keydown: pressed });
}

function actionsOf(run: Run, player: Player, { eye, help, theme }: Actions): Record<string, (shift: boolean) => void> {
  const along = (way: 1 | -1) => (shift: boolean) => (shift ? toEvent(run, player, way) : player.step(way));
  const [faster, slower] = [() => player.faster(1), () => player.faster(-1)];
  return {
    " ": () => player.toggle(),
    ArrowLeft: along(-1),
    ArrowRight: along(1),
    Home: () => player.seek(0),
    End: () => player.seek(player.last),
    ...{ "+": faster, "=": faster, "-": slower, "−": slower },
    ...{ t: theme, T: theme, "?": help },
    i: () => eye.zoom(1.5),
    o: () => eye.zoom(1 / 1.5),
    f: () => eye.fit(),
    w: () => eye.pan(0, PAN),
    s: () => eye.pan(0, -PAN),
    a: () => eye.pan(PAN, 0),
    d: () => eye.pan(-PAN, 0),
    r: () => followNext(run, eye),
  };
}

/** One robot after the other, then the whole map again. */
function followNext(run: Run, eye: Eye): void {
  const next = (eye.followed ?? -1) + 1;
  eye.follow(next < run.robots.length ? next : null);
}

/** To the nearest tick before or after this one in which something other than a goal happened. */
export function toEvent(run: Run, player: Player, direction: 1 | -1): void {
  const events = run.events;
  let i = direction > 0 ? eventsAfter(events, player.tick) : eventsAfter(events, player.tick - 1) - 1;
  while (i >= 0 && i < events.length && events[i]![1] === "goal") i += direction;
  const found = events[i];
  player.pause();
  player.seek(found ? found[0] : direction > 0 ? player.last : 0);
}
