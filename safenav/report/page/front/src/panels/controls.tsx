/** Play, step, speed, and the timeline with its marks. */

import { useLayoutEffect, useMemo, useRef, useState } from "preact/hooks";
import { EventSign, Icon, type ButtonIcon } from "./icons";
import { Axis, Lanes } from "./lanes";
import { unless } from "./notice";
import { SPEEDS, type Player } from "../run/player";
import type { EventKind, Run, RunEvent } from "../run/run";

interface ControlsProps {
  run: Run;
  player: Player;
  tick: number;
}

export function Controls({ run, player, tick }: ControlsProps) {
  return (
    <section class="controls" aria-label="Playback">
      <Timeline run={run} player={player} tick={tick} />
      <div class="buttons">
        <div class="group">
          <BackButtons player={player} />
          <Button
            icon={player.playing ? "pause" : "play"}
            label={player.playing ? "Pause" : "Play"}
            primary
            onClick={() => player.toggle()}
          />
          <Button icon="on" label="One tick on" onClick={() => player.step(1)} />
          <Button icon="last" label="Last tick" onClick={() => player.seek(player.last)} />
        </div>
        <p class="clock">
          tick <b>{tick}</b> of {run.last}
          {run.within && tick === run.last && <span class="quiet">, ended within it</span>}
          {player.timed && <Seconds player={player} />}
          <LinkButton tick={tick} />
        </p>
        <SpeedButtons player={player} />
      </div>
    </section>
  );
}

/** To the first tick, and to the one before. */
export function BackButtons({ player }: { player: Player }) {
  return (
    <>
      <Button icon="first" label="First tick" onClick={() => player.seek(0)} />
      <Button icon="back" label="One tick back" onClick={() => player.step(-1)} />
    </>
  );
}

/** How fast ticks pass: slower, a choice, faster. */
export function SpeedButtons({ player }: { player: Player }) {
  return (
    <div class="group speed">
      <Button
        icon="slower"
        label="Slower"
        off={player.speed === SPEEDS[0] && "this is the slowest pace"}
        onClick={() => player.faster(-1)}
      />
      <label>
        <span class="unseen">Speed</span>
        <select
          value={String(player.speed)}
          onChange={(event) => player.setSpeed(Number(event.currentTarget.value))}
        >
          {SPEEDS.map((speed) => (
            <option value={String(speed)}>{player.timed ? `${speed} x` : `${speed} ticks/s`}</option>
          ))}
        </select>
      </label>
      <Button
        icon="faster"
        label="Faster"
        off={player.speed === SPEEDS[SPEEDS.length - 1] && "this is the fastest pace"}
        onClick={() => player.faster(1)}
      />
    </div>
  );
}

interface ButtonProps {
  icon: ButtonIcon;
  label: string;
  primary?: boolean;
  /** Why it does nothing now. */
  off?: string | false;
  onClick(): void;
}

export function Button({ icon, label, primary, off, onClick }: ButtonProps) {
  return (
    <button type="button" class={primary ? "primary" : ""} aria-label={label} {...unless(off, onClick, label)}>
      <Icon name={icon} />
    </button>
  );
}

/** The seconds of the motion, brought up to date with every frame. */
function Seconds({ player }: { player: Player }) {
  const words = useRef<HTMLSpanElement>(null);
  useLayoutEffect(() => {
    const follow = (time: number): void => {
      words.current!.textContent = ` · ${time.toFixed(1)} of ${player.end.toFixed(1)} s`;
    };
    follow(player.time);
    return player.onFrame(follow);
  }, [player]);
  return <span class="seconds" ref={words} />;
}

/** Copies the address of this tick; where there is no clipboard, the address bar has it. */
function LinkButton({ tick }: { tick: number }) {
  const [copied, setCopied] = useState(false);
  const copy = async (): Promise<void> => {
    const address = location.href.replace(/#.*$/, "") + `#tick=${tick}`;
    try {
      await navigator.clipboard.writeText(address);
    } catch {
      location.hash = `tick=${tick}`;
    }
    setCopied(true);
    setTimeout(() => setCopied(false), 1200);
  };
  return (
    <button
      type="button"
      class="link"
      title="Copy a link to this tick"
      aria-label="Copy a link to this tick"
      onClick={copy}
    >
      {copied ? "copied" : <Icon name="link" />}
    </button>
  );
}

/** Most telling first: what stands for a tick in which several things happened. */
const WEIGHT: EventKind[] = [
  "outcome",
  "assumption",
  "violation",
  "blocked",
  "resolved",
  "request",
  "yield",
  "push",
  "pop",
  "synthesis",
  "goal",
];
const MARK = 18;

interface TimelineMark {
  /** Percent of the width. */
  place: number;
  event: RunEvent;
  title: string;
}

/** Events closer than a mark is wide share one, so that marks never overlap. */
function marksOf(run: Run, player: Player, width: number): TimelineMark[] {
  const marks: TimelineMark[] = [];
  let edge = -Infinity;
  for (const event of run.events) {
    if (event[1] === "goal") continue;
    const place = player.end ? player.timeOf(event[0]) / player.end : 0;
    const told = `tick ${event[0]}: ${event[2]}`;
    const before = marks[marks.length - 1];
    if (before && place * width < edge + MARK) {
      if (WEIGHT.indexOf(event[1]) < WEIGHT.indexOf(before.event[1])) before.event = event;
      if (before.title.length < 600) before.title += `\n${told}`;
    } else {
      edge = place * width;
      marks.push({ place: 100 * place, event, title: told });
    }
  }
  return marks;
}

export function Timeline({ run, player, tick }: ControlsProps) {
  const track = useRef<HTMLDivElement>(null);
  const slider = useRef<HTMLInputElement>(null);
  const [width, setWidth] = useState(800);
  useLayoutEffect(() => {
    const observer = new ResizeObserver(() => setWidth(track.current!.clientWidth));
    observer.observe(track.current!);
    return () => observer.disconnect();
  }, []);
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
            type="button"
            tabIndex={-1}
            aria-hidden="true"
            class={event[0] <= tick ? "past" : ""}
            style={{ left: `${place}%` }}
            title={title}
            data-tick={event[0]}
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
        aria-label="Tick"
        aria-valuetext={`tick ${tick} of ${run.last}`}
        onInput={(event) => player.seekTime(Number(event.currentTarget.value))}
      />
      <svg class="goals" viewBox="0 0 1000 6" preserveAspectRatio="none" aria-hidden="true">
        <path d={goals} />
      </svg>
      <Lanes run={run} player={player} />
      <Axis last={player.end} width={width} />
    </div>
  );
}
