/** Play, step, speed, and the timeline with its marks. */

import type { ComponentChildren } from "preact";
import { useCallback, useLayoutEffect, useMemo, useRef, useState } from "preact/hooks";
import { Curves, Deadlines } from "./curves";
import { Button } from "./button";
import { EventSign } from "./icons";
import { Axis, Lanes } from "./lanes";
import { resized } from "../listening";
import type { Eye } from "../map/camera";
import { SPEEDS, type Player } from "../run/player";
import { EVENTS, moment, when, type Run, type RunEvent } from "../run/run";

interface TimelineProps {
  run: Run;
  player: Player;
  tick: number;
  eye: Eye;
}

interface ControlsProps extends TimelineProps {
  name: string;
  kind?: string;
  /** Buttons after those that go back. */
  children: ComponentChildren;
  /** Whether the reader chooses the speed. */
  paced?: boolean;
  end?: ComponentChildren;
}

/** Timeline, buttons, clock and speed of a run. */
export function Controls({ name, kind = "", children, paced = true, end, ...props }: ControlsProps) {
  const { run, player, tick } = props;
  return (
    <section class={`controls ${kind}`} aria-label={name}>
      <Timeline {...props} />
      <div class="buttons row">
        <div class="group row">
          <Button icon="first" label={player.timed ? "Start" : "First tick"} act={() => player.seek(0)} />
          <Button icon="back" label={player.timed ? "Previous moment" : "Previous tick"} act={() => player.step(-1)} />
          {children}
        </div>
        <p class="clock row">
          {player.timed ? <Seconds player={player} /> : <>tick <b>{tick}</b> of {run.last}</>}
          {run.within && tick === run.last && <span class="quiet">(ended within it)</span>}
        </p>
        {paced && (
          <label class="speed">
            <span class="unseen">Speed</span>
            <select value={String(player.speed)} onChange={(event) => player.setSpeed(Number(event.currentTarget.value))}>
              {SPEEDS.map((speed) => (
                <option value={String(speed)}>{player.timed ? `${speed} x` : `${speed} ticks/s`}</option>
              ))}
            </select>
          </label>
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
  const goals = useMemo(() => {
    const ticks = new Set(run.events.filter((event) => event[1] === "goal").map((event) => event[0]));
    const part = (t: number): number => player.timeOf(t) / (player.end || 1);
    return [...ticks].map((t) => `M${(part(t) * 1000).toFixed(1)} 0v6`).join("");
  }, [run, player]);
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
      <svg class="goals" viewBox="0 0 1000 6" preserveAspectRatio="none" aria-hidden="true">
        <path d={goals} />
      </svg>
      <Lanes run={run} player={player} selected={eye.followed} select={select} />
      <Deadlines run={run} player={player} />
      <Curves run={run} end={player.end} />
      <Axis last={player.end} width={width} />
    </div>
  );
}
