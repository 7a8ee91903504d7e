/** Buttons, what they open, and short messages, which the toast of the studio shows. */

import type { ComponentChildren, JSX, RefObject } from "preact";
import { useId } from "preact/hooks";
import type { Eye } from "../map/camera";
import { INK } from "../map/shapes";
import type { Player } from "../run/player";
import { type EventKind, EVENTS, eventsAfter, type Robot, type Run, type Status } from "../run/run";

const NAME = "safenav-notice";

export function notice(words: string): void {
  dispatchEvent(new CustomEvent(NAME, { detail: words }));
}

export function onNotice(show: (words: string) => void): () => void {
  return heard(window, { [NAME]: (event: CustomEvent<string>) => show(event.detail) });
}

interface PressProps extends Omit<JSX.IntrinsicElements["button"], "action"> {
  act(): void;
  /** Reason why it is disabled: then it only shows this advice. */
  off?: string | false | undefined;
}

export function Press({ act, off, title, ...rest }: PressProps) {
  const effect = off ? { "aria-disabled": true, title: off, onClick: () => notice(off) } : { title, onClick: act };
  return <button type="button" {...rest} {...effect} />;
}

interface ButtonProps extends Pick<PressProps, "act" | "off"> {
  icon: ButtonIcon;
  label: string;
  primary?: boolean;
}

/** A button with a drawing. */
export function Button({ icon, label, primary, ...does }: ButtonProps) {
  return (
    <Press class={primary ? "primary" : ""} aria-label={label} title={label} {...does}>
      <Icon name={icon} />
    </Press>
  );
}

interface PopupProps {
  name: string;
  /** A class, for its place and form. */
  kind: string;
  children: ComponentChildren;
  /** Beside the name. */
  mark?: ComponentChildren;
  opened?(): void;
}

/** A button, and what it opens over the page; Esc, a press elsewhere, or a choice in it closes it. */
export function Popup({ name, kind, mark, opened, children }: PopupProps) {
  const id = useId();
  const chosen = (event: MouseEvent): void => {
    if ((event.target as HTMLElement).closest("button, a")) (event.currentTarget as HTMLElement).hidePopover();
  };
  return (
    <>
      <button type="button" popovertarget={id} data-opens={name}>
        {name}
        {mark}
      </button>
      <div id={id} popover="auto" class={`card popup ${kind}`} data-popup={name} onClick={chosen} onToggle={(event) => event.newState === "open" && opened?.()}>
        {children}
      </div>
    </>
  );
}

export function RobotSign({ robot, size = 26 }: { robot: Robot; size?: number }) {
  const { look } = robot;
  return (
    <svg class="sign" width={size} height={size} viewBox="-1.35 -1.35 2.7 2.7" aria-hidden="true">
      <path d={look.path} fill={look.colour} {...INK.body} />
      <text {...INK.letters} y={look.drop} font-size={look.size} fill={look.ink}>
        {look.letters}
      </text>
    </svg>
  );
}

export function StatusSign({ run, status, size = 18 }: { run: Run; status: Exclude<Status, "absent">; size?: number }) {
  return <Mark size={size} colour={status} path={run.marks.status[status].path} />;
}

export function EventSign({ run, kind, size = 16 }: { run: Run; kind: EventKind; size?: number }) {
  return <Mark size={size} colour={EVENTS[kind][1]} path={run.marks.event[kind]} />;
}

function Mark({ size, colour, path }: { size: number; colour: string; path: string }) {
  return (
    <svg class="sign" width={size} height={size} viewBox="-1.1 -1.1 2.2 2.2" aria-hidden="true">
      <path fill={`var(--${colour})`} d={path} fill-rule="evenodd" />
    </svg>
  );
}

const BUTTONS = {
  play: "M7 4.5v15l12-7.5z",
  pause: "M6 5h4v14H6zM14 5h4v14h-4z",
  back: "M16 5v14L6 12z",
  on: "M8 5v14l10-7z",
  first: "M5 5h2.5v14H5zM19 5v14L9 12z",
  last: "M16.5 5H19v14h-2.5zM5 5v14l10-7z",
  minus: "M5 11h14v2.4H5z",
  plus: "M5 11h5.8V5h2.4v6H19v2.4h-5.8v6h-2.4v-6H5z",
  fit: "M4 9V4h5v2H6v3zM15 4h5v5h-2V6h-3zM4 15h2v3h3v2H4zM18 15h2v5h-5v-2h3z",
};

export type ButtonIcon = keyof typeof BUTTONS;

export function Icon({ name }: { name: ButtonIcon }) {
  return (
    <svg class="icon" width="20" height="20" viewBox="0 0 24 24" aria-hidden="true">
      <path d={BUTTONS[name]} fill="currentColor" />
    </svg>
  );
}

export type Keys = [keys: string, meaning: string][];

interface HeaderProps {
  help: RefObject<HTMLDialogElement | null>;
  name: string;
  state: ComponentChildren;
  keys: Keys;
  /** In the help, below the keys. */
  about: ComponentChildren;
  children: ComponentChildren;
}

export function Header({ help, name, state, keys, about, children }: HeaderProps) {
  return (
    <>
      <header class="row wrap">
        <div class="row wrap">
          <h1>{name}</h1>
          {state}
        </div>
        <div class="group row">
          {children}
          <Press title="Help" aria-label="Help" act={() => help.current!.showModal()}>?</Press>
        </div>
      </header>
      <dialog class="card" ref={help} aria-labelledby="help-title" onClick={(event) => event.target === event.currentTarget && help.current!.close()}>
          <h2 id="help-title">Keys</h2>
          <dl>
            {keys.map(([names, meaning]) => (
              <div key={names}>
                <dt>
                  {names.split(" ").map((key) => (
                    <span key={key}>
                      <kbd>{key}</kbd>{" "}
                    </span>
                  ))}
                </dt>
                <dd>{meaning}</dd>
              </div>
            ))}
          </dl>
          {about}
          <form method="dialog">
            <button>Close</button>
          </form>
      </dialog>
    </>
  );
}

/** The keys of a page that replaces some of the usual ones. */
export function withKeys(keys: Keys, own: Keys): Keys {
  return [...new Map([...keys, ...own])];
}

/** Listen to events of an element or the window; the result stops that. */
export function heard<E extends Event>(
  target: EventTarget,
  listeners: Record<string, (event: E) => void>,
  options: AddEventListenerOptions = {},
): () => void {
  const end = new AbortController();
  for (const [name, listener] of Object.entries(listeners)) {
    target.addEventListener(name, listener as (event: Event) => void, { ...options, signal: end.signal });
  }
  return () => end.abort();
}

/** Call back with each new size of an element; the result stops that. */
export function resized(element: Element, listener: () => void): () => void {
  const observer = new ResizeObserver(listener);
  observer.observe(element);
  return () => observer.disconnect();
}

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

/** Actions of the keys of a run, besides help. */
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
