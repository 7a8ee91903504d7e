/** Everything that the page shows, as the studio tells it; the page holds nothing of its own. */

import { useEffect, useMemo, useReducer, useRef, useState } from "preact/hooks";
import { merged, type News } from "../live/merge";
import { LivePlayer, type RunState } from "../live/player";
import { Wire, type Message } from "../live/wire";
import type { Run } from "../run";
import { LiveView } from "./live";
import type { ObstacleKind } from "../live/changes";

export function Studio() {
  const [, redraw] = useReducer((count: number) => count + 1, 0);
  const [connected, setConnected] = useState(true);
  const [refused, refuse] = useState<string | null>(null);
  const [run, setRun] = useState<Run | null>(null);
  const [hello, setHello] = useState<{ editor: boolean; types: ObstacleKind[] } | null>(null);
  const current = useRef<Run | null>(null);
  const wire = useMemo(() => new Wire((message) => hear.current(message), setConnected), []);
  const player = useMemo(() => new LivePlayer(0, wire.say), [wire]);
  const hear = useRef<(message: Message) => void>(() => undefined);
  hear.current = (message) => {
    if (message.is === "hello") setHello(message as unknown as { editor: boolean; types: ObstacleKind[] });
    else if (message.is === "refused") refuse(message.message as string);
    else if (message.is === "state") {
      player.stand(message.state as RunState);
      redraw(0);
    } else if (message.is === "run") {
      const before = current.current;
      const told = message.run as Run | null;
      current.current = told;
      player.stand(message.state as RunState);
      if (told) player.reach(told.last, before === null || told.last < before.last);
      setRun(told);
    } else if (message.is === "news" && current.current) {
      const news = message.news as News;
      current.current = merged(current.current, news);
      player.reach(news.last, false);
      setRun(current.current);
    }
  };
  useEffect(() => {
    if (refused === null) return;
    const timer = setTimeout(() => refuse(null), 6000);
    return () => clearTimeout(timer);
  }, [refused]);
  return (
    <>
      {hello === null ? (
        <p class="waiting">Connecting to the studio …</p>
      ) : (
        <LiveView run={run} player={player} wire={wire} types={hello.types} />
      )}
      {!connected && <p class="toast lost">The studio is gone. Start it again, or close this page.</p>}
      {refused !== null && (
        <p class="toast" role="alert" onClick={() => refuse(null)}>
          {refused}
        </p>
      )}
    </>
  );
}
