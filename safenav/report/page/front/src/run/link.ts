/** The address names the tick: `#tick=12`. */

import type { Player } from "./player";

function linkedTick(): number | null {
  const found = /^#tick=(\d+)$/.exec(location.hash);
  return found ? Number(found[1]) : null;
}

/** Goes to the linked tick now and when the address changes; keeps the address up to date. */
export function followLinks(player: Player): void {
  const follow = (): void => {
    const tick = linkedTick();
    if (tick === null || tick === player.tick) return;
    player.pause();
    player.seek(tick);
  };
  follow();
  addEventListener("hashchange", follow);
  let pending = 0;
  player.onTick(() => {
    clearTimeout(pending);
    if (player.playing) return; // browsers refuse hundreds of changes of address a minute
    pending = window.setTimeout(() => {
      if (linkedTick() !== player.tick) history.replaceState(null, "", `#tick=${player.tick}`);
    }, 120);
  });
}
