/** Keys of the pages. */

import { heard } from "./listening";
import type { Eye } from "./map/camera";
import type { Keys } from "./panels/header";
import type { Player } from "./run/player";
import { eventsAfter, type Run } from "./run/run";

const PAN = 80;

export const KEYS: Keys = [
  ["Space", "play or pause"],
  ["← →", "previous or next tick"],
  ["Shift ← →", "previous or next event"],
  ["Home End", "first or last tick"],
  ["+ −", "faster or slower"],
  ["I O", "zoom in or out; also the wheel"],
  ["W A S D", "move the map; dragging it does the same"],
  ["F", "the whole map"],
  ["R", "follow the next robot"],
  ["T", "theme: automatic, light, dark"],
  ["?", "this help"],
];

type Actions = Record<string, (shift: boolean) => void>;

/** Call the action of a pressed key, `Ctrl+s` also while text is written; a focused control's own keys come first. */
export function listenToKeys(actions: Actions): () => void {
  const pressed = (event: KeyboardEvent): void => {
    if (event.altKey || document.querySelector("dialog[open]")) return;
    const name = event.ctrlKey || event.metaKey ? `Ctrl+${event.key.toLowerCase()}` : event.key;
    const focus = event.target instanceof HTMLElement ? event.target : null;
    const writes = focus?.isContentEditable || focus?.matches("select, input:not([type=range])");
    const activates = name === " " && focus?.matches("button, summary, a");
    const action = actions[name];
    if (action === undefined || activates || (writes && name !== "Ctrl+s")) return;
    event.preventDefault();
    action(event.shiftKey);
  };
  return heard(window, { keydown: pressed });
}

/** What the keys of a run do, besides theme and help. */
export function actionsOf(run: Run, player: Player, eye: Eye): Actions {
  const along = (way: 1 | -1) => (shift: boolean) => (shift ? toEvent(run, player, way) : player.step(way));
  const [faster, slower] = [() => player.faster(1), () => player.faster(-1)];
  return {
    " ": () => player.toggle(),
    ArrowLeft: along(-1),
    ArrowRight: along(1),
    Home: () => player.seek(0),
    End: () => player.seek(player.last),
    ...{ "+": faster, "=": faster, "-": slower, "−": slower },
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
function toEvent({ events }: Run, player: Player, direction: 1 | -1): void {
  let i = direction > 0 ? eventsAfter(events, player.tick) : eventsAfter(events, player.tick - 1) - 1;
  while (i >= 0 && i < events.length && events[i]![1] === "goal") i += direction;
  const found = events[i];
  player.pause();
  player.seek(found ? found[0] : direction > 0 ? player.last : 0);
}
