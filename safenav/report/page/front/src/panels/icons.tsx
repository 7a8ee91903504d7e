/** Small drawings: the signs of robots, obstacles and events, and those on buttons. */

import { INK } from "../map/ink";
import { EVENTS, type EventKind, type Robot, type Run, type Status } from "../run/run";

export function RobotSign({ robot, size = 26 }: { robot: Robot; size?: number }) {
  const { look } = robot;
  return (
    <svg class="sign" width={size} height={size} viewBox="-1.35 -1.35 2.7 2.7" aria-hidden="true">
      <path d={look.path} fill={look.colour} {...INK.body} />
      <text class="letters" y={look.drop} font-size={look.size} fill={look.ink}>
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
  auto: "M12 3a9 9 0 1 0 0 18zM12 3a9 9 0 1 1 0 18v-2a7 7 0 0 0 0-14z",
  light:
    "M12 7.5a4.5 4.5 0 1 1 0 9 4.5 4.5 0 0 1 0-9zM11 1.5h2v3.5h-2zM11 19h2v3.5h-2zM1.5 11H5v2H1.5zM19 11h3.5v2H19zM4 5.4 5.4 4l2.5 2.5-1.4 1.4zM16.1 17.5l1.4-1.4L20 18.6 18.6 20zM4 18.6l2.5-2.5 1.4 1.4L5.4 20zM16.1 6.5 18.6 4 20 5.4l-2.5 2.5z",
  dark: "M13 3a9 9 0 1 0 8 12.5A8 8 0 0 1 13 3z",
};

export type ButtonIcon = keyof typeof BUTTONS;

export function Icon({ name }: { name: ButtonIcon }) {
  return (
    <svg class="icon" width="20" height="20" viewBox="0 0 24 24" aria-hidden="true">
      <path d={BUTTONS[name]} fill="currentColor" />
    </svg>
  );
}
