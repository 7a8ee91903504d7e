/**
 * The clock of a live page: it follows the newest tick, smoothly, until the user
 * goes back; then it stays there while the run continues.
 */

import { Player } from "../run/player";
import { countOf, type Obstacle, type Robot, type Run } from "../run/run";

export type Say = (does: string, data?: object) => void;

export interface RunState {
  phase: "starting" | "paused" | "running" | "ended";
  speed: number;
  failure: string | null;
  outcome: string | null;
  busy: boolean;
  /** The inputs of the environment and their values. */
  inputs: Record<string, boolean>;
}

export class LivePlayer extends Player {
  following = true;
  state: RunState = { phase: "paused", speed: 4, failure: null, outcome: null, busy: false, inputs: {} };

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

/** The entries of a run from tick `since` on, in the shapes of the whole; they replace those that the page has. */
export interface News extends Pick<Run, "last" | "times" | "stack" | "events" | "sets"> {
  since: number;
  /** The number of sets before the new ones. */
  known: number;
  robots: Pick<Robot, "path" | "steps" | "headings" | "tasks" | "progress" | "charge" | "out" | "beliefs">[];
  /** The changed ones, with all their entries. */
  obstacles: Obstacle[];
}

/** Return a new run that shares unchanged parts with the old one. */
export function merged(run: Run, news: News): Run {
  const { since, last } = news;
  const renew = <T extends [number, ...unknown[]]>(list: T[] | null, more: T[] | null): void =>
    replaced(list, (entry) => entry[0] < since, more);
  const robots = run.robots.map((robot, i) => {
    const told = news.robots[i]!;
    replaced(robot.path, (_, tick) => tick < since, told.path);
    replaced(robot.steps, (step) => step[1] < since - 1, told.steps);
    renew(robot.tasks, told.tasks);
    renew(robot.progress, told.progress);
    renew(robot.charge, told.charge);
    renew(robot.out, told.out);
    for (const [of, changes] of Object.entries(told.beliefs)) renew((robot.beliefs[Number(of)] ??= [[0, 0, -1]]), changes);
    return { ...robot, headings: robot.headings && robot.headings.slice(0, since) + told.headings };
  });
  const named = new Map([...run.obstacles, ...news.obstacles].map((obstacle) => [obstacle.name, obstacle]));
  renew(run.stack, news.stack);
  renew(run.events, news.events);
  replaced(run.times, (_, tick) => tick < since, news.times);
  replaced(run.sets, (_, place) => place < news.known, news.sets);
  return { ...run, last, robots, obstacles: [...named.values()] };
}

/** Keep the first entries of a list that are old, and append new ones. */
function replaced<T>(list: T[] | null, isOld: (entry: T, index: number) => boolean, more: readonly T[] | null): void {
  if (list === null) return;
  list.length = countOf(list.length, (i) => isOld(list[i]!, i));
  for (const entry of more ?? []) list.push(entry);
}

export type Message = { is: string } & Record<string, any>;

export class Wire {
  connected = false;
  private asked: Promise<unknown> = Promise.resolve();

  constructor(
    private readonly heard: (message: Message) => void,
    private readonly changed: (connected: boolean) => void,
  ) {
    const events = new EventSource("events");
    events.onmessage = (event) => heard(JSON.parse(event.data as string) as Message);
    events.onopen = () => this.turn(true);
    events.onerror = () => this.turn(false);
  }

  /** Send a request to the studio, after those before it. */
  say = (does: string, data: object = {}): void => {
    const body = JSON.stringify({ do: does, ...data });
    this.asked = this.asked.then(() => this.ask(body)).catch(() => this.turn(false));
  };

  private async ask(body: string): Promise<void> {
    const answer = await fetch("say", { method: "POST", body });
    const message = answer.ok ? ((await answer.json()) as Message | null) : { is: "refused", message: await answer.text() };
    if (message !== null) this.heard(message);
  }

  private turn(connected: boolean): void {
    this.connected = connected;
    this.changed(connected);
  }
}
