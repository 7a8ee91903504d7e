/** New, Open and Save: menus for scenarios; the browser asks for names. */

import { useState } from "preact/hooks";
import type { Say } from "../live/player";
import { RunDownloads } from "./live";
import { Popup } from "../panels/button";
import type { Doc } from "./model";

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
      <button type="button" onClick={() => open({ kind: "blank", rows, cols })}>
        Blank map of that size
      </button>
      {Object.entries(templates).map(([name, about]) => (
        <button type="button" key={name} title={about} onClick={() => open({ kind: "template", name })}>
          Template: {name}
        </button>
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
        <button type="button" key={name} onClick={() => open({ kind: "file", name })}>
          {name}
        </button>
      ))}
      {files?.length === 0 && (
        <p>
          No scenario in this folder. Another folder: <code>safenav studio FOLDER</code>
        </p>
      )}
    </Popup>
  );
}

export function SaveMenu({ doc, ran, say }: { doc: Doc; ran: boolean; say: Say }) {
  return (
    <Popup kind="menu" name="Save" mark={doc.dirty && <span class="dirty" title="Unsaved changes" />}>
      <button type="button" onClick={() => save(doc, say)}>
        {doc.file === null ? "Save …" : `Save ${doc.file}`}
      </button>
      {doc.file !== null && (
        <button type="button" onClick={() => saveAs(doc, say)}>
          Save as …
        </button>
      )}
      <a href="save/scenario" download>
        Download the scenario
      </a>
      {ran && (
        <>
          <hr />
          <RunDownloads />
        </>
      )}
    </Popup>
  );
}

/** Save to the file of the scenario; one without a file gets a name first. */
export function save(doc: Doc, say: Say): void {
  if (doc.file === null) saveAs(doc, say);
  else say("save");
}

function saveAs({ file, drawing }: Doc, say: Say): void {
  const stem = (drawing?.name ?? "").toLowerCase().replace(/[^a-z0-9]+/g, "_").replace(/^_+|_+$/g, "");
  const name = prompt("File name", file ?? `${stem || "scenario"}.yaml`);
  if (name) say("save", { name: /\.ya?ml$/.test(name) ? name : `${name}.yaml` });
}
