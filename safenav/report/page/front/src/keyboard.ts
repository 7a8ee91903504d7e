/** Keys of the page; a focused control's own keys come first. */

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
  const pressed = (event: KeyboardEvent): void => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (document.querySelector("dialog[open]")) return;
    const focus = event.target instanceof HTMLElement ? event.target : null;
    if (focus?.matches("select, input:not([type=range])")) return;
    const activates = event.key === " " && focus?.matches("button, summary, a");
    if (activates) return;
    const action = actionOf(event, run, player, actions);
    if (action === null) return;
    event.preventDefault();
    action();
  };
  addEventListener("keydown", pressed);
  return () => removeEventListener("keydown", pressed);
}

function actionOf(
  event: KeyboardEvent,
  run: Run,
  player: Player,
  actions: Actions,
): (() => void) | null {
  switch (event.key) {
    case " ":
      return () => player.toggle();
    case "ArrowLeft":
      return event.shiftKey ? () => toEvent(run, player, -1) : () => player.step(-1);
    case "ArrowRight":
      return event.shiftKey ? () => toEvent(run, player, 1) : () => player.step(1);
    case "Home":
      return () => player.seek(0);
    case "End":
      return () => player.seek(player.last);
    case "+":
    case "=":
      return () => player.faster(1);
    case "-":
    case "−":
      return () => player.faster(-1);
    case "t":
    case "T":
      return actions.theme;
    case "?":
      return actions.help;
    case "i":
      return () => actions.eye.zoom(1.5);
    case "o":
      return () => actions.eye.zoom(1 / 1.5);
    case "f":
      return () => actions.eye.fit();
    case "w":
      return () => actions.eye.pan(0, PAN);
    case "s":
      return () => actions.eye.pan(0, -PAN);
    case "a":
      return () => actions.eye.pan(PAN, 0);
    case "d":
      return () => actions.eye.pan(-PAN, 0);
    case "r":
      return () => followNext(run, actions.eye);
    default:
      return null;
  }
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
