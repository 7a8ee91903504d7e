/** Run, pause, step, speed and seed of a live run; its timeline is that of a replay. */

import { useState } from "preact/hooks";
import { BackButtons, Button, Seconds, SpeedChoice, Timeline } from "../panels/controls";
import { unless } from "../panels/notice";
import type { Eye } from "../map/camera";
import type { Run } from "../run/run";
import { OVER } from "./changes";
import type { LivePlayer, Say } from "./player";

interface LiveControlsProps {
  run: Run;
  player: LivePlayer;
  tick: number;
  eye: Eye;
  /** Null where a program drives the run. */
  say: Say | null;
}

export function LiveControls({ run, player, tick, eye, say }: LiveControlsProps) {
  const { phase } = player.state;
  const running = phase === "running";
  const ended = phase === "ended";
  return (
    <section class="controls live" aria-label="The run">
      <Timeline run={run} player={player} tick={tick} eye={eye} />
      <div class="buttons">
        <div class="group">
          <BackButtons player={player} />
          {say && <Button
            icon={running ? "pause" : "play"}
            label={running ? "Pause the run" : "Run"}
            primary
            off={ended && OVER}
            onClick={() => player.toggle()}
          />}
          <Button icon="on" label="Next tick" off={(ended || !say) && tick >= run.last && OVER} onClick={() => player.step(1)} />
          <button
            type="button"
            class={`now ${player.following ? "following" : ""}`}
            {...unless(player.following && "this is the newest tick", () => player.follow(), "Follow the run")}
          >
            <span class="dot" /> Live
          </button>
        </div>
        <p class="clock">
          {player.timed ? <Seconds player={player} /> : <>tick <b>{tick}</b> of {run.last}</>}
        </p>
        {say && <SpeedChoice player={player} />}
        {say && <Again player={player} say={say} />}
      </div>
    </section>
  );
}

/** Another run of the same scenario, with another seed if one is given. */
function Again({ player, say }: { player: LivePlayer; say: Say }) {
  const [seed, setSeed] = useState("");
  const again = (): void => {
    player.following = true;
    say("restart", { play: true, ...(seed !== "" && { seed: Number(seed) }) });
  };
  return (
    <div class="group again">
      <label>
        seed
        <input
          type="number"
          min={0}
          placeholder={String(player.state.seed ?? "own")}
          value={seed}
          onInput={(event) => setSeed(event.currentTarget.value)}
        />
      </label>
      <button type="button" title="Restart the run" onClick={again}>
        Restart
      </button>
      <button type="button" {...unless(player.state.phase === "ended" && OVER, () => say("end"), "End the run")}>
        End
      </button>
    </div>
  );
}
