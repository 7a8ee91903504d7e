/** The address names the tick, `#tick=12`, or the second if the run has a clock: `#t=12.3`. */

import type { Player } from "./player";

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
