/** Everything that the page shows, as the studio tells it; the page holds nothing of its own. */

import { useEffect, useMemo, useReducer, useRef, useState } from "preact/hooks";
import { merged, type News } from "../live/merge";
import { LivePlayer, type RunState } from "../live/player";
import { Wire, type Message } from "../live/wire";
import type { Run } from "../run/run";
import { OpenMenu, SaveMenu } from "./begin";
import { Draw } from "./draw";
import { packedIn } from "./links";
import { LiveView } from "./live";
import type { Doc, Drawing, Verdict } from "./model";
import type { ObstacleKind } from "../live/changes";

interface Hello {
  editor: boolean;
  types: ObstacleKind[];
  templates: Record<string, string>;
  folder: boolean;
}

export function Studio() {
  const [, redraw] = useReducer((count: number) => count + 1, 0);
  const [connected, setConnected] = useState(true);
  const [refused, refuse] = useState<string | null>(null);
  const [run, setRun] = useState<Run | null>(null);
  const [hello, setHello] = useState<Hello | null>(null);
  const [doc, setDoc] = useState<Doc | null>(null);
  const [verdicts, setVerdicts] = useState<Record<string, Verdict>>({});
  const [running, watch] = useState(false);
  const current = useRef<Run | null>(null);
  const wire = useMemo(() => new Wire((message) => hear.current(message), setConnected), []);
  const player = useMemo(() => new LivePlayer(0, wire.say), [wire]);
  const hear = useRef<(message: Message) => void>(() => undefined);
  hear.current = (message) => {
    if (message.is === "hello") setHello(message as unknown as Hello);
    else if (message.is === "document") {
      setDoc(message as unknown as Doc);
      setVerdicts({});
    } else if (message.is === "verdicts") setVerdicts(message.verdicts as Record<string, Verdict>);
    else if (message.is === "saved") refuse(`Saved: ${message.file}`);
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
    const linked = packedIn(location.hash);
    if (linked === null) return;
    history.replaceState(null, "", location.pathname);
    wire.say("open", { kind: "link", packed: linked });
  }, [wire]);
  useEffect(() => {
    const close = (event: Event): void => {
      for (const menu of document.querySelectorAll("details.menu[open]")) {
        if (!menu.contains(event.target as Node)) menu.removeAttribute("open");
      }
    };
    addEventListener("pointerdown", close);
    return () => removeEventListener("pointerdown", close);
  }, []);
  useEffect(() => {
    if (refused === null) return;
    const timer = setTimeout(() => refuse(null), 6000);
    return () => clearTimeout(timer);
  }, [refused]);
  return (
    <>
      {hello === null || (hello.editor && doc === null) ? (
        <p class="waiting">Connecting to the studio …</p>
      ) : doc === null || running || doc.drawing === null ? (
        <LiveView
          run={run}
          player={player}
          wire={wire}
          types={hello.types}
          saving={doc && <SaveMenu doc={doc} folder={hello.folder} ran={run !== null} say={wire.say} tell={refuse} />}
          bar={
            doc && (
              <button type="button" onClick={() => watch(false)}>
                ✎ Draw
              </button>
            )
          }
        />
      ) : (
        <Draw
          doc={doc as Doc & { drawing: Drawing }}
          verdicts={verdicts}
          say={wire.say}
          menus={
            <>
              {run !== null && (
                <button type="button" onClick={() => watch(true)}>
                  To the run
                </button>
              )}
              <OpenMenu templates={hello.templates} say={wire.say} complain={refuse} />
              <SaveMenu doc={doc} folder={hello.folder} ran={run !== null} say={wire.say} tell={refuse} />
            </>
          }
          run={() => {
            watch(true);
            player.following = true;
            wire.say("restart", { play: true });
          }}
        />
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
