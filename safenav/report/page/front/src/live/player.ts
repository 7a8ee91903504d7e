/**
 * The clock of a live page: it follows the newest tick, smoothly, until the user
 * goes back; then it stays there while the run continues.
 */

import { Player } from "../run/player";
import type { Run } from "../run/run";

export type Say = (does: string, data?: object) => void;

export interface RunState {
  phase: "starting" | "paused" | "running" | "ended";
  speed: number;
  seed: number | null;
  failure: string | null;
  outcome: string | null;
  busy: boolean;
  /** The inputs of the environment and their values. */
  inputs: Record<string, boolean>;
}

export class LivePlayer extends Player {
  following = true;
  state: RunState = { phase: "paused", speed: 4, seed: null, failure: null, outcome: null, busy: false, inputs: {} };

  constructor(
    last: number,
    private readonly say: Say,
  ) {
    super(last);
    this.time = last;
  }

  /** The run reached another tick, or restarted (`afresh`). */
  reach({ last, times }: Run, afresh: boolean): void {
    this.clock = times;
    const before = this.last;
    this.last = last;
    if (afresh) {
      this.following = true;
      this.time = Math.min(this.time, this.end);
      if (last < before) this.time = this.end;
    }
    if (this.following) this.chase();
    else this.tickChanged();
  }

  /** Take the state of the run from the studio. */
  stand(state: RunState): void {
    this.state = state;
    this.speed = state.speed;
    this.tickChanged();
  }

  /** Show the newest tick and follow the run. */
  follow(): void {
    this.following = true;
    super.seek(this.last);
  }

  override toggle(): void {
    const running = this.state.phase === "running";
    if (!running) this.follow();
    this.say(running ? "pause" : "play");
  }

  /** Show another tick; the run itself continues. */
  override seek(tick: number): void {
    this.playing = false;
    super.seek(tick);
    this.following = this.tick >= this.last;
    this.tickChanged();
  }

  override pause(): void {
    this.following = false;
    super.pause();
  }

  override step(by: number): void {
    // A page that follows the run may not have drawn its newest tick yet.
    if (by > 0 && (this.following || this.tick >= this.last)) {
      this.following = true;
      this.say("step");
    } else this.seek(this.tick + by);
  }

  override setSpeed(speed: number): void {
    this.say("speed", { value: speed });
  }

  protected override pace(): number {
    if (!this.following) return this.speed;
    const behind = this.end - this.time;
    return this.timed ? this.speed * Math.max(1, behind / this.far) : Math.max(this.speed, 2 * behind);
  }

  /** The distance from the newest moment within which the usual pace suffices: ticks, or seconds. */
  private get far(): number {
    return this.timed ? 3 * this.speed : 1;
  }

  private chase(): void {
    if (this.end - this.time > 3 * this.far) this.time = this.end - this.far;
    if (this.playing || this.time >= this.end) return this.changed();
    this.playing = true;
    this.previous = performance.now();
    requestAnimationFrame(this.advance);
    this.tickChanged();
  }
}
