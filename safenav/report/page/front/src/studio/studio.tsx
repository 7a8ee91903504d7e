/** The page of the studio. Its state is that of the server. */

import { render } from "preact";
import { useEffect, useMemo, useRef, useState } from "preact/hooks";
import { LiveView, RunDownloads } from "../live/live";
import { LivePlayer, merged, type Message, type RunState, type Say, Wire } from "../live/player";
import { onNotice, Popup, Press } from "../panels/shell";
import { type Run, useRedraw } from "../run/run";
import { Draw } from "./draw";
import type { Doc, Palette, Verdict } from "./model";
import { Writing } from "./text";

interface Hello {
  editor: boolean;
  /** Whether a program drives the run. */
  watches?: boolean;
  palette: Palette;
  templates: Record<string, string>;
  folder: string;
}

/** The end of the address while the run is shown. */
const WATCHED = "#run";

export function Studio() {
  const redraw = useRedraw();
  const [connected, setConnected] = useState(true);
  const [refused, refuse] = useState<string | null>(null);
  const [run, setRun] = useState<Run | null>(null);
  const [hello, setHello] = useState<Hello | null>(null);
  const [doc, setDoc] = useState<Doc | null>(null);
  const [verdicts, setVerdicts] = useState<Record<string, Verdict>>({});
  const [running, setRunning] = useState(false);
  const watch = (on: boolean): void => {
    history.replaceState(null, "", on ? WATCHED : location.pathname);
    setRunning(on);
  };
  const [files, setFiles] = useState<string[] | null>(null);
  const current = useRef<Run | null>(null);
  const latest = useRef<Doc | null>(null);
  const writing = useRef<Writing | null>(null);
  const wire = useMemo(() => new Wire((message) => hear.current(message), setConnected), []);
  const player = useMemo(() => new LivePlayer(0, wire.say), [wire]);
  const show = (told: Run | null, state?: RunState): void => {
    const before = current.current;
    current.current = told;
    if (state) player.stand(state);
    if (told) player.reach(told, state !== undefined && (before === null || told.last < before.last));
    setRun(told);
    if (before === null && told !== null && location.hash === WATCHED) setRunning(true); // reloaded
  };
  const hear = useRef<(message: Message) => void>(() => undefined);
  const heard: Record<string, (message: Message) => void> = {
    hello: (message) => setHello(message as unknown as Hello),
    document: (message) => {
      const before = latest.current;
      const now = (latest.current = message as unknown as Doc);
      if (before?.origin !== now.origin) writing.current = new Writing(now.text, wire.say, redraw);
      setDoc(now);
      if (before?.revision !== now.revision) setVerdicts({}); // a saved text keeps them
    },
    verdicts: ({ verdicts }) => setVerdicts(verdicts),
    saved: ({ file }) => refuse(`Saved: ${file}`),
    refused: ({ message }) => refuse(message),
    files: ({ names }) => setFiles(names),
    exists: ({ name, message }) => {
      if (confirm(`${message}. Replace it? Its content would be lost.`)) wire.say("save", { name: name ?? undefined, replace: true });
    },
    state: ({ state }) => {
      player.stand(state);
      redraw();
    },
    run: ({ run, state }) => show(run, state),
    news: ({ news }) => current.current && show(merged(current.current, news)),
  };
  const open = (data: object): void => {
    if (!doc?.dirty || confirm("The scenario has unsaved changes. Discard them?")) wire.say("open", data);
  };
  hear.current = (message) => heard[message.is]?.(message);
  useEffect(() => onNotice(refuse), []);
  useEffect(() => {
    if (refused === null) return;
    const timer = setTimeout(() => refuse(null), 6000);
    return () => clearTimeout(timer);
  }, [refused]);
  return (
    <>
      {hello === null || (hello.editor && doc === null) ? (
        <p class="waiting">Connecting to the studio …</p>
      ) : doc === null || running ? (
        <LiveView
          run={run}
          player={player}
          wire={wire}
          palette={doc?.palette ?? hello.palette}
          watches={hello.watches ?? false}
          saving={doc && <SaveMenu doc={doc} ran={run !== null} say={wire.say} />}
          bar={
            doc && (
              <Press act={() => watch(false)}>✎ Draw</Press>
            )
          }
        />
      ) : (
        <Draw
          key={doc.origin}
          doc={doc}
          writing={writing.current!}
          verdicts={verdicts}
          say={wire.say}
          save={() => save(doc, wire.say)}
          menus={
            <>
              {run !== null && (
                <Press act={() => watch(true)}>To the run</Press>
              )}
              <NewMenu templates={hello.templates} open={open} />
              <OpenMenu folder={hello.folder} files={files} say={wire.say} open={open} />
              <SaveMenu doc={doc} ran={run !== null} say={wire.say} />
            </>
          }
          run={() => {
            watch(true);
            player.following = true;
            wire.say("restart", { play: true });
          }}
        />
      )}
      {!connected && <p class="toast lost">The studio has ended. Start it again, or close this page.</p>}
      {refused !== null && (
        <p class="toast" role="alert" onClick={() => refuse(null)}>
          {refused}
        </p>
      )}
    </>
  );
}

/** Open another scenario in place of this one. */
type Open = (data: object) => void;

export function NewMenu({ templates, open }: { templates: Record<string, string>; open: Open }) {
  const [rows, setRows] = useState(7);
  const [cols, setCols] = useState(13);
  return (
    <Popup kind="menu" name="New">
      <p>
        <input aria-label="Rows" type="number" min={3} max={512} value={rows} onInput={(e) => setRows(Number(e.currentTarget.value))} /> x{" "}
        <input aria-label="Columns" type="number" min={3} max={512} value={cols} onInput={(e) => setCols(Number(e.currentTarget.value))} />
      </p>
      <Press act={() => open({ kind: "blank", rows, cols })}>Blank map of that size</Press>
      {Object.entries(templates).map(([name, about]) => (
        <Press key={name} title={about} act={() => open({ kind: "template", name })}>Template: {name}</Press>
      ))}
    </Popup>
  );
}

/** The scenarios of the folder. */
export function OpenMenu({ folder, files, say, open }: { folder: string; files: string[] | null; say: Say; open: Open }) {
  return (
    <Popup kind="menu" name="Open" opened={() => say("files")}>
      <p class="quiet">{folder}</p>
      {files?.map((name) => (
        <Press key={name} act={() => open({ kind: "file", name })}>{name}</Press>
      ))}
    </Popup>
  );
}

export function SaveMenu({ doc, ran, say }: { doc: Doc; ran: boolean; say: Say }) {
  return (
    <Popup kind="menu" name="Save" mark={doc.dirty && <span class="dirty" title="Unsaved changes"> ●</span>}>
      <Press act={() => save(doc, say)}>{doc.file === null ? "Save …" : `Save ${doc.file}`}</Press>
      {doc.file !== null && (
        <Press act={() => saveAs(doc, say)}>Save as …</Press>
      )}
      <a href="save/scenario" download>
        Download the scenario
      </a>
      {ran && <RunDownloads />}
    </Popup>
  );
}

/** Save to the file of the scenario; one without a file gets a name first. */
export function save(doc: Doc, say: Say): void {
  if (doc.file === null) saveAs(doc, say);
  else say("save");
}

function saveAs({ file, drawing }: Doc, say: Say): void {
  const stem = (drawing?.run.name ?? "").toLowerCase().replace(/[^a-z0-9]+/g, "_").replace(/^_+|_+$/g, "");
  const name = prompt("File name", file ?? `${stem || "scenario"}.yaml`);
  if (name) say("save", { name: /\.ya?ml$/.test(name) ? name : `${name}.yaml` });
}

render(<Studio />, document.getElementById("app")!);
