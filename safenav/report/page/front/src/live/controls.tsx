/** Run, pause, step, speed and seed of a live run; its timeline is that of a replay. */

import { useState } from "preact/hooks";
import { Controls } from "../panels/controls";
import { Button, Press } from "../panels/button";
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

export function LiveControls({ say, ...props }: LiveControlsProps) {
  const { run, player, tick } = props;
  const running = player.state.phase === "running";
  const ended = player.state.phase === "ended";
  return (
    <Controls name="The run" kind="live" paced={say !== null} end={say && <Again player={player} say={say} />} {...props}>
      {say && (
        <Button icon={running ? "pause" : "play"} label={running ? "Pause the run" : "Run"} primary off={ended && OVER} act={() => player.toggle()} />
      )}
      <Button icon="on" label="Next tick" off={(ended || !say) && tick >= run.last && OVER} act={() => player.step(1)} />
      <Press
        class={`now ${player.following ? "following" : ""}`}
        off={player.following && "this is the newest tick"}
        title="Follow the run"
        act={() => player.follow()}
      >
        <span class="dot" /> Live
      </Press>
    </Controls>
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
    <div class="group again row">
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
      <Press title="Restart the run" act={again}>
        Restart
      </Press>
      <Press off={player.state.phase === "ended" && OVER} title="End the run" act={() => say("end")}>
        End
      </Press>
    </div>
  );
}
