/** Play, step, speed, and the timeline with its marks. */

import type { ComponentChildren } from "preact";
import { memo } from "preact/compat";
import { useCallback, useLayoutEffect, useMemo, useRef, useState } from "preact/hooks";
import { INK } from "../map/shapes";
import { Button, EventSign, resized } from "./shell";
import type { Eye } from "../map/camera";
import { type Player, SPEEDS } from "../run/player";
import { EVENTS, moment, type Robot, roleOf, type Run, type RunEvent, tickAt, transitAt, when } from "../run/run";

interface TimelineProps {
  run: Run;
  player: Player;
  tick: number;
  eye: Eye;
}

interface ControlsProps extends TimelineProps {
  name: string;
  /** Buttons after those that go back. */
  children: ComponentChildren;
  /** Whether the reader chooses the speed. */
  paced?: boolean;
  end?: ComponentChildren;
}

/** Timeline, buttons, clock and speed of a run. */
export function Controls({ name, children, paced = true, end, ...props }: ControlsProps) {
  const { run, player, tick } = props;
  return (
    <section class="controls" aria-label={name}>
      <Timeline {...props} />
      <div class="buttons row wrap">
        <div class="group row">
          <Button icon="first" label={player.timed ? "Start" : "First tick"} act={() => player.seek(0)} />
          <Button icon="back" label={player.timed ? "Previous moment" : "Previous tick"} act={() => player.step(-1)} />
          {children}
        </div>
        <p class="clock row">
          {player.timed ? <Seconds player={player} /> : <>tick <b>{tick}</b> of {run.last}</>}
        </p>
        {paced && (
          <select aria-label="Speed" value={String(player.speed)} onChange={(event) => player.setSpeed(Number(event.currentTarget.value))}>
            {SPEEDS.map((speed) => (
              <option value={String(speed)}>{player.timed ? `${speed} x` : `${speed} ticks/s`}</option>
            ))}
          </select>
        )}
        {end}
      </div>
    </section>
  );
}

/** The controls of a replay. */
export function Playback(props: TimelineProps) {
  const { player } = props;
  return (
    <Controls name="Playback" {...props}>
      <Button icon={player.playing ? "pause" : "play"} label={player.playing ? "Pause" : "Play"} primary act={() => player.toggle()} />
      <Button icon="on" label={player.timed ? "Next moment" : "Next tick"} act={() => player.step(1)} />
      <Button icon="last" label={player.timed ? "End" : "Last tick"} act={() => player.seek(player.last)} />
    </Controls>
  );
}

/** The seconds of the run, updated with every frame. */
function Seconds({ player }: { player: Player }) {
  const words = useRef<HTMLSpanElement>(null);
  useLayoutEffect(() => {
    const follow = (time: number): void => {
      words.current!.textContent = `${time.toFixed(1)} of ${player.end.toFixed(1)} s`;
    };
    follow(player.time);
    const stops = [player.onFrame(follow), player.onTick(() => follow(player.time))];
    return () => stops.forEach((stop) => stop());
  }, [player]);
  return <span class="seconds" ref={words} />;
}

const RANK = Object.keys(EVENTS);
const MARK = 18;

interface TimelineMark {
  /** Percent of the width. */
  place: number;
  event: RunEvent;
  title: string;
}

/** The marks of a timeline of a given width in pixels: of those that would overlap, the first by rank stands for all. */
export function marksOf(run: Run, player: Player, width: number): TimelineMark[] {
  const marks: TimelineMark[] = [];
  const ranked = run.events.filter((event) => event[1] !== "goal");
  ranked.sort((a, b) => RANK.indexOf(a[1]) - RANK.indexOf(b[1]) || a[0] - b[0]);
  for (const event of ranked) {
    const place = player.end ? (100 * player.timeOf(event[0])) / player.end : 0;
    const title = `${when(run, event[0])}: ${event[2]}`;
    const host = marks.find((mark) => (Math.abs(mark.place - place) * width) / 100 < MARK);
    if (host === undefined) marks.push({ place, event, title });
    else if (host.title.length < 600) host.title += `\n${title}`;
  }
  return marks.sort((a, b) => a.place - b.place);
}

function Timeline({ run, player, tick, eye }: TimelineProps) {
  const select = useCallback((robot: number) => eye.follow(robot === eye.followed ? null : robot), [eye]);
  const track = useRef<HTMLDivElement>(null);
  const slider = useRef<HTMLInputElement>(null);
  const [width, setWidth] = useState(800);
  useLayoutEffect(() => resized(track.current!, () => setWidth(track.current!.clientWidth)), []);
  useLayoutEffect(() => {
    const follow = (time: number): void => {
      slider.current!.value = String(time);
    };
    follow(player.time);
    return player.onFrame(follow);
  }, [player]);
  const marks = useMemo(() => marksOf(run, player, width), [run, player, player.last, width]);
  return (
    <div class="timeline" ref={track}>
      <div class="marks">
        {marks.map(({ place, event, title }) => (
          <button
            key={`${event[0]} ${event[1]}`}
            type="button"
            tabIndex={-1}
            aria-hidden="true"
            class={event[0] <= tick ? "past" : ""}
            style={{ left: `${place}%` }}
            title={title}
            data-tick={event[0]}
            data-kind={event[1]}
            onClick={() => {
              player.pause();
              player.seek(event[0]);
            }}
          >
            <EventSign run={run} kind={event[1]} size={16} />
          </button>
        ))}
      </div>
      <input
        ref={slider}
        type="range"
        min={0}
        max={player.end}
        step="any"
        aria-label={player.timed ? "Time" : "Tick"}
        aria-valuetext={`${when(run, tick)} of ${moment(run, run.last)}`}
        onInput={(event) => player.seekTime(Number(event.currentTarget.value))}
      />
      <Lanes run={run} player={player} selected={eye.followed} select={select} />
    </div>
  );
}

/** The activities in a lane: meaning, and tops and bottoms of bars in a lane of height 4; colours alone resemble those of robots. */
const DOINGS = {
  moving: { words: "moves", bars: [[1, 3]] },
  waiting: { words: "waits for help", bars: [[0, 1], [3, 4]] },
  helping: { words: "helps", bars: [[0, 4]] },
};
type Doing = keyof typeof DOINGS;

/** A stretch of a lane. */
const bar = (kind: Doing, from: string, to: string): string =>
  DOINGS[kind].bars.map(([top, bottom]) => `M${from} ${top}H${to}V${bottom}H${from}z`).join("");

/** A robot's activity in the tick that ends at `tick`; null if it stays. */
function doingAt(run: Run, robot: Robot, tick: number): Doing | null {
  const role = roleOf(run, robot, Math.max(0, tick - 1))?.[0];
  if (role && role !== "out") return role === "helps" ? "helping" : "waiting";
  const under = transitAt(robot, run.times ? tick - 1 : tick) !== null;
  return under || (!run.times && robot.path[tick] !== robot.path[tick - 1]) ? "moving" : null;
}

interface Stretch {
  doing: Doing;
  first: number;
  last: number;
}

function stretchesOf(run: Run, robot: Robot): Stretch[] {
  const found: Stretch[] = [];
  for (let tick = 1; tick <= run.last; tick++) {
    const doing = doingAt(run, robot, tick);
    const before = found[found.length - 1];
    if (doing === null) continue;
    if (before?.doing === doing && before.last === tick - 1) before.last = tick;
    else found.push({ doing, first: tick - 1, last: tick });
  }
  return found;
}

interface LanesProps {
  run: Run;
  player: Player;
  /** The selected robot, or null. */
  selected: number | null;
  select(robot: number): void;
}

export const Lanes = memo(({ run, player, selected, select }: LanesProps) => (
  <ol class="lanes" aria-hidden="true" tabIndex={-1}>
    {run.robots.map((robot, i) => (
      <Lane key={robot.name} run={run} player={player} index={i} selected={selected === i} select={select} />
    ))}
  </ol>
));

type LaneProps = Omit<LanesProps, "selected"> & { index: number; selected: boolean };

/** `digit helps, 11 to 16`. */
function activityAt(run: Run, robot: Robot, stretches: Stretch[], tick: number): string {
  const found = stretches.find(({ first, last }) => first <= tick && tick < last);
  if (found === undefined) return `${robot.name} stays, ${when(run, tick)}`;
  return `${robot.name} ${DOINGS[found.doing].words}, ${moment(run, found.first)} to ${moment(run, found.last)}`;
}

function Lane({ run, player, index, selected, select }: LaneProps) {
  const robot = run.robots[index]!;
  const stretches = useMemo(() => stretchesOf(run, robot), [run, robot]);
  const most = player.end || 1;
  const x = (tick: number): string => player.timeOf(tick).toFixed(2);
  const bars = (kind: Doing): string =>
    stretches
      .filter((stretch) => stretch.doing === kind)
      .map(({ first, last }) => bar(kind, x(first), x(last)))
      .join("");
  return (
    <li
      data-robot={robot.name}
      class={selected ? "selected" : ""}
      style={{ "--colour": robot.look.colour }}
      onClick={() => select(index)}
      onPointerMove={(event) => {
        const box = event.currentTarget.getBoundingClientRect();
        const time = ((event.clientX - box.left) / box.width) * player.end;
        event.currentTarget.title = activityAt(run, robot, stretches, tickAt(run, time));
      }}
    >
      <span title={robot.name}>{robot.look.letters}</span>
      <svg viewBox={`0 0 ${most} 4`} preserveAspectRatio="none">
        {(Object.keys(DOINGS) as Doing[]).map((kind) => (
          <path {...INK[kind]} d={bars(kind)} />
        ))}
      </svg>
    </li>
  );
}
