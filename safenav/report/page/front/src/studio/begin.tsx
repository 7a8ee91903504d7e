/** New, Open and Save: menus and dialogs for scenarios. */

import { useEffect, useRef, useState } from "preact/hooks";
import type { Say } from "../live/player";
import { notice } from "../panels/button";
import { RunDownloads } from "./live";
import { Dialog, Menu } from "./menus";
import type { Doc } from "./model";

/** Input of a dialog. */
export type Asking =
  | { what: "open" }
  | { what: "save" }
  | { what: "replace"; name: string | undefined; message: string };

export type Ask = (asking: Asking | null) => void;

export function NewMenu({ templates, say }: { templates: Record<string, string>; say: Say }) {
  const [rows, setRows] = useState(7);
  const [cols, setCols] = useState(13);
  return (
    <Menu title="New">
      <p>
        <input aria-label="Rows" type="number" min={3} max={512} value={rows} onInput={(e) => setRows(Number(e.currentTarget.value))} /> x{" "}
        <input aria-label="Columns" type="number" min={3} max={512} value={cols} onInput={(e) => setCols(Number(e.currentTarget.value))} />
      </p>
      <button type="button" onClick={() => say("open", { kind: "blank", rows, cols })}>
        Blank map of that size
      </button>
      {Object.entries(templates).map(([name, about]) => (
        <button type="button" key={name} title={about} onClick={() => say("open", { kind: "template", name })}>
          Template: {name}
        </button>
      ))}
    </Menu>
  );
}

/** Send a scenario to the studio, and show errors. */
async function uploaded(file: File): Promise<void> {
  const response = await fetch(`upload?${new URLSearchParams({ name: file.name })}`, { method: "POST", body: file });
  if (!response.ok) notice(await response.text());
}

/** A button that opens a scenario of this computer. */
function FileButton({ words, chosen }: { words: string; chosen(file: File): void }) {
  const input = useRef<HTMLInputElement>(null);
  return (
    <>
      <button type="button" onClick={() => input.current!.click()}>
        {words}
      </button>
      <input
        ref={input}
        type="file"
        hidden
        accept=".yaml,.yml"
        onChange={(event) => {
          const file = event.currentTarget.files?.[0];
          event.currentTarget.value = ""; // the same file can be chosen again
          if (file) chosen(file);
        }}
      />
    </>
  );
}

interface SaveMenuProps {
  doc: Doc;
  ran: boolean;
  say: Say;
  ask: Ask;
}

export function SaveMenu({ doc, ran, say, ask }: SaveMenuProps) {
  return (
    <Menu title="Save" mark={doc.dirty && <span class="dirty" title="Unsaved changes" />}>
      <button type="button" onClick={() => save(doc, say, ask)}>
        {doc.file === null ? "Save …" : `Save ${doc.file}`}
      </button>
      {doc.file !== null && (
        <button type="button" onClick={() => ask({ what: "save" })}>
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
          <a href="save/played" download>
            Scenario as run
          </a>
          <button type="button" onClick={() => say("keep")}>
            Edit the scenario as run
          </button>
        </>
      )}
    </Menu>
  );
}

/** Saves to the file of the scenario; one without a file gets a name first. */
export function save(doc: Doc, say: Say, ask: Ask): void {
  if (doc.file === null) ask({ what: "save" });
  else say("save");
}

interface AskedProps {
  asking: Asking;
  doc: Doc;
  folder: string;
  files: string[] | null;
  say: Say;
  ask: Ask;
}

export function Asked({ asking, ...props }: AskedProps) {
  const { say, ask } = props;
  if (asking.what === "open") return <Open {...props} />;
  if (asking.what === "save") return <SaveAs {...props} />;
  return (
    <Dialog title="Replace the file" close={() => ask(null)}>
      <p>{asking.message}. Its content would be lost.</p>
      <form method="dialog" class="group row">
        <button class="primary" onClick={() => say("save", { name: asking.name, replace: true })}>
          Replace
        </button>
        <button>Cancel</button>
      </form>
    </Dialog>
  );
}

function Open({ folder, files, say, ask }: Omit<AskedProps, "asking">) {
  useEffect(() => say("files"), []);
  const [wanted, want] = useState("");
  const found = (files ?? []).filter((name) => name.toLowerCase().includes(wanted.toLowerCase()));
  const open = (data: object): void => {
    say("open", data);
    ask(null);
  };
  return (
    <Dialog title="Open a scenario" close={() => ask(null)}>
      <p class="quiet">{folder}</p>
      {files !== null && files.length > 8 && (
        <input aria-label="Find" placeholder="Find" value={wanted} onInput={(event) => want(event.currentTarget.value)} />
      )}
      <ul class="files">
        {found.map((name) => (
          <li key={name}>
            <button type="button" onClick={() => open({ kind: "file", name })}>
              {name}
            </button>
          </li>
        ))}
      </ul>
      {files !== null && found.length === 0 && (
        <p>
          No scenario{wanted && " of that name"} in this folder. Another folder: <code>safenav studio FOLDER</code>
        </p>
      )}
      <div class="group row">
        <FileButton
          words="From this computer …"
          chosen={(file) => {
            void uploaded(file);
            ask(null);
          }}
        />
      </div>
      <form method="dialog">
        <button>Cancel</button>
      </form>
    </Dialog>
  );
}

function SaveAs({ doc, folder, say, ask }: Omit<AskedProps, "asking">) {
  const title = doc.drawing?.name ?? "";
  const stem = title.toLowerCase().replace(/[^a-z0-9]+/g, "_").replace(/^_+|_+$/g, "");
  const [name, setName] = useState(doc.file ?? `${stem || "scenario"}.yaml`);
  return (
    <Dialog title="Save as" close={() => ask(null)}>
      <form
        class="group row"
        onSubmit={(event) => {
          event.preventDefault();
          say("save", { name: /\.ya?ml$/.test(name) ? name : `${name}.yaml` });
          ask(null);
        }}
      >
        <input aria-label="File name" autofocus value={name} onInput={(event) => setName(event.currentTarget.value)} onFocus={(event) => event.currentTarget.select()} />
        <button class="primary">Save</button>
      </form>
      <p class="quiet">In {folder}</p>
      <form method="dialog">
        <button>Cancel</button>
      </form>
    </Dialog>
  );
}
