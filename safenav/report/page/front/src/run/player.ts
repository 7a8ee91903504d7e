

import { tickAt } from "./run";

/**
 * The playback clock of the page. It counts in ticks, or in seconds if the run
 * has a clock; then `clock` holds the time of each tick.
 *
 * Two kinds of listeners: `onFrame` for smooth motion (called for every frame, must be
 * cheap), `onTick` for changes at whole ticks and of the state of the player.
 */

export const SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16, 32, 64];

export class Player {
  time = 0;
  playing = false;
  speed = 4;
  protected previous = 0;
  private frames = new Set<(time: number) => void>();
  private ticks = new Set<() => void>();

  constructor(
    public last: number,
    protected clock: readonly number[] | null = null,
  ) {
    if (clock !== null) this.speed = 1;
  }

  /** Whether the time is in seconds. */
  get timed(): boolean {
    return this.clock !== null;
  }

  /** Return the time at which all events of a tick have happened. */
  timeOf(tick: number): number {
    return this.clock === null ? tick : this.clock[tick]!;
  }

  /** The time of the last tick. */
  get end(): number {
    return this.timeOf(this.last);
  }

  /** The tick whose events have happened. */
  get tick(): number {
    return tickAt({ times: this.clock, last: this.last }, this.time);
  }

  onFrame(listener: (time: number) => void): () => void {
    this.frames.add(listener);
    return () => this.frames.delete(listener);
  }

  onTick(listener: () => void): () => void {
    this.ticks.add(listener);
    return () => this.ticks.delete(listener);
  }

  play(): void {
    if (this.playing || this.last === 0) return;
    if (this.time >= this.end) this.time = 0;
    this.playing = true;
    this.previous = performance.now();
    requestAnimationFrame(this.advance);
    this.changed();
  }

  pause(): void {
    if (!this.playing) return;
    this.playing = false;
    this.changed();
  }

  toggle(): void {
    if (this.playing) this.pause();
    else this.play();
  }

  /** Jump to a tick; playback continues from there. */
  seek(tick: number): void {
    this.time = this.timeOf(Math.max(0, Math.min(this.last, Math.round(tick))));
    this.changed();
  }

  /** Jump to a time; to a whole tick if time is in ticks. */
  seekTime(time: number): void {
    if (this.clock === null) return this.seek(time);
    this.time = Math.max(0, Math.min(this.end, time));
    this.changed();
  }

  /** Stop, and move by `by` whole ticks. */
  step(by: number): void {
    this.playing = false;
    this.seek(this.tick + by);
  }

  faster(by: 1 | -1): void {
    const next = SPEEDS[SPEEDS.indexOf(this.speed) + by];
    if (next !== undefined) this.setSpeed(next);
  }

  setSpeed(speed: number): void {
    this.speed = speed;
    this.tickChanged();
  }

  protected advance = (now: number): void => {
    if (!this.playing) return;
    const before = this.tick;
    // After a time in the background, playback continues at the same position.
    const elapsed = Math.min(0.25, Math.max(0, (now - this.previous) / 1000));
    this.previous = now;
    this.time = Math.min(this.end, this.time + elapsed * this.pace());
    if (this.time >= this.end) this.playing = false;
    else requestAnimationFrame(this.advance);
    for (const listener of this.frames) listener(this.time);
    if (this.tick !== before || !this.playing) this.tickChanged();
  };

  /** Time that passes per second of playback. */
  protected pace(): number {
    return this.speed;
  }

  protected changed(): void {
    for (const listener of this.frames) listener(this.time);
    this.tickChanged();
  }

  protected tickChanged(): void {
    for (const listener of this.ticks) listener();
  }
}

/** The part of the address that names this moment. */
function linkTo(player: Player): string {
  return player.timed ? `#t=${player.time.toFixed(1)}` : `#tick=${player.tick}`;
}

/** Goes to the linked tick now and when the address changes; keeps the address up to date. */
export function followLinks(player: Player): void {
  const follow = (): void => {
    const found = /^#(tick|t)=(\d+(?:\.\d+)?)$/.exec(location.hash);
    if (found === null || location.hash === linkTo(player)) return;
    player.pause();
    if (found[1] === "t") player.seekTime(Number(found[2]));
    else player.seek(Number(found[2]));
  };
  follow();
  addEventListener("hashchange", follow);
  let pending = 0;
  player.onTick(() => {
    clearTimeout(pending);
    if (player.playing) return; // browsers refuse hundreds of changes of address a minute
    const before = location.hash;
    pending = window.setTimeout(() => {
      if (location.hash !== before) return; // a new address, which the page is about to follow
      if (before !== linkTo(player)) history.replaceState(null, "", linkTo(player));
    }, 120);
  });
}
