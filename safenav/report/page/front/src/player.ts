/**
 * The clock of the page: a time in ticks that runs, stops and jumps.
 *
 * Two kinds of listeners: `onFrame` for what moves smoothly (called for every frame, must be
 * cheap), `onTick` for what only changes with whole ticks or with the state of the player.
 */

export const SPEEDS = [0.5, 1, 2, 4, 8, 16, 32, 64];

export class Player {
  time = 0;
  playing = false;
  speed = 4;
  private previous = 0;
  private frames = new Set<(time: number) => void>();
  private ticks = new Set<() => void>();

  constructor(readonly last: number) {}

  /** The tick whose events have happened. */
  get tick(): number {
    return Math.min(this.last, Math.floor(this.time + 1e-9));
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
    if (this.time >= this.last) this.time = 0;
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

  /** Jumps to a tick; playing goes on from there. */
  seek(tick: number): void {
    this.time = Math.max(0, Math.min(this.last, Math.round(tick)));
    this.changed();
  }

  /** Stops and goes some whole ticks on or back. */
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

  private advance = (now: number): void => {
    if (!this.playing) return;
    const before = this.tick;
    // A page that was in the background goes on where it was, it does not leap.
    const elapsed = Math.min(0.25, Math.max(0, (now - this.previous) / 1000));
    this.previous = now;
    this.time = Math.min(this.last, this.time + elapsed * this.speed);
    if (this.time >= this.last) this.playing = false;
    else requestAnimationFrame(this.advance);
    for (const listener of this.frames) listener(this.time);
    if (this.tick !== before || !this.playing) this.tickChanged();
  };

  private changed(): void {
    for (const listener of this.frames) listener(this.time);
    this.tickChanged();
  }

  private tickChanged(): void {
    for (const listener of this.ticks) listener();
  }
}
